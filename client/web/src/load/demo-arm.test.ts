// The demo arm is a tree of links that can be bodies.
import { expect, test } from "vitest";
import { demoArm } from "./demo-arm";

test("each joint connects links that exist, and each link but the base has one", () => {
  const text = demoArm();
  const all = (pattern: RegExp): string[] => [...text.matchAll(pattern)].map(([, name = ""]) => name);
  const links = all(/<link name="(\w+)">/g);
  expect(all(/<child link="(\w+)"/g).toSorted()).toEqual(links.filter((name) => name !== "base").toSorted());
  expect(all(/<parent link="(\w+)"/g).every((name) => links.includes(name))).toBe(true);
  expect(text).not.toMatch(/NaN|undefined/);
});

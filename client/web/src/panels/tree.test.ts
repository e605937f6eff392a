// The tree of links, and the assignment of a report's findings to links.
import { expect, test } from "vitest";
import type { Finding } from "../state/report";
import { depthsOf, findingsOf } from "./tree";

const link = (name: string, parent: number) => ({ name, parent, movable: true, mass: 1 });

test("links are as deep as they have links above them", () => {
  expect(depthsOf([link("base", -1), link("left", 0), link("finger", 1), link("right", 0)])).toEqual([0, 1, 2, 1]);
});

test("a warning is shown at the link or joint that it names", () => {
  const finding = (element: string, severity: Finding["severity"] = "warning"): Finding => ({ severity, disposition: "repaired", element, line: 1, message: "m", file: "" });
  const all = [finding('joint "elbow" limit'), finding('link "arm" inertial'), finding('link "arm2" inertial'), finding('link "arm" visual', "info")];
  expect(findingsOf(all, "arm", "elbow").map(({ element }) => element)).toEqual(['joint "elbow" limit', 'link "arm" inertial']);
  expect(findingsOf(all, "base", undefined)).toEqual([]);
});

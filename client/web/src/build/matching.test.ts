// A list of hundreds of robots is short: groups by name, a filter, and only the lines that are in view.
import { expect, test } from "vitest";
import { inView, linesOf, stemOf } from "./matching";

const NONE = new Set<string>();
const text = (names: string[], filter = "", closed: ReadonlySet<string> = NONE) =>
  linesOf(names, filter, closed).map((line) => (line.kind === "group" ? `[${line.name} ${line.robots.length}]` : `${line.indented ? "  " : ""}${line.name}`));

test("robots with one name before their number are a group, from three on", () => {
  expect(text(["arm", "arm_1", "ground", "arm_2", "crate_1", "crate_2"])).toEqual(["[arm 3]", "  arm", "  arm_1", "  arm_2", "ground", "crate_1", "crate_2"]);
  expect([stemOf("crate-7"), stemOf("crate7"), stemOf("42"), stemOf("r2d2_left")]).toEqual(["crate", "crate", "42", "r2d2_left"]);
});

test("a closed group is its heading, but not while something is looked for", () => {
  const names = ["a_1", "a_2", "a_3", "b"];
  expect(text(names, "", new Set(["a"]))).toEqual(["[a 3]", "b"]);
  expect(text(names, "_2", new Set(["a"]))).toEqual(["a_2"]);
  expect(text(names, "A _", new Set(["a"]))).toEqual(["[a 3]", "  a_1", "  a_2", "  a_3"]);
});

test("only the lines in view are rendered, and some beyond", () => {
  expect(inView(0, 300, 30, 1000, 5)).toEqual([0, 15]);
  expect(inView(3000, 300, 30, 1000, 5)).toEqual([95, 115]);
  expect(inView(29_900, 300, 30, 1000, 5)).toEqual([991, 1000]);
  expect(inView(0, 300, 30, 3, 5)).toEqual([0, 3]);
});

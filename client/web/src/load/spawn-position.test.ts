// A loaded robot is not spawned inside another.
import { expect, test } from "vitest";
import { liftOf, nextPlace, shiftOf } from "./spawn-position";

test("the first robot is spawned at the origin", () => {
  expect(nextPlace(new Map())).toBe(0);
});

test("the next is spawned a metre to the left of the leftmost part", () => {
  expect(
    nextPlace(
      new Map([
        ["arm", { lower: -0.2, upper: 0.4, bottom: 0 }],
        ["leg", { lower: -3, upper: -3, bottom: Infinity }],
      ]),
    ),
  ).toBeCloseTo(1.4, 12);
});

test("one that reaches into others goes to the left until there is a gap", () => {
  const all = new Map([
    ["arm", { lower: -0.2, upper: 0.4, bottom: 0 }],
    ["wide", { lower: -0.6, upper: 3.4, bottom: 0 }],
  ]);
  expect(shiftOf("wide", all)).toBeCloseTo(1.2, 12);
  expect(shiftOf("wide", new Map([...all, ["wide", { lower: 0.7, upper: 3, bottom: 0 }]]))).toBe(0);
  expect(shiftOf("wide", new Map([["wide", { lower: -1, upper: 1, bottom: 0 }]]))).toBe(0);
});

test("one that reaches into the ground goes up, and one that only touches it or has no collision shapes stays", () => {
  const all = new Map([
    ["rover", { lower: -1, upper: 1, bottom: -0.15 }],
    ["arm", { lower: -1, upper: 1, bottom: -1e-6 }],
    ["ghost", { lower: 0, upper: 0, bottom: Infinity }],
  ]);
  expect([...all.keys()].map((robot) => liftOf(robot, all))).toEqual([0.15, 0, 0]);
  expect(liftOf("unknown", all)).toBe(0);
});

// The ends of sliders, and the steps on them.
import { expect, test } from "vitest";
import type { Axis } from "../state/world";
import { fractionOf, niceStep, nudgeOf, rangeOf, turned } from "./range";
import { unitOf } from "./quantity";

const axis: Axis = {
  key: "arm/elbow", robot: "arm", joint: "elbow", axis: 0, label: "elbow", kind: "angle",
  positionIndex: 0, velocityIndex: 0, childLink: "forearm", actuated: true, claimedBy: "",
};

test("limits are the ends of a slider", () => {
  const range = rangeOf({ ...axis, lower: -1, upper: 2, velocityLimit: 3, effortLimit: 40 }, "position");
  expect(range).toEqual({ lower: -1, upper: 2, openLower: false, openUpper: false });
  expect(rangeOf({ ...axis, velocityLimit: 3 }, "velocity")).toMatchObject({ lower: -3, upper: 3, openUpper: false });
  expect(rangeOf({ ...axis, effortLimit: 40 }, "effort")).toMatchObject({ lower: -40, upper: 40 });
});

test("a joint without limits is one turn wide with open ends", () => {
  expect(rangeOf(axis, "position")).toEqual({ lower: -Math.PI, upper: Math.PI, openLower: true, openUpper: true });
  expect(rangeOf({ ...axis, lower: 1 }, "position")).toMatchObject({ lower: 1, openLower: false, openUpper: true });
});

test("every range has a length", () => {
  const same = rangeOf({ ...axis, lower: 1, upper: 1 }, "position");
  expect(same.upper).toBeGreaterThan(same.lower);
  const still = rangeOf({ ...axis, velocityLimit: 0, effortLimit: Infinity }, "velocity");
  expect(still.upper).toBeGreaterThan(still.lower);
});

test("a place on the slider stays on it", () => {
  const range = rangeOf(axis, "position");
  expect(fractionOf(0, range)).toBe(0.5);
  expect(fractionOf(9, range)).toBe(1);
  expect(fractionOf(-9, range)).toBe(0);
  expect(fractionOf(NaN, range)).toBe(0);
});

test("an arrow key moves by a round number in the unit that is shown", () => {
  const range = rangeOf(axis, "position");
  expect(nudgeOf(range, unitOf("angle", "position", false))).toBeCloseTo(0.02, 12);
  expect(nudgeOf(range, unitOf("angle", "position", true))).toBeCloseTo(Math.PI / 180, 12);
  expect(niceStep(0.0749)).toBeCloseTo(0.05, 12);
  expect(niceStep(0)).toBe(0.01);
});

test("a continuous joint is shown on its present turn, which changes only when the joint leaves it", () => {
  const first = rangeOf(axis, "position");
  expect(turned(first, Math.PI, first)).toBe(first);
  const next = turned(first, 4, first);
  expect([next.lower, next.upper]).toEqual([Math.PI, 3 * Math.PI]);
  expect(turned(first, Math.PI + 0.01, next)).toBe(next);
  expect(turned(first, -40, next).lower).toBeCloseTo(-13 * Math.PI, 9);
  const limited = rangeOf({ ...axis, lower: -1, upper: 1 }, "position");
  expect(turned(limited, 40, first)).toBe(limited);
});

// Part of a recording that is shown.
import { expect, test } from "vitest";
import { firstAt, following, indicesBetween, valueExtent } from "./visible";

const times = Float64Array.from({ length: 101 }, (_, index) => index / 10);

test("a time is found between samples", () => {
  expect(firstAt(times, 5)).toBe(50);
  expect(firstAt(times, 5.01)).toBe(51);
  expect(firstAt(times, -1)).toBe(0);
  expect(firstAt(times, 99)).toBe(101);
});

test("the shown samples reach beyond both edges by one", () => {
  expect(indicesBetween(times, { min: 2, max: 3 })).toEqual({ from: 19, to: 31 });
  expect(indicesBetween(times, { min: -5, max: 50 })).toEqual({ from: 0, to: 101 });
  expect(indicesBetween([], { min: 0, max: 1 })).toEqual({ from: 0, to: 0 });
});

test("a plot fills from the left, then follows the newest sample", () => {
  expect(following(times, 20)).toEqual({ min: 0, max: 20 });
  expect(following(times, 4)).toEqual({ min: 6, max: 10 });
});

test("all values are within the axis, absent ones do not count, and noise stays small", () => {
  const { min, max } = valueExtent([new Float64Array([1, NaN, 3]), new Float64Array([-1, 0])], 0.01);
  expect(min).toBeLessThan(-1);
  expect(max).toBeGreaterThan(3);
  const noise = valueExtent([new Float64Array([1, 1 + 1e-9])], 0.01);
  expect(noise.max - noise.min).toBeCloseTo(0.01, 6);
  expect(valueExtent([new Float64Array([NaN])], 2)).toEqual({ min: -1, max: 1 });
});

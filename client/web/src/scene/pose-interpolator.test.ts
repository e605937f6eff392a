// The picture moves evenly from one state to the next, and jumps if they are not consecutive.
import { expect, test } from "vitest";
import type { Frame } from "../state/world";
import { interpolate, PoseInterpolator } from "./pose-interpolator";

function state(sequence: number, receivedAt: number, x: number, epoch = 0): Frame {
  const poses = new Map([["arm", Float64Array.of(x, 0, 0, 0, 0, 0, 1)]]);
  return { sequence: BigInt(sequence), epoch: BigInt(epoch), step: 0n, simTime: 0, receivedAt, joints: new Map(), poses, contacts: [] };
}

function xAt(interpolator: PoseInterpolator, now: number): number | undefined {
  const out = new Float64Array(7);
  return interpolator.sample("arm", now, out) ? out[0] : undefined;
}

test("poses are interpolated by the time since the last state arrived", () => {
  const interpolator = new PoseInterpolator();
  interpolator.push(state(1, 0, 0));
  interpolator.push(state(2, 16, 1));
  expect(xAt(interpolator, 16)).toBe(0);
  expect(xAt(interpolator, 20)).toBeCloseTo(0.25, 12);
  expect(interpolator.isSettled(20)).toBe(false);
  expect(xAt(interpolator, 32)).toBe(1);
  expect(xAt(interpolator, 99)).toBe(1);
  expect(interpolator.isSettled(32)).toBe(true);
});

test("the first state is shown at once", () => {
  const interpolator = new PoseInterpolator();
  expect(xAt(interpolator, 0)).toBeUndefined();
  interpolator.push(state(1, 0, 3));
  expect(xAt(interpolator, 0)).toBe(3);
  expect(interpolator.reached(0)?.sequence).toBe(1n);
});

test("a state is reached at the end of its interpolation", () => {
  const interpolator = new PoseInterpolator();
  interpolator.push(state(1, 0, 0));
  interpolator.push(state(2, 16, 1));
  expect(interpolator.reached(20)?.sequence).toBe(1n);
  expect(interpolator.reached(32)?.sequence).toBe(2n);
});

test("there is no interpolation after a reset, a pause or another daemon", () => {
  for (const next of [state(2, 16, 1, 1), state(2, 5000, 1), state(1, 16, 1)]) {
    const interpolator = new PoseInterpolator();
    interpolator.push(state(1, 0, 0));
    interpolator.push(next);
    expect(xAt(interpolator, next.receivedAt)).toBe(1);
  }
});

test("the interpolation between rare states has a bounded duration", () => {
  const interpolator = new PoseInterpolator();
  interpolator.push(state(1, 0, 0));
  interpolator.push(state(2, 250, 1));
  expect(xAt(interpolator, 350)).toBe(1);
});

test("if no link moves, nothing is interpolated, and the newest state is shown at once", () => {
  const interpolator = new PoseInterpolator();
  interpolator.push(state(1, 0, 0));
  interpolator.push(state(2, 16, 1));
  expect(interpolator.isStill()).toBe(false);
  interpolator.push(state(3, 32, 1));
  expect(interpolator.isStill()).toBe(true);
  expect(interpolator.isSettled(32)).toBe(true);
  expect(interpolator.reached(32)?.sequence).toBe(3n);
});

test("half way between two rotations is half the angle, by the shorter way", () => {
  const turned = (angle: number, sign = 1) => Float64Array.of(0, 0, 0, 0, 0, sign * Math.sin(angle / 2), sign * Math.cos(angle / 2));
  const out = new Float64Array(7);
  for (const sign of [1, -1]) {
    interpolate(turned(0.2), turned(1.4, sign), 0, 0.5, out);
    expect(2 * Math.atan2(out[5] ?? 0, out[6] ?? 0)).toBeCloseTo(0.8, 12);
  }
  interpolate(turned(0.2), turned(0.2 + 1e-9), 0, 0.5, out);
  expect(Math.hypot(...out.subarray(3))).toBeCloseTo(1, 12);
});

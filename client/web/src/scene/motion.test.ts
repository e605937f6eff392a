// The picture goes evenly from one state to the next, and jumps where one does not follow from the other.
import { expect, test } from "vitest";
import type { Frame } from "../state/world";
import { interpolate, Motion } from "./motion";

function state(sequence: number, receivedAt: number, x: number, epoch = 0): Frame {
  const poses = new Map([["arm", Float64Array.of(x, 0, 0, 0, 0, 0, 1)]]);
  return { sequence: BigInt(sequence), epoch: BigInt(epoch), step: 0n, simTime: 0, receivedAt, joints: new Map(), poses, contacts: [] };
}

function xAt(motion: Motion, now: number): number | undefined {
  const out = new Float64Array(7);
  return motion.sample("arm", now, out) ? out[0] : undefined;
}

test("between two states the picture is as far as the time since the last one came", () => {
  const motion = new Motion();
  motion.push(state(1, 0, 0));
  motion.push(state(2, 16, 1));
  expect(xAt(motion, 16)).toBe(0);
  expect(xAt(motion, 20)).toBeCloseTo(0.25, 12);
  expect(motion.isSettled(20)).toBe(false);
  expect(xAt(motion, 32)).toBe(1);
  expect(xAt(motion, 99)).toBe(1);
  expect(motion.isSettled(32)).toBe(true);
});

test("the first state is shown at once", () => {
  const motion = new Motion();
  expect(xAt(motion, 0)).toBeUndefined();
  motion.push(state(1, 0, 3));
  expect(xAt(motion, 0)).toBe(3);
  expect(motion.reached(0)?.sequence).toBe(1n);
});

test("a state of which the picture is still on its way is not reached", () => {
  const motion = new Motion();
  motion.push(state(1, 0, 0));
  motion.push(state(2, 16, 1));
  expect(motion.reached(20)?.sequence).toBe(1n);
  expect(motion.reached(32)?.sequence).toBe(2n);
});

test("after a reset, a pause or another daemon the picture jumps", () => {
  for (const next of [state(2, 16, 1, 1), state(2, 5000, 1), state(1, 16, 1)]) {
    const motion = new Motion();
    motion.push(state(1, 0, 0));
    motion.push(next);
    expect(xAt(motion, next.receivedAt)).toBe(1);
  }
});

test("states that come seldom are gone to quickly", () => {
  const motion = new Motion();
  motion.push(state(1, 0, 0));
  motion.push(state(2, 250, 1));
  expect(xAt(motion, 350)).toBe(1);
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

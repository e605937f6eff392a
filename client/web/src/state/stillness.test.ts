// Test of whether a world is still.
import { expect, test } from "vitest";
import { isStill, samePoses } from "./stillness";
import type { Frame } from "./world";

function frame(more: { z?: number; position?: number; target?: number; epoch?: bigint; robot?: string } = {}): Frame {
  const { z = 0, position = 0.5, target = 0.5, epoch = 1n, robot = "arm" } = more;
  return {
    sequence: 1n,
    epoch,
    step: 1n,
    simTime: 0,
    receivedAt: 0,
    joints: new Map([[robot, { position: [position], velocity: [0], effort: [1], target: [target], mode: ["position"], flags: [0] }]]),
    poses: new Map([[robot, Float64Array.of(0, 0, z, 0, 0, 0, 1)]]),
    contacts: [],
  };
}

test("a difference too small to be drawn counts as still", () => {
  expect(isStill(frame(), frame({ z: 1e-7, position: 0.50001 }))).toBe(true);
});

test("a link that moves, a target and a reset are seen", () => {
  expect(samePoses(frame(), frame({ z: 1e-4 }))).toBe(false);
  expect(isStill(frame(), frame({ target: 0.6 }))).toBe(false);
  expect(samePoses(frame(), frame({ target: 0.6 }))).toBe(true);
  expect(isStill(frame(), frame({ epoch: 2n }))).toBe(false);
});

test("another robot, and a value that is not a number, are not rest", () => {
  expect(isStill(frame(), frame({ robot: "leg" }))).toBe(false);
  expect(isStill(frame({ position: NaN }), frame({ position: NaN }))).toBe(false);
});

// A row of a ball joint sets one of three targets, and the other two stay.
import { expect, test } from "vitest";
import { quaternionOf } from "../state/joint-values";
import type { Axis, Frame, JointValues, Mode } from "../state/world";
import { BallTargets } from "./ball-targets";
import { ballTargetOf } from "./targets";

function axis(part: number, joint = "hip"): Axis {
  return {
    key: `dog/${joint}/${part}`, robot: "dog", joint, axis: part, label: joint, kind: "angle", isBall: true,
    positionIndex: 0, velocityIndex: part, childLink: "leg", actuated: true, claimedBy: "",
  };
}

function state(mode: Mode): Frame {
  const values: JointValues = {
    position: quaternionOf([0.1, 0.2, 0.3]),
    velocity: [1, 2, 3],
    effort: [4, 5, 6],
    target: [0, 0, 0.5],
    mode: [mode, mode, mode],
    flags: [0, 0, 0],
  };
  return { sequence: 0n, epoch: 0n, step: 0n, simTime: 0, receivedAt: 0, joints: new Map([["dog", values]]), poses: new Map(), contacts: [] };
}

const close = (...values: number[]): unknown[] => values.map((value) => expect.closeTo(value, 12));

test("the other two keep their targets", () => {
  const [target] = new BallTargets().of([{ axis: axis(1), mode: "position", value: -0.4 }], state("position"), 0);
  expect(target?.values).toEqual(close(0, -0.4, 0.5));
});

test("in a new mode the other two targets keep their values, so that nothing jerks", () => {
  const [target] = new BallTargets().of([{ axis: axis(0), mode: "velocity", value: 7 }], state("position"), 0);
  expect(target).toMatchObject({ mode: "velocity", values: [7, 2, 3] });
});

test("rows that are moved together are one target", () => {
  const moved = [0, 2].map((part) => ({ axis: axis(part), mode: "position" as Mode, value: part + 1 }));
  const targets = new BallTargets().of([...moved, { axis: axis(0, "other"), mode: "hold" as Mode, value: 0 }], state("hold"), 0);
  expect(targets.map(({ axis: { joint }, values }) => [joint, values])).toEqual([
    ["hip", close(1, 0.2, 3)],
    ["other", close(0, 0, 0.5)],
  ]);
});

test("a sent target counts until a state contains it, however slow the daemon is", () => {
  const balls = new BallTargets();
  const set = (sequence: bigint, now: number) => balls.of([{ axis: axis(1), mode: "position", value: 2 }], { ...state("position"), sequence }, now);
  const first = balls.of([{ axis: axis(0), mode: "position", value: 1 }], state("position"), 0);
  expect(set(1n, 5000)[0]?.values).toEqual(close(1, 2, 0.5));
  // The first is no longer the last one.
  balls.applied(first, 3n);
  balls.applied(set(4n, 5000), 8n);
  expect(set(7n, 6000)[0]?.values).toEqual(close(1, 2, 0.5));
  balls.applied(set(7n, 6000), 8n);
  expect(set(8n, 6000)[0]?.values).toEqual(close(0, 2, 0.5));
});

test("a refused target does not count, nor one of a daemon that was restarted", () => {
  const balls = new BallTargets();
  const set = (now: number) => balls.of([{ axis: axis(1), mode: "position", value: 2 }], state("position"), now);
  balls.refused(balls.of([{ axis: axis(0), mode: "position", value: 1 }], state("position"), 0));
  expect(set(10)[0]?.values).toEqual(close(0, 2, 0.5));
  balls.applied(balls.of([{ axis: axis(0), mode: "position", value: 1 }], state("position"), 20), 1000n);
  expect(set(60_000)[0]?.values).toEqual(close(0, 2, 0.5));
});

test("axes of other joints are left to others", () => {
  const { isBall: _, ...plain } = axis(0);
  expect(new BallTargets().of([{ axis: plain, mode: "position", value: 1 }], state("position"), 0)).toEqual([]);
});

test("a target is a message for the whole joint", () => {
  const sent = ballTargetOf(axis(2), "position", [0, 0, Math.PI]);
  expect(sent).toMatchObject({ joint: "hip", axis: 0, target: { case: "sphericalPosition" } });
  expect(ballTargetOf(axis(2), "velocity", [1, 2, 3])).toEqual({
    joint: "hip", axis: 0, target: { case: "sphericalVelocity", value: { angularVelocity: { x: 1, y: 2, z: 3 } } },
  });
  expect(ballTargetOf(axis(2), "effort", [1, 2, 3])).toMatchObject({ target: { case: "sphericalEffort", value: { torque: { x: 1, y: 2, z: 3 } } } });
  expect(ballTargetOf(axis(2), "hold", [1, 2, 3])).toMatchObject({ axis: 0, target: { case: "hold" } });
  expect(ballTargetOf(axis(2), "none", [1, 2, 3])).toBeUndefined();
});

// Moves by handles, about and along the axis of a joint, and their undo and redo.
import { createRouterTransport } from "@connectrpc/connect";
import { expect, test, vi } from "vitest";
import { servicesOver } from "../daemon/services";
import { EntityService } from "../gen/simd/v1/entity_pb";
import { JointMode, JointService } from "../gen/simd/v1/joint_pb";
import { SimulationService, SimulationState } from "../gen/simd/v1/simulation_pb";
import type { Pose } from "../state/scene";
import { redo, undo } from "../state/undo";
import { frame, robots, simulation, type Frame, type Robot } from "../state/world";
import { placed, slideAlong, turnAbout } from "./placement";

const targets: number[] = [];
const resets: number[] = [];
/** The daemon's elbow and world. */
let elbow = 0.125;
let state = SimulationState.PLAYING;
const services = servicesOver(
  createRouterTransport(({ service }) => {
    service(JointService, {
      getJointStates: () => ({ states: { robots: [{ robot: "arm", position: [elbow], mode: [JointMode.POSITION] }] } }),
      resetJoints: ({ robots }) => {
        resets.push(robots[0]?.joints[0]?.position ?? NaN);
        return {};
      },
      setJointTargets: ({ robots }) => {
        for (const { target } of robots[0]?.joints ?? []) if (target.case === "position") targets.push((elbow = target.value.position));
        return { stamp: { sequence: 7n } };
      },
    });
    service(SimulationService, { getSimulationState: () => ({ state }) });
    service(EntityService, {
      getEntityState: () => ({ pose: { position: { x: place }, orientation: { w: 1 } } }),
      setEntityState: ({ pose }) => {
        place = pose?.position?.x ?? NaN;
        return { stamp: { sequence: 9n } };
      },
    });
  }),
);
/** Position of the robot in the daemon, along x. */
let place = 0;

vi.mock("../daemon/services", async (original) => ({ ...(await original<typeof import("../daemon/services")>()), services: () => services }));
vi.mock("../daemon/page", () => ({ daemonConnection: () => ({ pollNow: () => undefined }) }));

const half = Math.SQRT1_2;
const upright: Pose = [1, 2, 3, 0, 0, 0, 1];
/** z along the world's x. */
const lying: Pose = [0, 0, 0, 0, half, 0, half];

test("a turn is about the z axis at its start", () => {
  const about = (angle: number): Pose => [1, 2, 3, 0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  for (const angle of [0, 0.3, -1.2, 3]) expect(turnAbout(upright, about(angle))).toBeCloseTo(angle, 12);
  // The quaternion of the other sign is the same turn.
  const [x, y, z, a, b, c, d] = about(0.3);
  expect(turnAbout(upright, [x, y, z, -a, -b, -c, -d])).toBeCloseTo(0.3, 12);
});

test("a slide is along the z axis at its start", () => {
  expect(slideAlong(upright, [1.5, 2.5, 3.25, 0, 0, 0, 1])).toBeCloseTo(0.25, 12);
  expect(slideAlong(lying, [0.5, 7, 9, 0, half, 0, half])).toBeCloseTo(0.5, 12);
});

test("undo and redo move a joint, even if no state has arrived in between", async () => {
  const axis = { key: "arm/elbow", robot: "arm", joint: "elbow", axis: 0, label: "elbow", kind: "angle", positionIndex: 0, velocityIndex: 0, actuated: true };
  robots.value = [{ name: "arm", axes: [axis] } as unknown as Robot];
  // The page's last state and world are older than the daemon's.
  const joints = new Map([["arm", { position: [0], velocity: [0], effort: [0], target: [0], mode: ["position"], flags: [0] }]]);
  frame.value = { sequence: 1n, joints } as unknown as Frame;
  simulation.value = { ...simulation.peek(), state: "paused" };
  const drag = placed({ robot: "arm", joint: "elbow" });
  const turned = (angle: number): Pose => [1, 2, 3, 0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  await drag.to(turned(0.25), upright);
  expect(await drag.end(upright, turned(0.5))).toBe(7n);
  await undo();
  await redo();
  expect(targets.map((target) => Number(target.toFixed(9)))).toEqual([0.375, 0.625, 0.125, 0.625]);
  expect(resets).toEqual([]);
  // A paused world does not move joints to their targets.
  state = SimulationState.PAUSED;
  await placed({ robot: "arm", joint: "elbow" }).end(upright, turned(0.25));
  expect(resets.map((position) => Number(position.toFixed(9)))).toEqual([0.875]);
});

test("undo returns a dragged robot to the daemon's pose, not to the drawn one", async () => {
  place = 0.5;
  const at = (x: number): Pose => [x, 0, 0, 0, 0, 0, 1];
  const drag = placed({ robot: "arm" });
  await drag.to(at(1), at(0.4));
  expect(await drag.end(at(0.4), at(2))).toBe(9n);
  expect(place).toBe(2);
  await undo();
  expect(place).toBe(0.5);
});

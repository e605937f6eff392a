// Moves by handles, about and along the axis of a joint, and their undo and redo.
import { createRouterTransport } from "@connectrpc/connect";
import { expect, test, vi } from "vitest";
import { servicesOver } from "../daemon/services";
import { EntityService } from "../gen/simd/v1/entity_pb";
import { JointMode, JointService } from "../gen/simd/v1/joint_pb";
import { KinematicsService, type ComputeInverseKinematicsRequest } from "../gen/simd/v1/kinematics_pb";
import { SimulationService, SimulationState } from "../gen/simd/v1/simulation_pb";
import type { Pose } from "../state/scene";
import { toasts } from "../state/toasts";
import { redo, undo } from "../state/undo";
import { frame, robots, simulation, type Frame, type Robot } from "../state/world";
import { placed, setCoordinates, slideAlong, turnAbout } from "./placement";

const targets: number[] = [];
const resets: number[] = [];
/** The daemon's elbow and world. */
let elbow = 0.125;
let state = SimulationState.PLAYING;
const transport = createRouterTransport(({ service }) => {
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
    getEntityState: () => ({ pose: { position: { x: place, z: height }, orientation: { w: 1 } } }),
    setEntityState: ({ pose }) => {
      place = pose?.position?.x ?? NaN;
      height = pose?.position?.z ?? NaN;
      return { stamp: { sequence: 9n } };
    },
    getLinkPoses: () => ({ robots: [{ robot: "arm", poses: [...upright, 0.25, 0.5, 0.75, half, 0, 0, half] }] }),
  });
  service(KinematicsService, {
    computeInverseKinematics: (request) => {
      solved.push(request);
      return { positions: [0.5], converged: true };
    },
  });
});
const services = servicesOver(transport);
/** Position of the robot in the daemon, along x and z. */
let place = 0;
let height = 0;
const solved: ComputeInverseKinematicsRequest[] = [];

vi.mock("../daemon/services", async (original) => ({ ...(await original<typeof import("../daemon/services")>()), services: () => services, transport: () => transport }));
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

test("a number of a pose changes only itself, and the others stay as the daemon has them", async () => {
  const arm = { name: "arm", links: ["base", "hand"], axes: robots.peek()[0]?.axes } as unknown as Robot;
  // The page's last state is older than a drag, which has moved the robot to 2.
  frame.value = { sequence: 1n, joints: new Map(), poses: new Map([["arm", new Float64Array(upright)]]) } as unknown as Frame;
  [place, height] = [2, 0];
  expect(await setCoordinates(arm, undefined, new Map([[2, 0.75]]))).toBe(9n);
  expect([place, height]).toEqual([2, 0.75]);
  // A link keeps its orientation: with few joints only its position is asked for.
  expect(await setCoordinates(arm, "hand", new Map([[2, 1]]))).toBe(7n);
  expect(solved.map(({ target }) => [target?.position?.x, target?.position?.y, target?.position?.z, target?.orientation])).toEqual([[0.25, 0.5, 1, undefined]]);
});

test("a number of a link that has gone is reported", async () => {
  toasts.value = [];
  expect(await setCoordinates({ name: "arm", links: ["base"], axes: [] } as unknown as Robot, "hand", new Map([[2, 1]]))).toBeUndefined();
  expect(toasts.value.map(({ sentence }) => sentence)).toEqual(["Arm was loaded again meanwhile; try once more."]);
});

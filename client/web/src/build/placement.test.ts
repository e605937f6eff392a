// Moves by handles, about and along the axis of a joint, and their undo and redo.
import { createRouterTransport } from "@connectrpc/connect";
import { expect, test, vi } from "vitest";
import { servicesOver } from "../daemon/services";
import { JointService } from "../gen/simd/v1/joint_pb";
import type { Pose } from "../state/scene";
import { redo, undo } from "../state/undo";
import { frame, robots, type Frame, type Robot } from "../state/world";
import { JointPlacement, slideAlong, turnAbout } from "./placement";

const targets: number[] = [];
const services = servicesOver(
  createRouterTransport(({ service }) =>
    service(JointService, {
      resetJoints: () => ({}),
      setJointTargets: ({ robots }) => {
        for (const { target } of robots[0]?.joints ?? []) if (target.case === "position") targets.push(target.value.position);
        return {};
      },
    }),
  ),
);

vi.mock("../daemon/services", async (original) => ({ ...(await original<typeof import("../daemon/services")>()), services: () => services }));
vi.mock("../daemon/page", () => ({ daemonConnection: () => ({ pollNow: () => undefined }) }));

const half = Math.SQRT1_2;
const upright: Pose = [1, 2, 3, 0, 0, 0, 1];
/** z along the world's x. */
const lying: Pose = [0, 0, 0, 0, half, 0, half];

test("a turn is about the z of where it began", () => {
  const about = (angle: number): Pose => [1, 2, 3, 0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  for (const angle of [0, 0.3, -1.2, 3]) expect(turnAbout(upright, about(angle))).toBeCloseTo(angle, 12);
  // The quaternion of the other sign is the same turn.
  const [x, y, z, a, b, c, d] = about(0.3);
  expect(turnAbout(upright, [x, y, z, -a, -b, -c, -d])).toBeCloseTo(0.3, 12);
});

test("a slide is along the z of where it began", () => {
  expect(slideAlong(upright, [1.5, 2.5, 3.25, 0, 0, 0, 1])).toBeCloseTo(0.25, 12);
  expect(slideAlong(lying, [0.5, 7, 9, 0, half, 0, half])).toBeCloseTo(0.5, 12);
});

test("a joint that was moved goes back and there again, though no state has come in between", async () => {
  const axis = { key: "arm/elbow", robot: "arm", joint: "elbow", axis: 0, label: "elbow", kind: "angle", positionIndex: 0, velocityIndex: 0, actuated: true };
  robots.value = [{ name: "arm", axes: [axis] } as unknown as Robot];
  const joints = new Map([["arm", { position: [0.125], velocity: [0], effort: [0], target: [0], mode: ["position"], flags: [0] }]]);
  frame.value = { sequence: 1n, joints } as unknown as Frame;
  await new JointPlacement("arm", "elbow").end(upright, [1, 2, 3, 0, 0, Math.sin(0.25), Math.cos(0.25)]);
  await undo();
  await redo();
  expect(targets.map((target) => Number(target.toFixed(9)))).toEqual([0.625, 0.125, 0.625]);
});

// Targets that the page sends, and its messages if the daemon refuses them.
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { beforeEach, expect, test, vi } from "vitest";
import { JointMode, JointService } from "../gen/simd/v1/joint_pb";
import { toasts } from "../state/toasts";
import { future, past, redo, undo } from "../state/undo";
import { frame, type Axis, type Frame } from "../state/world";
import { presentValue, setTarget } from "./actions";
import { servicesOver } from "./services";

const sent: number[] = [];
let refused = false;

const services = servicesOver(
  createRouterTransport(({ service }) =>
    service(JointService, {
      getJointStates: () => ({ states: { robots: [{ robot: "arm", position: [0.75], velocity: [1], mode: [JointMode.VELOCITY] }] } }),
      setJointTargets: ({ robots }) => {
        if (refused) throw new ConnectError("joint elbow is claimed by lab", Code.FailedPrecondition);
        for (const { target } of robots[0]?.joints ?? []) if (target.case === "position") sent.push(target.value.position);
        return {};
      },
    }),
  ),
);

vi.mock("./services", async (original) => ({ ...(await original<typeof import("./services")>()), services: () => services }));
vi.mock("./page", () => ({ daemonConnection: () => ({ pollNow: () => undefined, pollAllNow: () => undefined }) }));

const elbow = { key: "arm/elbow", robot: "arm", joint: "elbow", axis: 0, kind: "angle", positionIndex: 0, velocityIndex: 0 } as Axis;

beforeEach(() => {
  const joints = new Map([["arm", { position: [0], velocity: [0], effort: [0], target: [0.25], mode: ["position"], flags: [0] }]]);
  frame.value = { sequence: 1n, joints } as unknown as Frame;
  refused = false;
  sent.length = 0;
  past.value = [];
  future.value = [];
  toasts.value = [];
});

test("a target is undone and redone", async () => {
  await setTarget(elbow, { mode: "position", value: 1 }, { mode: "position", value: 0.25 });
  await undo();
  await redo();
  expect(sent).toEqual([1, 0.25, 1]);
  expect(toasts.value.map(({ kind }) => kind)).toEqual(["info", "info"]);
});

test("an undo or redo that the daemon refuses is not counted as done, and the page says so", async () => {
  await setTarget(elbow, { mode: "position", value: 1 }, { mode: "position", value: 0.25 });
  refused = true;
  await undo();
  expect(toasts.value.map(({ kind, sentence }) => [kind, sentence])).toEqual([["error", "The target of arm/elbow cannot be undone: Joint elbow is claimed by lab."]]);
  refused = false;
  await setTarget(elbow, { mode: "position", value: 2 }, { mode: "position", value: 1 });
  await undo();
  toasts.value = [];
  refused = true;
  await redo();
  expect(toasts.value.map(({ kind }) => kind)).toEqual(["error"]);
});

test("the present value of a moving joint is the daemon's, and not that of the page's last state", async () => {
  expect(await presentValue(elbow, "position")).toBe(0.75);
  expect(await presentValue(elbow, "velocity")).toBe(1);
});

// A robot that this page has loaded belongs to it as long as it is the same robot, under any name.
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { beforeEach, expect, test, vi } from "vitest";
import { ContactService } from "../gen/simd/v1/contact_pb";
import { EntityService, type SpawnEntityRequest } from "../gen/simd/v1/entity_pb";
import { JointMode, JointService, JointType } from "../gen/simd/v1/joint_pb";
import { toasts } from "../state/toasts";
import { future, past, redo, undo } from "../state/undo";
import { selectedRobot } from "../state/view";
import { frame, robots, type Axis, type Frame } from "../state/world";
import { bringIn, duplicate, moveTo, noteMove, noteSpawn, takeOut } from "./building";
import { servicesOver } from "./services";

/** Robots by name, with their versions. */
const world = new Map<string, bigint>();
const spawned: SpawnEntityRequest[] = [];
const moved: number[] = [];
/** Position of the elbow of each robot. */
let elbow = 0;
let versions = 0n;

/** Loads a robot, as this page or another client does. */
function put(name: string): { name: string; layoutVersion: bigint } {
  versions += 1n;
  world.set(name, versions);
  return { name, layoutVersion: versions };
}

function found(robot: string): { name: string; layoutVersion: bigint; description: string } {
  const layoutVersion = world.get(robot);
  if (layoutVersion === undefined) throw new ConnectError(`there is no robot ${robot}`, Code.NotFound);
  return { name: robot, layoutVersion, description: "of its own" };
}

const services = servicesOver(
  createRouterTransport(({ service }) => {
    service(EntityService, {
      spawnEntity: (request) => {
        spawned.push(request);
        const isTaken = world.has(request.name) && request.allowRenaming;
        return { entity: put(isTaken ? `${request.name}_1` : request.name) };
      },
      deleteEntity: ({ robot }) => {
        found(robot);
        world.delete(robot);
        return {};
      },
      getEntityInfo: ({ robot }) => ({ entity: found(robot) }),
      getEntityState: () => ({ pose: { position: {}, orientation: { w: 1 } } }),
      setEntityState: ({ pose }) => {
        moved.push(pose?.position?.x ?? NaN);
        return {};
      },
      getScene: () => ({ robots: [] }),
      getLinkPoses: () => ({ robots: [] }),
    });
    service(JointService, {
      getJointLayout: ({ robot }) => ({ layout: { robot, layoutVersion: found(robot).layoutVersion, joints: [{ name: "elbow", type: JointType.CONTINUOUS, mode: JointMode.POSITION }] } }),
      nextJointStates: ({ selections }) => {
        const { name: robot, layoutVersion } = found(selections[0]?.robot ?? "");
        return { states: { robots: [{ robot, layoutVersion, position: [elbow], mode: [JointMode.POSITION] }] }, linkPoses: [{ robot, layoutVersion, poses: [0, 0, elbow, 0, 0, 0, 1] }] };
      },
    });
    service(ContactService, { getLinkBounds: () => ({ links: [] }) });
  }),
);

vi.mock("./services", async (original) => ({ ...(await original<typeof import("./services")>()), services: () => services }));
vi.mock("./page", () => ({ daemonConnection: () => ({ pollNow: () => undefined, pollAllNow: () => undefined }) }));

const crate = { name: "crate", allowRenaming: true, scale: 3 };
const said = (): string[] => toasts.value.filter(({ kind }) => kind === "error").map(({ sentence }) => sentence);

beforeEach(() => {
  world.clear();
  spawned.length = 0;
  moved.length = 0;
  past.value = [];
  future.value = [];
  toasts.value = [];
});

test("undo takes out what was brought in, also after a redo, and not another robot of that name", async () => {
  await bringIn(crate);
  await undo();
  await redo();
  expect([...world.keys()]).toEqual(["crate"]);
  await undo();
  expect([...world.keys()]).toEqual([]);
  expect(said()).toEqual([]);
  await redo();
  const { layoutVersion } = put("crate");
  await undo();
  expect(world.get("crate")).toBe(layoutVersion);
  expect(said()).toEqual(["Adding crate cannot be undone: Another robot now has the name crate."]);
});

test("a removal is redone of the robot that its undo has brought back, and of no other", async () => {
  await bringIn(crate);
  await takeOut("crate");
  await undo();
  await redo();
  expect([...world.keys()]).toEqual([]);
  await undo();
  const { layoutVersion } = put("crate");
  await redo();
  expect(world.get("crate")).toBe(layoutVersion);
  expect(said()[0]).toContain("Another robot now has the name crate");
});

test("a duplicate is as this page requested the robot, or from its description if another robot has its name", async () => {
  await bringIn(crate);
  await duplicate("crate");
  expect(spawned.at(-1)?.scale).toBe(3);
  put("crate");
  await duplicate("crate");
  expect(spawned.at(-1)?.scale).not.toBe(3);
  expect(spawned.at(-1)?.source?.source).toMatchObject({ case: "description", value: "of its own" });
});

test("a robot that is removed right after a change comes back as the daemon had it, and not as the page's last state has it", async () => {
  await bringIn(crate);
  const joints = new Map([["crate", { position: [0], velocity: [0], effort: [0], target: [0], mode: ["position"], flags: [0] }]]);
  frame.value = { sequence: 1n, joints } as unknown as Frame;
  elbow = 0.75;
  await takeOut("crate");
  await undo();
  expect(spawned.at(-1)?.jointPositions).toEqual({ elbow: 0.75 });
  expect(spawned.at(-1)?.pose?.position?.z).toBe(0.75);
  // As does a double that is made before the page knows the robot.
  robots.value = [];
  frame.value = null;
  elbow = 0.5;
  await duplicate("crate");
  expect(spawned.at(-1)?.jointPositions).toEqual({ elbow: 0.5 });
});

test("an undo before the daemon's answer takes back the pending change", async () => {
  await bringIn({ ...crate, name: "first" });
  const brought = bringIn({ ...crate, name: "second" });
  await Promise.all([brought, undo()]);
  expect([...world.keys()]).toEqual(["first"]);
});

test("a robot that was removed and restored is duplicated as it was requested", async () => {
  await bringIn(crate);
  await takeOut("crate");
  await undo();
  await duplicate("crate");
  expect(spawned.at(-1)?.scale).toBe(3);
});

test("a robot that found its place on the ground finds it again when its loading is redone", async () => {
  noteSpawn(put("arm"), { name: "arm", onGround: true });
  await undo();
  await redo();
  expect(spawned.map(({ name, onGround }) => [name, onGround])).toEqual([["arm", true]]);
});

test("scenery does not take the place of a robot with joints in the panel, and another robot does", async () => {
  const source = { source: { case: "primitive", value: { geometry: { case: "plane", value: {} } } } } as const;
  await bringIn({ name: "first", source });
  expect(selectedRobot.value).toBe("first");
  robots.value = [{ name: "arm", model: "arm", layoutVersion: 1n, axes: [{ key: "arm/elbow" } as Axis], links: ["base"], disabledReason: "", claimedBy: "", mass: 1 }];
  selectedRobot.value = "arm";
  await bringIn({ name: "ground", source });
  expect(selectedRobot.value).toBe("arm");
  await bringIn({ name: "other", source: { source: { case: "path", value: "other.urdf" } } });
  expect(selectedRobot.value).toBe("other");
  // The page does not show it yet.
  await bringIn({ name: "box", source });
  expect(selectedRobot.value).toBe("other");
  robots.value = [];
});

test("moves within a second are one change, whose undo returns to before the first", async () => {
  put("crate");
  for (const x of [1, 2, 3]) {
    await moveTo("crate", [x, 0, 0, 0, 0, 0, 1]);
    noteMove("crate", [x - 1, 0, 0, 0, 0, 0, 1], [x, 0, 0, 0, 0, 0, 1]);
  }
  await undo();
  expect([past.value.length, moved.at(-1)]).toEqual([0, 0]);
  await redo();
  expect(moved.at(-1)).toBe(3);
});

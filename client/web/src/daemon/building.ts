// What this page brings into the world, takes out, moves and doubles: each a change that can be undone.
import type { MessageInitShape } from "@bufbuild/protobuf";
import { Base, type SpawnEntityRequest, type SpawnEntityRequestSchema } from "../gen/simd/v1/entity_pb";
import { nextSpawnPosition } from "../load/spawn-position";
import { scenes as drawn, type Pose } from "../state/scene";
import { toast } from "../state/toasts";
import { changed, type Change } from "../state/undo";
import { selectedRobot } from "../state/view";
import { frame, robots, type JointValues, type Robot } from "../state/world";
import { messageOf } from "./error-message";
import { daemonConnection } from "./page";
import { services } from "./services";

/** A request for a robot. */
export type Spawn = Exclude<MessageInitShape<typeof SpawnEntityRequestSchema>, SpawnEntityRequest>;

/** What this page asked for, by the name of the robot: it says more than the daemon's answers about a robot. */
const asked = new Map<string, Spawn>();

/** Keeps what was asked for a robot, so that it can be brought back and doubled. */
export function rememberSpawn(name: string, request: Spawn): void {
  asked.set(name, request);
}

/** Brings a robot in, and selects it. Resolves to its name; undefined where it was refused, which is said. */
export function bringIn(request: Spawn, what = "adding"): Promise<string | undefined> {
  return attempt(async () => {
    const name = await spawn(request);
    noteSpawn(name, request, what);
    selectedRobot.value = name;
    return name;
  });
}

/** Notes that a robot was brought in. */
export function noteSpawn(name: string, request: Spawn, what = "adding"): void {
  rememberSpawn(name, request);
  const again = { ...request, name, allowRenaming: false };
  note({ what: `${what} ${name}`, undo: () => remove(name), redo: () => spawn(again) });
}

/** Takes a robot out of the world. */
export function takeOut(name: string): Promise<unknown> {
  return attempt(async () => {
    // Before it is gone.
    const back = await requestOf(name).catch(() => undefined);
    await remove(name);
    if (!back) return;
    note({ what: `removing ${name}`, undo: () => spawn({ ...back, name, allowRenaming: false }), redo: () => remove(name) });
  });
}

/** Brings in the same robot once more, beside all others. */
export function duplicate(name: string): Promise<string | undefined> {
  return attempt(async () => {
    const request = await requestOf(name);
    const [x, , z, ...turn] = await poseOf(name);
    const { y } = nextSpawnPosition(drawn.peek(), frame.peek());
    const made: Spawn = { ...request, name, allowRenaming: true, pose: wirePose([x, y, z, ...turn]) };
    const twin = await spawn(made);
    noteSpawn(twin, made, "duplicating to");
    selectedRobot.value = twin;
    return twin;
  });
}

/** Puts a robot elsewhere and at rest, without a change to undo: for each step of a drag. */
export async function moveTo(robot: string, pose: Pose): Promise<void> {
  await services().entities.setEntityState({ robot, pose: wirePose(pose), twist: { linear: {}, angular: {} } });
  daemonConnection().pollNow();
}

/** Notes that a robot was moved. */
export function noteMove(robot: string, from: Pose, to: Pose): void {
  note({ what: `moving ${robot}`, undo: () => moveTo(robot, from), redo: () => moveTo(robot, to) });
}

/** world_from_root, as the daemon has it. */
export async function poseOf(robot: string): Promise<Pose> {
  const { pose } = await services().entities.getEntityState({ robot });
  const { position: p, orientation: q } = pose ?? {};
  return [p?.x ?? 0, p?.y ?? 0, p?.z ?? 0, q?.x ?? 0, q?.y ?? 0, q?.z ?? 0, q?.w ?? 1];
}

/** A request that brings in a robot as it is now: where it is, and with its joints as they are. */
async function requestOf(robot: string): Promise<Spawn> {
  const { entities } = services();
  const [{ entity }, { robots: scenes }, pose] = await Promise.all([entities.getEntityInfo({ robot }), entities.getScene({ robots: [robot] }), poseOf(robot)]);
  const [scene] = scenes;
  const known = robots.peek().find(({ name }) => name === robot);
  const joints = frame.peek()?.joints.get(robot);
  const now: Spawn = { name: robot, pose: wirePose(pose), base: entity?.base ?? Base.UNSPECIFIED, ...(known && joints && placesOf(known, joints)) };
  const before = asked.get(robot);
  if (before) return { ...before, ...now };
  const assets: Record<string, string> = {};
  for (const { geometry } of [...(scene?.visuals ?? []), ...(scene?.collisions ?? [])]) {
    if (geometry.case === "mesh" && geometry.value.sha256 !== "") assets[geometry.value.uri] = geometry.value.sha256;
  }
  return { ...now, source: { source: { case: "description", value: entity?.description ?? "" }, assets } };
}

/** Positions of joints of one axis, and orientations of ball joints, by name. */
export function placesOf(robot: Robot, joints: JointValues): Pick<Spawn, "jointPositions" | "jointOrientations"> {
  const jointPositions: Record<string, number> = {};
  const jointOrientations: Record<string, { x: number; y: number; z: number; w: number }> = {};
  const planar = new Set(robot.axes.filter(({ axis, isBall }) => axis > 0 && !isBall).map(({ joint }) => joint));
  for (const { joint, axis, isBall, mimics, positionIndex } of robot.axes) {
    if (axis > 0 || planar.has(joint) || mimics !== undefined) continue;
    const [first = 0, y = 0, z = 0, w = 1] = joints.position.slice(positionIndex, positionIndex + 4);
    if (isBall) jointOrientations[joint] = { x: first, y, z, w };
    else jointPositions[joint] = first;
  }
  return { jointPositions, jointOrientations };
}

/** A pose as the daemon takes it. */
export function wirePose([x, y, z, qx, qy, qz, qw]: Pose): { position: { x: number; y: number; z: number }; orientation: { x: number; y: number; z: number; w: number } } {
  return { position: { x, y, z }, orientation: { x: qx, y: qy, z: qz, w: qw } };
}

async function spawn(request: Spawn): Promise<string> {
  const { entity } = await services().entities.spawnEntity(request);
  daemonConnection().pollAllNow();
  return entity?.name ?? "";
}

async function remove(robot: string): Promise<void> {
  await services().entities.deleteEntity({ robot });
  daemonConnection().pollAllNow();
}

async function attempt<T>(act: () => Promise<T>): Promise<T | undefined> {
  try {
    return await act();
  } catch (error) {
    toast("error", messageOf(error));
    return undefined;
  }
}

/** Notes a change; what the daemon refuses of it is said in its words. */
function note(change: Change): void {
  const worded = (act: () => Promise<unknown>) => async () => {
    try {
      await act();
    } catch (error) {
      throw new Error(messageOf(error));
    }
  };
  changed({ ...change, undo: worded(change.undo), redo: worded(change.redo) });
}

// Changes of the world by this page: loads, removes, moves and duplicates robots. Each change can be undone.
import type { MessageInitShape } from "@bufbuild/protobuf";
import type { SpawnEntityRequest, SpawnEntityRequestSchema } from "../gen/simd/v1/entity_pb";
import type { Pose } from "../state/scene";
import { toast } from "../state/toasts";
import { changed, making, type Change } from "../state/undo";
import { selectedRobot } from "../state/view";
import { robots, type JointValues, type Robot } from "../state/world";
import { shownRobot } from "../panels/shown-robot";
import { remember } from "./again";
import { messageOf, worded } from "./error-message";
import { axesOf, poseOf as poseFrom, robotOf, valuesOf } from "./mapping";
import { daemonConnection } from "./page";
import { services } from "./services";

/** A request for a robot. */
export type Spawn = Exclude<MessageInitShape<typeof SpawnEntityRequestSchema>, SpawnEntityRequest>;

/** A robot that this page has loaded. A later robot with its name has another version. */
export interface Spawned {
  name: string;
  layoutVersion: bigint;
}

/** Spawn requests of this page by robot name: they contain more than the daemon's answers about a robot. */
const asked = new Map<string, { request: Spawn; version: bigint }>();

/**
 * Loads a robot, and selects it. A single shape is selected only if no robot with joints is. Resolves to its name; undefined after a refusal, which a
 * message reports.
 */
export function bringIn(request: Spawn, what = "adding"): Promise<string | undefined> {
  return attempt(async () => {
    // Scenery does not deselect an arm that is being moved.
    const isScenery = request.source?.source?.case === "primitive";
    const [spawned, kept] = await Promise.all([spawn(request), isScenery ? robotWithJoints() : undefined]);
    noteSpawn(spawned, request, what);
    remember(spawned.name, () => bringIn({ ...request, name: spawned.name, allowRenaming: true }, what));
    selectedRobot.value = kept ?? spawned.name;
    return spawned.name;
  });
}

/** Returns the robot in the panel if it has joints. The daemon is asked about a selected one that the page does not show yet. */
async function robotWithJoints(): Promise<string | undefined> {
  const selected = selectedRobot.peek();
  if (selected !== "" && !robots.peek().some(({ name }) => name === selected)) {
    const answer = await services().joints.getJointLayout({ robot: selected }).catch(() => undefined);
    if (answer?.layout?.joints.some((joint) => axesOf(selected, joint).length > 0)) return selected;
  }
  const shown = shownRobot.peek();
  return shown && shown.axes.length > 0 ? shown.name : undefined;
}

/** Notes that a robot was loaded. */
export function noteSpawn({ name, layoutVersion }: Spawned, request: Spawn, what = "adding"): void {
  let version = keep(name, layoutVersion, request);
  note({
    what: `${what} ${name}`,
    undo: () => removeOwn(name, version),
    redo: async () => {
      version = await bringBack(name, request);
    },
  });
}

/** Removes a robot from the world. */
export function takeOut(name: string): Promise<unknown> {
  return attempt(async () => {
    // Must be read before it is gone.
    const back = await requestOf(name).catch(() => undefined);
    await remove(name);
    if (!back) return;
    let version = 0n;
    note({ what: `removing ${name}`, undo: async () => (version = await bringBack(name, back)), redo: () => removeOwn(name, version) });
  });
}

/** Loads the same robot once more, next to all others. */
export function duplicate(name: string): Promise<string | undefined> {
  return attempt(async () => {
    const request = await requestOf(name);
    return bringIn({ ...request, name, allowRenaming: true, besideOthers: true }, "duplicating to");
  });
}

/**
 * Moves a robot and stops its motion, without a change to undo: for each step of a drag. Resolves to the sequence of the first state with the
 * new pose.
 */
export async function moveTo(robot: string, pose: Pose): Promise<bigint> {
  const { stamp } = await services().entities.setEntityState({ robot, pose: wirePose(pose), twist: { linear: {}, angular: {} } });
  daemonConnection().pollNow();
  return stamp?.sequence ?? 0n;
}

/** Notes that a robot was moved. */
export function noteMove(robot: string, from: Pose, to: Pose): void {
  note({ what: `moving ${robot}`, of: `place ${robot}`, undo: () => moveTo(robot, from), redo: () => moveTo(robot, to) });
}

/** Returns the daemon's world_from_root. */
export async function poseOf(robot: string): Promise<Pose> {
  return poseFrom((await services().entities.getEntityState({ robot })).pose);
}

/** Returns the daemon's world_from_link of a link, by index. */
export async function linkPoseOf(robot: string, index: number): Promise<Pose> {
  const { robots } = await services().entities.getLinkPoses({ robots: [robot] });
  const pose = robots[0]?.poses.slice(7 * index, 7 * index + 7);
  if (!isPose(pose)) throw new Error(`${robot} was loaded again meanwhile; try once more`);
  return pose;
}

/**
 * Returns a request that loads a robot in its present pose, with its joints as they are. The daemon is asked for both at one moment: the page's last
 * state may be older than its last change.
 */
async function requestOf(robot: string): Promise<Spawn> {
  const { entities, joints } = services();
  const [{ entity }, { layout }, { robots: scenes }, { states, linkPoses }] = await Promise.all([
    entities.getEntityInfo({ robot }),
    joints.getJointLayout({ robot }),
    entities.getScene({ robots: [robot] }),
    joints.nextJointStates({ selections: [{ robot }], returnLinkPoses: true }),
  ]);
  const [scene] = scenes;
  const state = states?.robots[0];
  const pose = linkPoses[0]?.poses.slice(0, 7);
  if (!entity || !layout || !state || !isPose(pose) || layout.layoutVersion !== entity.layoutVersion || state.layoutVersion !== entity.layoutVersion) {
    throw new Error(`${robot} was loaded again meanwhile; try once more`);
  }
  const now: Spawn = { name: robot, pose: wirePose(pose), base: entity.base, besideOthers: false, onGround: false, ...placesOf(robotOf(entity, layout), valuesOf(state)) };
  const own = asked.get(robot);
  if (own && own.version === entity.layoutVersion) return { ...own.request, ...now };
  const assets: Record<string, string> = {};
  for (const { geometry } of [...(scene?.visuals ?? []), ...(scene?.collisions ?? [])]) {
    if (geometry.case === "mesh" && geometry.value.sha256 !== "") assets[geometry.value.uri] = geometry.value.sha256;
  }
  return { ...now, source: { source: { case: "description", value: entity.description }, assets } };
}

function isPose(numbers: readonly number[] | undefined): numbers is [number, number, number, number, number, number, number] {
  return numbers?.length === 7;
}

/** Returns positions of joints of one axis, and orientations of ball joints, by name. */
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

/** Returns a pose as a message. */
export function wirePose([x, y, z, qx, qy, qz, qw]: Pose): { position: { x: number; y: number; z: number }; orientation: { x: number; y: number; z: number; w: number } } {
  return { position: { x, y, z }, orientation: { x: qx, y: qy, z: qz, w: qw } };
}

async function spawn(request: Spawn): Promise<Spawned> {
  const { entity } = await services().entities.spawnEntity(request);
  daemonConnection().pollAllNow();
  return { name: entity?.name ?? "", layoutVersion: entity?.layoutVersion ?? 0n };
}

/** Keeps the request of a robot, so that it can be duplicated, and returns its version. */
function keep(name: string, version: bigint, request: Spawn): bigint {
  asked.set(name, { request, version });
  return version;
}

/** Loads a robot again under its name. Resolves to its new version. */
async function bringBack(name: string, request: Spawn): Promise<bigint> {
  const { layoutVersion } = await spawn({ ...request, name, allowRenaming: false });
  return keep(name, layoutVersion, request);
}

/** Removes a robot that this page has loaded, but no later robot of another client with the same name. */
async function removeOwn(name: string, version: bigint): Promise<void> {
  const { entity } = await services().entities.getEntityInfo({ robot: name });
  if (entity?.layoutVersion !== version) throw new Error(`another robot now has the name ${name}`);
  await remove(name);
}

async function remove(robot: string): Promise<void> {
  await services().entities.deleteEntity({ robot });
  daemonConnection().pollAllNow();
}

async function attempt<T>(act: () => Promise<T>): Promise<T | undefined> {
  try {
    return await making(act());
  } catch (error) {
    toast("error", messageOf(error));
    return undefined;
  }
}

/** Notes a change; its errors have the daemon's words. */
function note(change: Change): void {
  changed({ ...change, undo: () => worded(change.undo), redo: () => worded(change.redo) });
}

// Every change that people make to the world. Each answers once it holds; refusals become toasts.
import type { MessageInitShape } from "@bufbuild/protobuf";
import { WrenchFrame } from "../gen/simd/v1/entity_pb";
import { JointMode, type JointTargetSchema, type SetJointTargetsResponse } from "../gen/simd/v1/joint_pb";
import { PaceMode, SimulationState } from "../gen/simd/v1/simulation_pb";
import { loadDropped, type DroppedFile } from "../load/load";
import { toast } from "../state/toasts";
import { simulation, type Axis, type Mode } from "../state/world";
import { Coalescer } from "./coalesce";
import { link } from "./page";
import { sentenceOf } from "./refusal";
import { services } from "./services";

export type { DroppedFile };

type Vector = readonly [number, number, number];
type WireTarget = MessageInitShape<typeof JointTargetSchema>;

/** Simulated seconds that a push lasts unless it is renewed: a page that goes away does not push for ever. */
const PUSH_DURATION = 0.2;

const targets = new Coalescer<string, { axis: Axis; mode: Mode; value: number }>((values) => attempt(() => sendTargets(values)));
const sliders = new Coalescer<string, number>((values) => attempt(() => sendParameters(values)));
const speed = new Coalescer<"speed", number>((values) => attempt(() => sendSpeed(values.get("speed") ?? 1)));
const pushes = new Coalescer<string, Push>((values) => attempt(() => sendPushes(values)));

/** Gives an axis a target. Newest wins per axis; one call is in flight, and takes all that wait. */
export function setTarget(axis: Axis, mode: Mode, value: number): Promise<void> {
  return targets.set(axis.key, { axis, mode, value });
}

/** Lets all joints of a robot hold where they are. */
export function holdAll(robot: string): Promise<void> {
  return setWhole(robot, JointMode.HOLD);
}

/** Takes the actuators of a robot away. */
export function freeAll(robot: string): Promise<void> {
  return setWhole(robot, JointMode.PASSIVE);
}

export function play(): Promise<void> {
  return setState(SimulationState.PLAYING);
}

export function pause(): Promise<void> {
  return setState(SimulationState.PAUSED);
}

/** Does `n` steps; a world that plays is paused first. */
export async function step(n: number): Promise<void> {
  await attempt(async () => {
    if (simulation.value.state === "playing") await services().simulation.setSimulationState({ state: SimulationState.PAUSED });
    await services().simulation.stepSimulation({ steps: BigInt(Math.max(1, Math.round(n))) });
  });
  link().pokeAll();
}

/** Puts time and robots back to the start. */
export async function reset(): Promise<void> {
  await attempt(() => services().simulation.resetSimulation({ time: true, state: true }));
  link().pokeAll();
}

/** Real-time factor; Infinity is as fast as possible. */
export function setSpeed(factor: number): Promise<void> {
  return speed.set("speed", factor);
}

export function setParameter(name: string, value: number): Promise<void> {
  return sliders.set(name, value);
}

export async function pressButton(name: string): Promise<void> {
  const change = { name, change: { case: "presses", value: 1n } } as const;
  await attempt(() => services().parameters.setParameters({ changes: [change] }));
  link().pokeAll();
}

export async function deleteRobot(name: string): Promise<void> {
  await attempt(() => services().entities.deleteEntity({ robot: name }));
  link().pokeAll();
}

/** Loads the robots that the files describe. */
export async function loadFiles(files: DroppedFile[]): Promise<void> {
  await attempt(() => loadDropped(services().entities, files));
  link().pokeAll();
}

/** Moves a robot's root up, metres. */
export async function lift(robot: string, by: number): Promise<void> {
  await attempt(async () => {
    const { entities } = services();
    const { position, orientation } = (await entities.getEntityState({ robot })).pose ?? {};
    if (!position || !orientation) return;
    await entities.setEntityState({ robot, pose: { position: { ...position, z: position.z + by }, orientation } });
  });
  link().poke();
}

/** Pushes a link: newtons in world axes, at a point in the link's frame. Ends by itself unless it is renewed. */
export function pushLink(robot: string, linkName: string, force: Vector, pointInLink: Vector): Promise<void> {
  return pushes.set(`${robot}/${linkName}`, { robot, link: linkName, force, point: pointInLink });
}

/** Ends what `pushLink` does. */
export function stopPushing(robot: string, linkName: string): Promise<void> {
  return pushes.set(`${robot}/${linkName}`, { robot, link: linkName, force: [0, 0, 0], point: [0, 0, 0] });
}

interface Push {
  robot: string;
  link: string;
  force: Vector;
  point: Vector;
}

/** Does it, and tells people where the daemon refused. */
async function attempt(change: () => Promise<unknown>): Promise<void> {
  try {
    await change();
  } catch (error) {
    toast("error", sentenceOf(error));
  }
}

async function sendTargets(values: Map<string, { axis: Axis; mode: Mode; value: number }>): Promise<void> {
  const robots = new Map<string, WireTarget[]>();
  for (const { axis, mode, value } of values.values()) {
    const target = targetOf(axis, mode, value);
    if (target) robots.set(axis.robot, [...(robots.get(axis.robot) ?? []), target]);
  }
  if (robots.size === 0) return;
  const wire = [...robots].map(([robot, joints]) => ({ robot, joints }));
  tellClamped(await services().joints.setJointTargets({ robots: wire }));
  link().poke();
}

/** A target as the wire has it; nothing for joints without an actuator. */
export function targetOf(axis: Axis, mode: Mode, value: number): WireTarget | undefined {
  const where = { joint: axis.joint, axis: axis.axis };
  switch (mode) {
    case "position":
      return { ...where, target: { case: "position", value: { position: value } } };
    case "velocity":
      return { ...where, target: { case: "velocity", value: { velocity: value } } };
    case "effort":
      return { ...where, target: { case: "effort", value: { effort: value } } };
    case "passive":
      return { ...where, target: { case: "passive", value: {} } };
    case "hold":
      return { ...where, target: { case: "hold", value: {} } };
    case "none":
      return undefined;
  }
}

function tellClamped(response: SetJointTargetsResponse): void {
  for (const { robot, joint, requested, applied } of response.clamped) {
    toast("info", `${robot}/${joint}: ${round(requested)} is beyond the limit; ${round(applied)} holds.`);
  }
}

function round(value: number): string {
  return String(Number(value.toPrecision(4)));
}

async function setWhole(robot: string, mode: JointMode): Promise<void> {
  // What waits for one of its joints would undo it.
  targets.drop((key) => key.startsWith(`${robot}/`));
  await attempt(() => services().joints.setJointTargets({ robots: [{ robot, whole: { mode } }] }));
  link().poke();
}

async function setState(state: SimulationState): Promise<void> {
  await attempt(() => services().simulation.setSimulationState({ state }));
  link().pokeAll();
}

async function sendSpeed(factor: number): Promise<void> {
  await services().simulation.setPhysics(
    Number.isFinite(factor)
      ? { realTimeFactor: factor, pace: PaceMode.REAL_TIME }
      : { pace: PaceMode.AS_FAST_AS_POSSIBLE },
  );
  link().pokeAll();
}

async function sendParameters(values: Map<string, number>): Promise<void> {
  const changes = [...values].map(([name, value]) => ({ name, change: { case: "value", value } as const }));
  await services().parameters.setParameters({ changes });
  link().pokeAll();
}

async function sendPushes(values: Map<string, Push>): Promise<void> {
  const calls = [...values.values()].map(({ robot, link: name, force, point }) =>
    services().entities.applyLinkWrench({
      robot,
      link: name,
      wrench: { force: wire(force) },
      frame: WrenchFrame.WORLD,
      point: wire(point),
      duration: PUSH_DURATION,
    }),
  );
  await Promise.all(calls);
}

function wire([x, y, z]: Vector): { x: number; y: number; z: number } {
  return { x, y, z };
}

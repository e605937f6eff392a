// Every change that the user makes to the world. Each resolves once it is applied; errors are shown as toasts.
import { Base, WrenchFrame } from "../gen/simd/v1/entity_pb";
import { JointMode, type SetJointTargetsResponse } from "../gen/simd/v1/joint_pb";
import { PaceMode, SimulationState } from "../gen/simd/v1/simulation_pb";
import { demoArm } from "../load/demo-arm";
import { loadDropped, type DroppedFile } from "../load/load";
import { toast } from "../state/toasts";
import { frame, simulation, type Axis, type Mode } from "../state/world";
import { BallTargets } from "./ball-targets";
import { Coalescer } from "./coalesce";
import { daemonConnection } from "./page";
import { messageOf } from "./error-message";
import { services } from "./services";
import { ballTargetOf, targetOf, type WireTarget } from "./targets";

export type { DroppedFile };

type Vector = readonly [number, number, number];

/** Simulated seconds after which a pull ends unless it is renewed, so that it does not outlive the page. */
const PULL_DURATION = 0.2;

const targets = new Coalescer<string, { axis: Axis; mode: Mode; value: number }>((values) => attempt(() => sendTargets(values)));
const balls = new BallTargets();
const sliders = new Coalescer<string, number>((values) => attempt(() => sendParameters(values)));
const speed = new Coalescer<"speed", number>((values) => attempt(() => sendSpeed(values.get("speed") ?? 1)));
const pulls = new Coalescer<string, Pull>((values) => attempt(() => sendPulls(values)));

/** Sets the target of an axis. The newest of each axis is sent, with one call in flight. */
export function setTarget(axis: Axis, mode: Mode, value: number): Promise<void> {
  return targets.set(axis.key, { axis, mode, value });
}

/** Makes all joints of a robot hold their positions. */
export function holdAll(robot: string): Promise<void> {
  return setWhole(robot, JointMode.HOLD);
}

/** Makes all joints of a robot passive. */
export function freeAll(robot: string): Promise<void> {
  return setWhole(robot, JointMode.PASSIVE);
}

export function play(): Promise<void> {
  return setState(SimulationState.PLAYING);
}

export function pause(): Promise<void> {
  return setState(SimulationState.PAUSED);
}

/** Runs `n` steps; a playing simulation is paused first. */
export async function step(n: number): Promise<void> {
  await attempt(async () => {
    if (simulation.value.state === "playing") await services().simulation.setSimulationState({ state: SimulationState.PAUSED });
    await services().simulation.stepSimulation({ steps: BigInt(Math.max(1, Math.round(n))) });
  });
  daemonConnection().pollAllNow();
}

/** Resets time and robots. */
export async function reset(): Promise<void> {
  await attempt(() => services().simulation.resetSimulation({ time: true, state: true }));
  daemonConnection().pollAllNow();
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
  daemonConnection().pollAllNow();
}

export async function deleteRobot(name: string): Promise<void> {
  await attempt(() => services().entities.deleteEntity({ robot: name }));
  daemonConnection().pollAllNow();
}

/** Lets two links go. */
export async function deleteConstraint(name: string): Promise<void> {
  await attempt(() => services().constraints.deleteConstraint({ name }));
  daemonConnection().pollAllNow();
}

/** Loads the robots that the files describe. */
export async function loadFiles(files: DroppedFile[]): Promise<void> {
  await attempt(() => loadDropped(services().entities, files));
  daemonConnection().pollAllNow();
}

/** Adds an arm to the world, for who has no robot at hand. */
export async function addDemoArm(): Promise<void> {
  const urdf = new TextEncoder().encode(demoArm());
  await attempt(() => services().entities.spawnEntity({ source: { source: { case: "urdf", value: urdf } }, base: Base.FIXED, allowRenaming: true }));
  daemonConnection().pollAllNow();
}

/** Adds a plane at z = 0, which robots can stand on. */
export async function addGround(): Promise<void> {
  await attempt(async () => {
    const primitive = { geometry: { case: "plane", value: {} } } as const;
    await services().entities.spawnEntity({ name: "ground", allowRenaming: true, base: Base.FIXED, source: { source: { case: "primitive", value: primitive } } });
    toast("info", "There is ground at z = 0 now. A reset puts back what has fallen.");
  });
  daemonConnection().pollAllNow();
}

/** Moves a robot's root up, metres. */
export async function lift(robot: string, by: number): Promise<void> {
  await attempt(async () => {
    const { entities } = services();
    const { position, orientation } = (await entities.getEntityState({ robot })).pose ?? {};
    if (!position || !orientation) return;
    await entities.setEntityState({ robot, pose: { position: { ...position, z: position.z + by }, orientation } });
  });
  daemonConnection().pollNow();
}

/** Applies a force to a link: newtons in world axes, at a point in the link's frame. Ends by itself unless it is renewed. */
export function pullLink(robot: string, linkName: string, force: Vector, pointInLink: Vector): Promise<void> {
  return pulls.set(`${robot}/${linkName}`, { robot, link: linkName, force, point: pointInLink });
}

/** Ends the force of `pullLink`. */
export function stopPulling(robot: string, linkName: string): Promise<void> {
  return pulls.set(`${robot}/${linkName}`, { robot, link: linkName, force: [0, 0, 0], point: [0, 0, 0] });
}

interface Pull {
  robot: string;
  link: string;
  force: Vector;
  point: Vector;
}

/** Runs a change, and shows its error as a toast. */
async function attempt(change: () => Promise<unknown>): Promise<void> {
  try {
    await change();
  } catch (error) {
    toast("error", messageOf(error));
  }
}

async function sendTargets(values: Map<string, { axis: Axis; mode: Mode; value: number }>): Promise<void> {
  const robots = new Map<string, WireTarget[]>();
  const add = (axis: Axis, target: WireTarget | undefined): void => {
    if (target) robots.set(axis.robot, [...(robots.get(axis.robot) ?? []), target]);
  };
  for (const { axis, mode, value } of values.values()) {
    if (!axis.isBall) add(axis, targetOf(axis, mode, value));
  }
  for (const { axis, mode, values: three } of balls.of(values.values(), frame.peek(), performance.now())) add(axis, ballTargetOf(axis, mode, three));
  if (robots.size === 0) return;
  const wire = [...robots].map(([robot, joints]) => ({ robot, joints }));
  reportClamped(await services().joints.setJointTargets({ robots: wire }));
  daemonConnection().pollNow();
}

function reportClamped(response: SetJointTargetsResponse): void {
  for (const { robot, joint, requested, applied } of response.clamped) {
    toast("info", `${robot}/${joint}: ${round(requested)} is beyond the limit; ${round(applied)} holds.`);
  }
}

function round(value: number): string {
  return String(Number(value.toPrecision(4)));
}

async function setWhole(robot: string, mode: JointMode): Promise<void> {
  // A pending target of one of its joints would undo this.
  targets.drop((key) => key.startsWith(`${robot}/`));
  await attempt(() => services().joints.setJointTargets({ robots: [{ robot, whole: { mode } }] }));
  daemonConnection().pollNow();
}

async function setState(state: SimulationState): Promise<void> {
  await attempt(() => services().simulation.setSimulationState({ state }));
  daemonConnection().pollAllNow();
}

async function sendSpeed(factor: number): Promise<void> {
  await services().simulation.setPhysics(
    Number.isFinite(factor)
      ? { realTimeFactor: factor, pace: PaceMode.REAL_TIME }
      : { pace: PaceMode.AS_FAST_AS_POSSIBLE },
  );
  daemonConnection().pollAllNow();
}

async function sendParameters(values: Map<string, number>): Promise<void> {
  const changes = [...values].map(([name, value]) => ({ name, change: { case: "value", value } as const }));
  await services().parameters.setParameters({ changes });
  daemonConnection().pollAllNow();
}

async function sendPulls(values: Map<string, Pull>): Promise<void> {
  const calls = [...values.values()].map(({ robot, link: name, force, point }) =>
    services().entities.applyLinkWrench({
      robot,
      link: name,
      wrench: { force: wire(force) },
      frame: WrenchFrame.WORLD,
      point: wire(point),
      duration: PULL_DURATION,
    }),
  );
  await Promise.all(calls);
  // The spring follows the states: of a still world they are rare.
  daemonConnection().pollNow();
}

function wire([x, y, z]: Vector): { x: number; y: number; z: number } {
  return { x, y, z };
}

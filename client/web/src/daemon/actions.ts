// Every change that the user makes to the world. Each resolves once it is applied; errors are shown as toasts.
import { attempt, oneAtATime } from "./attempt";
import { Base } from "../gen/simd/v1/entity_pb";
import { JointMode, type SetJointTargetsResponse } from "../gen/simd/v1/joint_pb";
import { PaceMode, SimulationState } from "../gen/simd/v1/simulation_pb";
import type { DroppedFile, LoadOptions } from "../load/load";
import type { Chosen } from "../load/xacro";
import { axisValues } from "../state/joint-values";
import { toast } from "../state/toasts";
import { changed, making } from "../state/undo";
import type { Spring } from "../scene/spring";
import { frame, simulation, type Axis, type Mode, type Target } from "../state/world";
import { remember } from "./again";
import { bringIn, noteSpawn } from "./building";
import { BallTargets } from "./ball-targets";
import { Coalescer } from "./coalesce";
import { valuesOf } from "./mapping";
import { daemonConnection } from "./page";
import { worded } from "./error-message";
import { services } from "./services";
import { showSetState } from "./set-state";
import { ballTargetOf, targetOf, type WireTarget } from "./targets";

export type { DroppedFile };

type Vector = readonly [number, number, number];

const targets = new Coalescer<string, { axis: Axis; mode: Mode; value: number }>(async (values) => void (await attempt(() => sendTargets(values))));
const balls = new BallTargets();
const sliders = new Coalescer<string, number>(async (values) => void (await attempt(() => sendParameters(values))));
const speed = new Coalescer<"speed", number>(async (values) => void (await attempt(() => sendSpeed(values.get("speed") ?? 1))));
const states = new Coalescer<"state", "playing" | "paused">((values) => sendState(values.get("state") ?? "paused"));
const pulls = new Coalescer<string, Pull>(async (values) => void (await attempt(() => sendPulls(values))));

/**
 * Sets the target of an axis. The newest of each axis is sent, with one call in flight. It can be undone: `before` is the target that the user saw,
 * which the daemon may not have published yet.
 */
export function setTarget(axis: Axis, { mode, value }: Target, before?: Target): Promise<void> {
  const set = (to: Mode, at: number) => () => {
    // A waiting target would arrive after this one. It is sent in a separate call, so that the page does not report success
    // after a refusal.
    targets.drop((key) => key === axis.key);
    return worded(() => sendTargets(new Map([[axis.key, { axis, mode: to, value: at }]])));
  };
  if (before) changed({ what: `the target of ${axis.key}`, of: axis.key, undo: set(before.mode, before.value), redo: set(mode, value) });
  return targets.set(axis.key, { axis, mode, value });
}

/** Asks the daemon for a present value of an axis: the page's last state is older. Undefined if it does not answer. */
export async function presentValue(axis: Axis, quantity: "position" | "velocity" | "effort"): Promise<number | undefined> {
  const answer = await services()
    .joints.getJointStates({ selections: [{ robot: axis.robot }] })
    .catch(() => undefined);
  const state = answer?.states?.robots[0];
  return state && axisValues(axis, valuesOf(state))?.[quantity];
}

/** Makes all joints of a robot hold their positions. */
export function holdAll(robot: string): Promise<void> {
  return setWhole(robot, JointMode.HOLD);
}

/** Makes all joints of a robot passive. */
export function freeAll(robot: string): Promise<void> {
  return setWhole(robot, JointMode.PASSIVE);
}

/** State that this page has requested and the daemon has not confirmed yet. */
let wanted: "playing" | "paused" | null = null;

/** Pauses a world that plays, and plays it otherwise. A second press counts before the first is answered. */
export function playOrPause(): Promise<void> {
  wanted = (wanted ?? simulation.peek().state) === "playing" ? "paused" : "playing";
  return states.set("state", wanted);
}

/** Runs `n` steps. A playing simulation is paused first: the daemon says whether it plays, since the page's state may be old. */
export async function step(n: number): Promise<void> {
  await attempt(async () => {
    const { simulation: service } = services();
    const { state } = await service.getSimulationState({});
    if (state === SimulationState.PLAYING) await service.setSimulationState({ state: SimulationState.PAUSED });
    await service.stepSimulation({ steps: BigInt(Math.max(1, Math.round(n))) });
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

/** Removes a constraint between two links. */
export async function deleteConstraint(name: string): Promise<void> {
  await attempt(() => services().constraints.deleteConstraint({ name }));
  daemonConnection().pollAllNow();
}

/** Loads the robots that the files describe, according to the options. Resolves to whether all were loaded. */
export async function loadFiles(files: DroppedFile[], chosen: readonly Chosen[], options?: LoadOptions): Promise<boolean> {
  const load = async (): Promise<void> => {
    // Most visits load nothing.
    const { loadDropped } = await import("../load/load");
    await loadDropped(services().entities, files, chosen, options, (spawned, request, choice) => {
      noteSpawn(spawned, request);
      remember(spawned.name, () => loadFiles(files, [choice], options));
    });
  };
  const done = await attempt(() => making(load()));
  daemonConnection().pollAllNow();
  return done;
}

/** Adds an arm to the world, for users without a robot file. */
export const addDemoArm = oneAtATime(async () => {
  const loaded = await import("../load/demo-arm").catch(() => undefined);
  if (!loaded) return toast("error", "The arm could not be loaded from the daemon; add it again once it answers.");
  const urdf = new TextEncoder().encode(loaded.demoArm());
  await bringIn({ source: { source: { case: "urdf", value: urdf } }, base: Base.FIXED, allowRenaming: true });
});

/** Adds a plane at z = 0, which robots can stand on, unless the daemon has one that the page does not show yet. */
export const addGround = oneAtATime(async () => {
  const isThere = async (): Promise<boolean> => {
    const { robots } = await services().entities.getScene({});
    return robots.some(({ collisions }) => collisions.some(({ geometry }) => geometry.case === "plane"));
  };
  if (await isThere().catch(() => false)) return;
  const primitive = { geometry: { case: "plane", value: {} } } as const;
  const name = await bringIn({ name: "ground", allowRenaming: true, base: Base.FIXED, source: { source: { case: "primitive", value: primitive } } });
  if (name !== undefined) toast("info", "There is ground at z = 0 now. A reset restores robots that have fallen.");
});

/**
 * Pulls a point of a link, in its frame, to a point of the world. Ends after this many simulated seconds unless it is renewed.
 */
export function pullLink(robot: string, linkName: string, point: Vector, target: Vector, spring: Spring, duration: number): Promise<void> {
  return pulls.set(`${robot}/${linkName}`, { robot, link: linkName, point, target, spring, duration });
}

/** Ends the pull of `pullLink`. */
export function stopPulling(robot: string, linkName: string): Promise<void> {
  return pulls.set(`${robot}/${linkName}`, { robot, link: linkName });
}

interface Pull {
  robot: string;
  link: string;
  point?: Vector;
  /** An absent target ends the pull. */
  target?: Vector;
  spring?: Spring;
  duration?: number;
}

async function sendTargets(values: Map<string, { axis: Axis; mode: Mode; value: number }>): Promise<void> {
  const robots = new Map<string, WireTarget[]>();
  const add = (axis: Axis, target: WireTarget | undefined): void => {
    if (target) robots.set(axis.robot, [...(robots.get(axis.robot) ?? []), target]);
  };
  for (const { axis, mode, value } of values.values()) {
    if (!axis.isBall) add(axis, targetOf(axis, mode, value));
  }
  const whole = balls.of(values.values(), frame.peek(), performance.now());
  for (const { axis, mode, values: three } of whole) add(axis, ballTargetOf(axis, mode, three));
  if (robots.size === 0) return;
  const wire = [...robots].map(([robot, joints]) => ({ robot, joints }));
  const response = await services().joints.setJointTargets({ robots: wire }).catch((error: unknown) => {
    balls.refused(whole);
    throw error;
  });
  balls.applied(whole, response.stamp?.sequence ?? 0n);
  reportClamped(response);
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

async function sendState(state: "playing" | "paused"): Promise<void> {
  const done = await attempt(() => services().simulation.setSimulationState({ state: state === "playing" ? SimulationState.PLAYING : SimulationState.PAUSED }));
  if (wanted === state) wanted = null;
  // The next press must not start from the state before.
  if (done) showSetState(state);
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
  const calls = [...values.values()].map(({ robot, link: name, point, target, spring, duration }) =>
    services().entities.pullLink({
      robot,
      link: name,
      ...(point && { point: wire(point) }),
      ...(target && { target: wire(target) }),
      ...(duration !== undefined && { duration }),
      ...(spring && { stiffness: spring.stiffness, maxForce: spring.limit }),
    }),
  );
  await Promise.all(calls);
  // A still world publishes states rarely.
  daemonConnection().pollNow();
}

function wire([x, y, z]: Vector): { x: number; y: number; z: number } {
  return { x, y, z };
}

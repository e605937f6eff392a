// The world as this page knows it: written by the link to the daemon, read by everything that is drawn.
import { signal } from "@preact/signals";

/** What a joint's actuator does; "none" is a joint without one. */
export type Mode = "passive" | "position" | "velocity" | "effort" | "hold" | "none";

/** One scalar degree of freedom: a row of the panel. Radians and newton metres, or metres and newtons. */
export interface Axis {
  /** "robot/joint", or "robot/joint/1" for axis 1 of a planar joint. */
  key: string;
  robot: string;
  joint: string;
  /** Which of a planar joint's axes: 0 x, 1 y, 2 angle; else 0. */
  axis: number;
  /** What to write beside it. */
  label: string;
  kind: "angle" | "length";
  lower?: number;
  upper?: number;
  velocityLimit?: number;
  effortLimit?: number;
  /** Index into `JointValues.position`. */
  positionIndex: number;
  /** Index into the other arrays of `JointValues`. */
  velocityIndex: number;
  childLink: string;
  /** Whether it takes targets: false for joints that follow another. */
  actuated: boolean;
  /** The joint that it follows. */
  mimics?: string;
  /** Who holds a claim on it; empty for nobody. */
  claimedBy: string;
}

/** A robot in the world. */
export interface Robot {
  name: string;
  /** Its name in the URDF. */
  model: string;
  /** Arrays of joint values have this layout. */
  layoutVersion: bigint;
  /** Its axes that can move, depth first. */
  axes: Axis[];
  /** Names of its links; the first is the root. */
  links: string[];
  /** Why it is out of the simulation; empty where it is not. */
  disabledReason: string;
  /** Kilograms. */
  mass: number;
}

/** The joints of one robot at one moment. */
export interface JointValues {
  position: number[];
  velocity: number[];
  effort: number[];
  /** A position, a velocity or an effort, as `mode` says. */
  target: number[];
  mode: Mode[];
  /** Bits: 1 saturated, 2 at the lower limit, 4 at the upper. */
  flags: number[];
}

/** A point at which two links touch: world axes, metres, newtons. */
export interface ContactPoint {
  robotA: string;
  linkA: string;
  robotB: string;
  linkB: string;
  point: [number, number, number];
  /** From a to b. */
  normal: [number, number, number];
  depth: number;
  /** Newtons on b along the normal. */
  normalForce: number;
}

/** All that moves, of one moment. */
export interface Frame {
  /** Only grows while the daemon lives. */
  sequence: bigint;
  /** Grows where time goes back: resets and restored snapshots. */
  epoch: bigint;
  step: bigint;
  simTime: number;
  /** `performance.now()` when it arrived. */
  receivedAt: number;
  joints: Map<string, JointValues>;
  /** world_from_link, seven a link in the order of `Robot.links`: x y z, then the quaternion x y z w. */
  poses: Map<string, Float64Array>;
  contacts: ContactPoint[];
}

/** How the page and the daemon stand. */
export interface Connection {
  state: "connecting" | "live" | "lost";
  /** A sentence, where it is lost. */
  reason: string;
  /** When it is tried again, as `performance.now()`. */
  retryAt: number;
}

/** How the world runs. */
export interface Simulation {
  state: "stopped" | "playing" | "paused";
  /** Real-time factor that was asked for; infinite as fast as possible. */
  target: number;
  /** Real-time factor reached over the last second. */
  actual: number;
  /** It cannot keep up. */
  behind: boolean;
  overruns: bigint;
  /** Wall seconds that a step takes. */
  stepDuration: number;
}

/** The world's settings. */
export interface Physics {
  /** Seconds. */
  timeStep: number;
  substeps: number;
  realTimeFactor: number;
  asFastAsPossible: boolean;
  gravity: [number, number, number];
}

/** A slider or a button that a program put up. */
export interface Parameter {
  name: string;
  kind: "slider" | "button";
  minimum: number;
  maximum: number;
  value: number;
  presses: bigint;
}

/** Somebody else who uses this daemon, or this page. */
export interface Client {
  name: string;
  /** Wall seconds since its last call. */
  idle: number;
  isCaller: boolean;
  transport: string;
}

export const robots = signal<Robot[]>([]);
export const frame = signal<Frame | null>(null);
export const connection = signal<Connection>({ state: "connecting", reason: "", retryAt: 0 });
export const simulation = signal<Simulation>({
  state: "paused",
  target: 1,
  actual: 0,
  behind: false,
  overruns: 0n,
  stepDuration: 0,
});
export const physics = signal<Physics | null>(null);
export const parameters = signal<Parameter[]>([]);
export const clients = signal<Client[]>([]);
/** Who set a joint's last target, by "robot/joint". */
export const targetSources = signal<Map<string, string>>(new Map());
export const daemonName = signal("");

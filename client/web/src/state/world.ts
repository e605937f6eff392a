// The state of the world as signals: written by the connection to the daemon, read by the scene and the panels.
import { signal } from "@preact/signals";

/** Mode of a joint's actuator; "none" is a joint without one. */
export type Mode = "passive" | "position" | "velocity" | "effort" | "hold" | "none";

/** Mode and target of an axis. */
export interface Target {
  mode: Mode;
  value: number;
}

/** One scalar degree of freedom: a row of the panel. Radians and newton metres, or metres and newtons. */
export interface Axis {
  /** "robot/joint", or "robot/joint/1" for axis 1 of a planar joint. */
  key: string;
  robot: string;
  joint: string;
  /**
   * Index of the axis in its joint. Planar joint: 0 x, 1 y, 2 angle. Ball joint: 0 roll, 1 pitch, 2 yaw. Other
   * joints: 0.
   */
  axis: number;
  /** Whether it is one of three axes of a ball joint, whose position is a quaternion: see `axisValues`. */
  isBall?: true;
  /** The label of its row. */
  label: string;
  kind: "angle" | "length";
  lower?: number;
  upper?: number;
  velocityLimit?: number;
  effortLimit?: number;
  /** Index into `JointValues.position`; for a ball joint, the index of its quaternion. */
  positionIndex: number;
  /** Index into the other arrays of `JointValues`. */
  velocityIndex: number;
  childLink: string;
  /** Whether it takes targets: false for mimic joints. */
  actuated: boolean;
  /** The joint that it mimics. */
  mimics?: string;
  /** The client that has claimed it; empty without one. */
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
  /** Reason why it is disabled; empty if it is not. */
  disabledReason: string;
  /** The client that has claimed all of it; empty without one. */
  claimedBy: string;
  /** Kilograms. */
  mass: number;
}

/** The joints of one robot at one moment. */
export interface JointValues {
  position: number[];
  velocity: number[];
  effort: number[];
  /**
   * A position, a velocity or an effort, according to `mode`; for a ball joint's position the rotation vector.
   */
  target: number[];
  mode: Mode[];
  /** Bits: 1 saturated, 2 at the lower limit, 4 at the upper. */
  flags: number[];
  /** Names of the bodies that block joints by contact, by joint. Absent without any. */
  blocks?: Map<string, string>;
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
  /** Force on b along the normal, newtons. */
  normalForce: number;
}

/** The state of all robots at one step. */
export interface Frame {
  /** Increases as long as the daemon runs. */
  sequence: bigint;
  /** Increases when time is set back: by a reset or a restored state. */
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

/** The state of the connection to the daemon. */
export interface Connection {
  state: "connecting" | "live" | "lost";
  /** A message for the user, if it is lost. */
  reason: string;
  /** Time of the next attempt, as `performance.now()`. */
  retryAt: number;
  /** The daemon asks for a token, and the page has no valid one. */
  needsToken?: boolean;
}

/** The state and the speed of the simulation. */
export interface Simulation {
  state: "stopped" | "playing" | "paused";
  /** Target real-time factor; infinite for as fast as possible. */
  target: number;
  /** Real-time factor reached over the last second. */
  actual: number;
  /** The simulation cannot keep up with the target. */
  behind: boolean;
  overruns: bigint;
  /** Wall seconds that a step takes. */
  stepDuration: number;
  /** The client that has claimed the world; empty without one. */
  claimedBy: string;
}

/** The physics settings. */
export interface Physics {
  /** Seconds. */
  timeStep: number;
  substeps: number;
  realTimeFactor: number;
  asFastAsPossible: boolean;
  gravity: [number, number, number];
}

/** A slider or a button that a program has added. */
export interface Parameter {
  name: string;
  kind: "slider" | "button";
  minimum: number;
  maximum: number;
  value: number;
  presses: bigint;
  /** "robot/joint" of the joint whose target a slider sets; empty without one. */
  joint: string;
}

/** A client of this daemon, which may be this page. */
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
  claimedBy: "",
});
export const physics = signal<Physics | null>(null);
export const parameters = signal<Parameter[]>([]);
export const clients = signal<Client[]>([]);
/** The client that set the last target of a joint, by "robot/joint". */
export const targetSources = signal<Map<string, string>>(new Map());
export const daemonName = signal("");

/** The daemon's limits in bytes: of a description, of another file, and of a message. */
export interface RequestBytes {
  description: number;
  asset: number;
  message: number;
}

/** Null until the daemon has sent them. */
export const limits = signal<RequestBytes | null>(null);

/** Permissions of a token. */
export type Role = "viewer" | "operator" | "admin";

const ROLES: readonly (string | undefined)[] = ["viewer", "operator", "admin"] satisfies Role[];

export function isRole(value: string | undefined): value is Role {
  return ROLES.includes(value);
}

/** Role of this page; null if the daemon asks for no tokens, so that every client may do everything. */
export const role = signal<Role | null>(null);
/** Name of this page's token; empty if the daemon asks for none. */
export const tokenName = signal("");

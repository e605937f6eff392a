// The shapes of each robot, in flat lists as in the scene of the daemon.
import { signal } from "@preact/signals";

/** A rigid transform: x y z, then the quaternion x y z w. */
export type Pose = readonly [number, number, number, number, number, number, number];

export type Vector = readonly [number, number, number];

/** Metres. Cylinders, capsules and cones are about z. */
export type Geometry =
  | { kind: "box"; size: Vector }
  | { kind: "sphere"; radius: number }
  | { kind: "cylinder"; radius: number; length: number }
  /** `length` without the caps. */
  | { kind: "capsule"; radius: number; length: number }
  /** The base at -`length` / 2, the apex at `length` / 2. */
  | { kind: "cone"; radius: number; length: number }
  | { kind: "plane"; normal: Vector }
  /** `sha256` identifies the complete appearance; empty if the file is missing. */
  | { kind: "mesh"; sha256: string; uri: string; scale: Vector }
  /** A convex hull or part of a mesh, which the daemon made. */
  | { kind: "convex"; sha256: string };

/** Number of repetitions of a picture, across and up: on each metre of a box or plane, or on each side of a shape. */
export interface TextureRepeat {
  x: number;
  y: number;
  perMetre: boolean;
}

/** One shape of a link. */
export interface Shape {
  /** Index into `Robot.links`. */
  link: number;
  linkFromShape: Pose;
  geometry: Geometry;
  /** Red, green, blue, alpha, each 0 to 1; absent if the description has none. */
  color?: readonly [number, number, number, number];
  /** SHA-256 of its picture, which the colour multiplies; absent without one. */
  texture?: string;
  /** Number of repetitions of the picture; absent for one. */
  textureRepeat?: TextureRepeat;
}

/** One link of a robot. */
export interface SceneLink {
  name: string;
  /** Index of the parent; -1 for the root. */
  parent: number;
  /** Whether it can move: its base is free, or a joint on the way to the root can move. */
  movable: boolean;
  /** Kilograms. */
  mass: number;
  /** In the link's frame, metres; absent for robots of recordings. */
  centreOfMass?: Vector;
  /** About the centre of mass, in the link's axes, kg m^2: xx xy xz yy yz zz. */
  inertia?: readonly number[];
}

/** One joint of a robot, including joints that cannot move. */
export interface SceneJoint {
  name: string;
  type: "fixed" | "revolute" | "continuous" | "prismatic" | "planar" | "spherical" | "floating" | "joint";
  /** Name of the link that it moves. Its frame is the frame of this link. */
  child: string;
  /** Unit vector in its frame, the normal of a planar joint; absent without an axis. */
  axis?: Vector;
  /** Radians or metres; N m or N; rad/s or m/s. */
  lower?: number;
  upper?: number;
  effort?: number;
  velocity?: number;
  /** N m s/rad or N s/m. */
  damping: number;
  /** N m or N. */
  friction: number;
  /** The joint that it mimics. */
  mimics?: string;
  /** Joints that it pulls, if it is a tendon. */
  pulls?: string[];
}

/** One robot. */
export interface RobotScene {
  robot: string;
  layoutVersion: bigint;
  links: SceneLink[];
  /** Absent for robots of recordings. */
  joints?: readonly SceneJoint[];
  visuals: Shape[];
  /** Visual shapes of the description. */
  collisions: Shape[];
  /** Collision shapes that the physics uses in their place. */
  colliders: Shape[];
}

/** By the robot's name. */
export const scenes = signal<Map<string, RobotScene>>(new Map());

/** Whether the world has ground for robots: a plane, or something wide that cannot move. True until that is known. */
export const hasGround = signal(true);

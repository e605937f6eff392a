// Sensors of robots, and their measurements.
import { signal } from "@preact/signals";
import type { Pose, Vector } from "./scene";

export type SensorKind = "imu" | "force-torque" | "contact" | "range" | "lidar" | "link state" | "encoder" | "odometry" | "camera" | "sensor";

/** Evenly spaced angles, radians. */
export interface Sweep {
  samples: number;
  min: number;
  max: number;
}

/** The rays of a lidar or a range finder: each vertical angle with each horizontal one. */
export interface Scan {
  horizontal: Sweep;
  vertical: Sweep;
}

/** Optics of a camera: a pinhole, along x. */
export interface Lens {
  /** Pixels. */
  width: number;
  height: number;
  /** From left to right, radians. */
  fieldOfView: number;
  /** Metres: nearer and farther things are invisible. */
  near: number;
  far: number;
}

/** A sensor of a robot. */
export interface Sensor {
  robot: string;
  name: string;
  kind: SensorKind;
  /** The link or joint that carries it. */
  on: string;
  /** Samples per simulated second; undefined for one each step. */
  rate: number | undefined;
  /** Reason why it has no readings; empty if it has. */
  unavailable: string;
  /** link_from_sensor. */
  pose?: Pose;
  /** Scan of a sensor that measures ranges. */
  scan?: Scan;
  /** Lens of a camera. */
  lens?: Lens;
}

/** Latest measurement of a sensor. SI units. */
export type Measurement =
  | { kind: "imu"; acceleration: Vector; angular: Vector }
  | { kind: "force-torque"; force: Vector; torque: Vector }
  | { kind: "contact"; touching: boolean; normalForce: number; partners: readonly string[] }
  | { kind: "range"; range: number }
  | { kind: "lidar"; rays: number; hits: number; nearest: number; ranges: readonly number[] }
  | { kind: "motion"; position: Vector; linear: Vector; angular: Vector }
  | { kind: "encoder"; position: number; velocity: number }
  | { kind: "unknown" };

/** By robot, in the order of creation. */
export const sensors = signal<readonly Sensor[]>([]);
/** The robot whose readings are shown; empty without one. */
export const sensorsShownOf = signal("");
/** The newest of each sensor of that robot, by the sensor's name. */
export const readings = signal<ReadonlyMap<string, Measurement>>(new Map());

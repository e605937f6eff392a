// Drawings of programs in addition to the world.
import { signal } from "@preact/signals";
import type { Vector } from "./scene";

/** Metres; colours from 0 to 1, one for each line or point, or none. */
export type MarkerShape =
  /** x, y, z of both ends of each line; `width` in CSS pixels. */
  | { kind: "lines"; points: readonly number[]; colors: readonly number[]; width: number }
  /** `size` in CSS pixels. */
  | { kind: "points"; points: readonly number[]; colors: readonly number[]; size: number }
  /** `size` is the height of a line, metres. Without an orientation (x y z w) it faces the camera. */
  | { kind: "text"; text: string; position: Vector; orientation: readonly [number, number, number, number] | null; size: number };

/** A drawing. It never changes: a replacement is another object. */
export interface Marker {
  id: bigint;
  shape: MarkerShape;
  /**
   * Default colour as red, green, blue and alpha; null stands for a colour that is visible on the background.
   */
  color: readonly [number, number, number, number] | null;
  /** The robot with which it moves; empty without one. */
  robot: string;
  /** Link of the robot; empty stands for its root link. */
  link: string;
}

/** Red, green, blue and alpha. */
export type Rgba = readonly [number, number, number, number];

/** Colours that programs gave links of a robot, in place of the description's. */
export interface RobotColors {
  /** Layout version of the robot to which the colours were given. */
  layoutVersion: bigint;
  /** By the names of links. */
  links: ReadonlyMap<string, Rgba>;
}

/** By robot. */
export const linkColors = signal<ReadonlyMap<string, RobotColors>>(new Map());

/** By id, in the order in which they were added. */
export const markers = signal<ReadonlyMap<bigint, Marker>>(new Map());

// Constraints between links, beside the joints of their robots.
import { signal } from "@preact/signals";
import type { Pose, Vector } from "./scene";

export type ConstraintKind = "weld" | "point to point" | "hinge" | "slide" | "gear" | "distance" | "rope" | "constraint";

/** Body at one end of a constraint. */
export interface ConstraintEnd {
  /** Empty: the world. */
  robot: string;
  link: string;
  /** Joint at a gear's end, which has no link. */
  joint: string;
  /** link_from_frame, or world_from_frame. */
  pose: Pose;
}

/** A constraint, and what it did over the last step. */
export interface Constraint {
  name: string;
  kind: ConstraintKind;
  parent: ConstraintEnd;
  child: ConstraintEnd;
  /** On the child, world axes, newtons; of a gear of a sliding joint along its axis. */
  force: Vector;
  /** On the child, world axes, newton metres; of a gear of a turning joint about its axis. */
  torque: Vector;
  /** Where the force acts, world axes, metres. */
  point: Vector;
  /** How far the ends are from where they are to be: metres, and radians. */
  positionError: number;
  angleError: number;
  /** Newtons, of a gear of a turning joint newton metres; infinite where there is no limit. */
  maxForce: number;
  /** Whether it reached its bound. */
  saturated: boolean;
}

/** Constraints that are drawn at most: the first ones. */
export const MOST_DRAWN = 400;

/** In the order in which they were made. */
export const constraints = signal<readonly Constraint[]>([]);
/** Name of the one under the pointer in the panel; empty if there is none. */
export const hoveredConstraint = signal("");

/** Relative to the larger of a value and 1: less is not seen. */
const SEEN = 1e-3;

/** Whether two lists look alike: figures that differ by less than is seen do not count. */
export function sameConstraints(a: readonly Constraint[], b: readonly Constraint[]): boolean {
  return a.length === b.length && a.every((one, index) => isSame(one, b[index]));
}

function isSame(a: unknown, b: unknown): boolean {
  if (typeof a === "number" && typeof b === "number") return a === b || Math.abs(a - b) <= SEEN * Math.max(1, Math.abs(a));
  if (typeof a !== "object" || typeof b !== "object" || a === null || b === null) return a === b;
  const [left, right] = [Object.entries(a), new Map(Object.entries(b))];
  return left.length === right.size && left.every(([key, value]) => isSame(value, right.get(key)));
}

// Constraints between links, in addition to the joints of their robots.
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

/** A constraint, and its effect over the last step. */
export interface Constraint {
  name: string;
  kind: ConstraintKind;
  parent: ConstraintEnd;
  child: ConstraintEnd;
  /** Force on the child, world axes, newtons; for a gear of a sliding joint along its axis. */
  force: Vector;
  /** Torque on the child, world axes, newton metres; for a gear of a turning joint about its axis. */
  torque: Vector;
  /** Point at which the force acts, world axes, metres. */
  point: Vector;
  /** Distance of the ends from their target: metres, and radians. */
  positionError: number;
  angleError: number;
  /** Limit in newtons, for a gear of a turning joint in newton metres; infinite without a limit. */
  maxForce: number;
  /** Whether it reached its bound. */
  saturated: boolean;
}

/** Maximum number of drawn constraints: the first ones. */
export const MAX_DRAWN = 400;

/** Constraints in the order of their creation. */
export const constraints = signal<readonly Constraint[]>([]);
/** Name of the constraint under the pointer in the panel; empty without one. */
export const hoveredConstraint = signal("");

/** Tolerance relative to the larger of a value and 1: smaller differences are invisible. */
const SEEN = 1e-3;

/** Whether two lists look alike: invisible differences do not count. */
export function sameConstraints(a: readonly Constraint[], b: readonly Constraint[]): boolean {
  return a.length === b.length && a.every((one, index) => isSame(one, b[index]));
}

function isSame(a: unknown, b: unknown): boolean {
  if (typeof a === "number" && typeof b === "number") return a === b || Math.abs(a - b) <= SEEN * Math.max(1, Math.abs(a));
  if (typeof a !== "object" || typeof b !== "object" || a === null || b === null) return a === b;
  const [left, right] = [Object.entries(a), new Map(Object.entries(b))];
  return left.length === right.size && left.every(([key, value]) => isSame(value, right.get(key)));
}

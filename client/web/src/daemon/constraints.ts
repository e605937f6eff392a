// Conversion of constraints from messages to the state of the page.
import { ConstraintKind as Kind, type Constraint as Wire, type ConstraintEnd as WireEnd } from "../gen/simd/v1/constraint_pb";
import type { Constraint, ConstraintEnd, ConstraintKind } from "../state/constraints";
import { poseOf, vectorOf } from "./mapping";

const KINDS: Record<Kind, ConstraintKind> = {
  [Kind.UNSPECIFIED]: "constraint",
  [Kind.WELD]: "weld",
  [Kind.POINT_TO_POINT]: "point to point",
  [Kind.HINGE]: "hinge",
  [Kind.SLIDE]: "slide",
  [Kind.GEAR]: "gear",
  [Kind.DISTANCE]: "distance",
};

export function constraintOf(wire: Wire): Constraint {
  const { name, kind, force, torque, point, positionError, angleError, maxForce, saturated, rope } = wire;
  return {
    name,
    // A kind from a newer version of the schema is still a constraint.
    kind: rope ? "rope" : (KINDS[kind] ?? "constraint"),
    parent: endOf(wire.parent),
    child: endOf(wire.child),
    force: vectorOf(force),
    torque: vectorOf(torque),
    point: vectorOf(point),
    positionError,
    angleError,
    maxForce: maxForce ?? Infinity,
    saturated,
  };
}

function endOf(end: WireEnd | undefined): ConstraintEnd {
  const { robot = "", link = "", joint = "", pose } = end ?? {};
  return { robot, link, joint, pose: poseOf(pose) };
}

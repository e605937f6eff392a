// Targets of joints as messages.
import type { MessageInitShape } from "@bufbuild/protobuf";
import type { JointTargetSchema } from "../gen/simd/v1/joint_pb";
import { quaternionOf, type Triple } from "../state/joint-values";
import type { Axis, Mode } from "../state/world";

export type WireTarget = MessageInitShape<typeof JointTargetSchema>;

/** A target as a message; undefined for joints without an actuator. */
export function targetOf(axis: Axis, mode: Mode, value: number): WireTarget | undefined {
  const where = { joint: axis.joint, axis: axis.axis };
  switch (mode) {
    case "position":
      return { ...where, target: { case: "position", value: { position: value } } };
    case "velocity":
      return { ...where, target: { case: "velocity", value: { velocity: value } } };
    case "effort":
      return { ...where, target: { case: "effort", value: { effort: value } } };
    case "passive":
      return { ...where, target: { case: "passive", value: {} } };
    case "hold":
      return { ...where, target: { case: "hold", value: {} } };
    case "none":
      return undefined;
  }
}

/**
 * Returns all three targets of a ball joint as a message: roll, pitch and yaw, or the mode's values about the
 * child's axes.
 */
export function ballTargetOf(axis: Axis, mode: Mode, values: Triple): WireTarget | undefined {
  const where = { joint: axis.joint, axis: 0 };
  switch (mode) {
    case "position": {
      const [x, y, z, w] = quaternionOf(values);
      return { ...where, target: { case: "sphericalPosition", value: { orientation: { x, y, z, w } } } };
    }
    case "velocity":
      return { ...where, target: { case: "sphericalVelocity", value: { angularVelocity: vector(values) } } };
    case "effort":
      return { ...where, target: { case: "sphericalEffort", value: { torque: vector(values) } } };
    default:
      return targetOf({ ...axis, axis: 0 }, mode, 0);
  }
}

function vector([x, y, z]: Triple): { x: number; y: number; z: number } {
  return { x, y, z };
}

// Values of one axis from its robot's values; a ball joint's as roll, pitch and yaw.
import type { Axis, JointValues, Mode } from "./world";

export type Triple = [number, number, number];
export type Quaternion = [number, number, number, number];

/** The values of one row. Radians and newton metres, or metres and newtons. */
export interface AxisValues {
  position: number;
  velocity: number;
  effort: number;
  target: number;
  mode: Mode;
  flags: number;
  /** Name of the body that blocks its joint by contact; empty without one. */
  blockedBy: string;
}

/** Distance from a pitch of a quarter turn within which roll and yaw turn about one axis; all of it is then the yaw. */
const UPRIGHT = 1 - 1e-12;

/** Returns angles about the fixed axes x, y and z, in this order, of a quaternion x y z w, as in URDF. */
export function rollPitchYaw([x, y, z, w]: Quaternion): Triple {
  const length = Math.hypot(x, y, z, w);
  if (!(length > 0) || !Number.isFinite(length)) return [0, 0, 0];
  const [a, b, c, d] = [x / length, y / length, z / length, w / length];
  const sine = 2 * (d * b - c * a);
  if (Math.abs(sine) > UPRIGHT) return [0, Math.sign(sine) * (Math.PI / 2), wrapped(-2 * Math.sign(sine) * Math.atan2(a, d))];
  return [
    Math.atan2(2 * (d * a + b * c), 1 - 2 * (a * a + b * b)),
    Math.asin(sine),
    Math.atan2(2 * (d * c + a * b), 1 - 2 * (b * b + c * c)),
  ];
}

function wrapped(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** The quaternion x y z w of these angles. */
export function quaternionOf([roll, pitch, yaw]: Triple): Quaternion {
  const [cr, cp, cy] = [Math.cos(roll / 2), Math.cos(pitch / 2), Math.cos(yaw / 2)];
  const [sr, sp, sy] = [Math.sin(roll / 2), Math.sin(pitch / 2), Math.sin(yaw / 2)];
  return [sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy];
}

/** The quaternion of a rotation vector, an axis times its angle. */
function turned([x, y, z]: Triple): Quaternion {
  const angle = Math.hypot(x, y, z);
  const factor = angle > 1e-9 ? Math.sin(angle / 2) / angle : 0.5;
  return [x * factor, y * factor, z * factor, Math.cos(angle / 2)];
}

/** The values of an axis; undefined if the arrays do not have it. */
export function axisValues(axis: Axis, values: JointValues): AxisValues | undefined {
  const { velocityIndex: at } = axis;
  const mode = values.mode[at];
  const position = axis.isBall ? ballPosition(axis, values)?.[axis.axis] : values.position[axis.positionIndex];
  if (position === undefined || mode === undefined) return undefined;
  const target = axis.isBall ? ballTarget(axis, values)[axis.axis] : values.target[at];
  return { position, velocity: values.velocity[at] ?? 0, effort: values.effort[at] ?? 0, target: target ?? 0, mode, flags: values.flags[at] ?? 0, blockedBy: values.blocks?.get(axis.joint) ?? "" };
}

/** Roll, pitch and yaw of a ball joint. */
function ballPosition({ positionIndex }: Axis, { position }: JointValues): Triple | undefined {
  const [x, y, z, w] = position.slice(positionIndex, positionIndex + 4);
  return x === undefined || y === undefined || z === undefined || w === undefined ? undefined : rollPitchYaw([x, y, z, w]);
}

/** Returns the three targets of a ball joint: roll, pitch and yaw, or its mode's values about the child's x, y and z. */
function ballTarget(axis: Axis, values: JointValues): Triple {
  const first = axis.velocityIndex - axis.axis;
  const target = triple(values.target, first);
  const mode = values.mode[first];
  // The daemon stores an orientation as a rotation vector.
  return mode === "position" || mode === "hold" ? rollPitchYaw(turned(target)) : target;
}

function triple(values: readonly number[], first: number): Triple {
  return [values[first] ?? 0, values[first + 1] ?? 0, values[first + 2] ?? 0];
}

/** Returns the three values of a ball joint in the quantity of a mode: its targets if it is in that mode, else its state. */
export function ballNow(axis: Axis, mode: Mode, values: JointValues): Triple {
  const first = axis.velocityIndex - axis.axis;
  if (values.mode[first] === mode) return ballTarget(axis, values);
  if (mode === "velocity") return triple(values.velocity, first);
  if (mode === "effort") return triple(values.effort, first);
  return ballPosition(axis, values) ?? [0, 0, 0];
}

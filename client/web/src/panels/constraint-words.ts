// Words of the panel for constraints.
import { MAX_DRAWN, type Constraint } from "../state/constraints";
import { shortened } from "./quantity";

/** Returns a note that not all of them are drawn; empty if they are. */
export function undrawn(count: number): string {
  return count > MAX_DRAWN ? `Only the first ${MAX_DRAWN} of these ${count} are drawn.` : "";
}

/** Returns the force of a constraint over the last step, and its bound if it has one. */
export function reading({ kind, force, torque, maxForce }: Constraint): string {
  const [ofForce, ofTorque] = [size(force), size(torque)];
  const limit = Number.isFinite(maxForce) ? ` of ${shortened(maxForce)}` : "";
  if (kind !== "gear") return `${shortened(ofForce)} N${limit && `${limit} N`} · ${shortened(ofTorque)} N m`;
  // A gear acts about an axis or along one. If it does nothing, this code cannot tell which.
  const unit = ofTorque > 0 ? " N m" : ofForce > 0 ? " N" : "";
  return `${shortened(Math.max(ofForce, ofTorque))}${limit}${unit}`;
}

/** Returns the distance of a constraint's ends from their target, with its unit. */
export function offBy({ kind, positionError, angleError, torque }: Constraint): string {
  const [shift, angle] = [`${shortened(positionError * 1e3)} mm`, `${shortened(angleError)} rad`];
  if (kind !== "gear") return `${shift} and ${angle}`;
  return size(torque) > 0 ? `${shortened(positionError)} rad` : shift;
}

/** Returns the meaning of the reading. */
export function meaning({ kind }: Constraint): string {
  if (kind === "gear") return "What the gear does to its child's joint, about the joint's axis or along it, over the last step";
  return "Force and torque on the child over the last step";
}

function size([x, y, z]: readonly [number, number, number]): number {
  return Math.hypot(x, y, z);
}

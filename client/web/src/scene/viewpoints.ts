// Positions and targets of a camera: presets, moves by the keyboard, and the way from one to another.
import { MathUtils, Vector3 } from "three";
import type { Viewpoint } from "../state/view";

/** Position of a camera and its target, metres. */
export interface View {
  target: Vector3;
  position: Vector3;
}

/** From the target to the camera. Robots face along x. From above x is to the right, so the camera is a little towards -y. */
export const DIRECTIONS: Readonly<Record<Viewpoint, Vector3>> = {
  front: new Vector3(1, 0, 0),
  back: new Vector3(-1, 0, 0),
  left: new Vector3(0, 1, 0),
  right: new Vector3(0, -1, 0),
  top: new Vector3(0, -1e-4, 1).normalize(),
  bottom: new Vector3(0, -1e-4, -1).normalize(),
  corner: new Vector3(1, 1.15, 0.62).normalize(),
};

/** Minimum angle to the z axis, radians: along z the up direction would be undefined. */
const UPRIGHT = 1e-4;

/** Returns the same target from another direction, at the same distance. */
export function seenFrom({ target, position }: View, viewpoint: Viewpoint): View {
  return { target: target.clone(), position: target.clone().addScaledVector(DIRECTIONS[viewpoint], position.distanceTo(target)) };
}

/** Returns the viewpoint turned about the target: to the right and upwards, radians. */
export function orbited({ target, position }: View, right: number, up: number): View {
  const at = polar(position.clone().sub(target));
  const polarAngle = MathUtils.clamp(at.polar - up, UPRIGHT, Math.PI - UPRIGHT);
  return { target: target.clone(), position: cartesian({ ...at, azimuth: at.azimuth + right, polar: polarAngle }).add(target) };
}

/** Returns the viewpoint moved with its target in the plane of the picture, metres. */
export function panned({ target, position }: View, right: number, up: number): View {
  const away = position.clone().sub(target).normalize();
  const aside = new Vector3(0, 0, 1).cross(away).normalize();
  const shift = away.clone().cross(aside).multiplyScalar(up).addScaledVector(aside, right);
  return { target: target.clone().add(shift), position: position.clone().add(shift) };
}

/** Returns the viewpoint at this many times the distance to the target, within bounds in metres. */
export function zoomed({ target, position }: View, factor: number, nearest: number, farthest: number): View {
  const away = position.clone().sub(target);
  const distance = MathUtils.clamp(away.length() * factor, nearest, farthest);
  return { target: target.clone(), position: target.clone().addScaledVector(away.normalize(), distance) };
}

/** Returns a point on the way from one to another: around the target, not through it. */
export function between(from: View, to: View, share: number): View {
  const target = from.target.clone().lerp(to.target, share);
  const [a, b] = [polar(from.position.clone().sub(from.target)), polar(to.position.clone().sub(to.target))];
  // The shorter way around.
  const turn = MathUtils.euclideanModulo(b.azimuth - a.azimuth + Math.PI, 2 * Math.PI) - Math.PI;
  const offset = cartesian({
    radius: MathUtils.lerp(a.radius, b.radius, share),
    polar: MathUtils.lerp(a.polar, b.polar, share),
    azimuth: a.azimuth + share * turn,
  });
  return { target, position: target.clone().add(offset) };
}

/** Metres; radians from z, and from x about z. */
interface Polar {
  radius: number;
  polar: number;
  azimuth: number;
}

function polar({ x, y, z }: Vector3): Polar {
  const radius = Math.hypot(x, y, z);
  return { radius, polar: radius > 0 ? Math.acos(MathUtils.clamp(z / radius, -1, 1)) : 0, azimuth: Math.atan2(y, x) };
}

function cartesian({ radius, polar: angle, azimuth }: Polar): Vector3 {
  return new Vector3(Math.sin(angle) * Math.cos(azimuth), Math.sin(angle) * Math.sin(azimuth), Math.cos(angle)).multiplyScalar(radius);
}

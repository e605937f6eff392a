// Comparison of two states: if they look alike, the page has nothing to draw and little to fetch.
import type { Frame, JointValues } from "./world";

/** Metres, and components of a quaternion: smaller motions are not drawn. */
export const MIN_MOTION = 1e-6;
/** Tolerance below the panel's display: radians or metres, and their velocities; newton metres or newtons. */
const MIN_POSITION = 1e-4;
const MIN_VELOCITY = 1e-3;
const MIN_EFFORT = 1e-2;

/** Whether no link has moved from one state to the other. */
export function samePoses(before: Frame, now: Frame): boolean {
  if (before.epoch !== now.epoch || before.poses.size !== now.poses.size) return false;
  for (const [robot, poses] of now.poses) {
    const old = before.poses.get(robot);
    if (old !== poses && (!old || !isClose(old, poses, MIN_MOTION))) return false;
  }
  return true;
}

/** Whether no link has moved and no joint shows another value. */
export function isStill(before: Frame, now: Frame): boolean {
  if (!samePoses(before, now) || before.joints.size !== now.joints.size) return false;
  for (const [robot, values] of now.joints) {
    const old = before.joints.get(robot);
    if (old !== values && (!old || !sameValues(old, values))) return false;
  }
  return true;
}

function sameValues(a: JointValues, b: JointValues): boolean {
  return (
    isClose(a.position, b.position, MIN_POSITION) &&
    isClose(a.velocity, b.velocity, MIN_VELOCITY) &&
    isClose(a.effort, b.effort, MIN_EFFORT) &&
    isClose(a.target, b.target, 0) &&
    isClose(a.flags, b.flags, 0) &&
    a.mode.length === b.mode.length &&
    a.mode.every((mode, index) => mode === b.mode[index])
  );
}

function isClose(a: ArrayLike<number>, b: ArrayLike<number>, least: number): boolean {
  if (a.length !== b.length) return false;
  for (let at = 0; at < a.length; at += 1) {
    // Values that are not finite are close to nothing.
    if (!(Math.abs((a[at] ?? NaN) - (b[at] ?? NaN)) <= least)) return false;
  }
  return true;
}

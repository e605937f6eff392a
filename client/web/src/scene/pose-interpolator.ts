// Interpolates the poses of links between two states: the picture is one interval late, and moves evenly.
import { samePoses } from "../state/stillness";
import type { Frame } from "../state/world";

/** Maximum duration of an interpolation, milliseconds. */
const MAX_INTERVAL = 100;
/** Minimum milliseconds between two states that are not interpolated: the page was paused or hidden. */
const GAP = 1000;

/** The last two states, and the progress from one to the other. */
export class PoseInterpolator {
  private before: Frame | null = null;
  private last: Frame | null = null;
  /** No link has moved between the two: no interpolation is needed. */
  private still = false;

  /** Takes the newest state. */
  push(frame: Frame): void {
    const { last } = this;
    const continues = last !== null && frame.epoch === last.epoch && frame.sequence > last.sequence;
    this.before = continues && frame.receivedAt - last.receivedAt < GAP ? last : null;
    this.last = frame;
    this.still = this.before !== null && samePoses(this.before, frame);
  }

  /** Whether no link has moved since the state before. */
  isStill(): boolean {
    return this.still;
  }

  /** The newest state. */
  newest(): Frame | null {
    return this.last;
  }

  /** Whether the picture at `now` shows the newest state. */
  isSettled(now: number): boolean {
    return this.progress(now) >= 1;
  }

  /** Returns the newest state that the picture at `now` shows or has passed. */
  reached(now: number): Frame | null {
    return this.isSettled(now) ? this.last : this.before;
  }

  /**
   * Writes the poses of a robot's links at `now` into `out`, seven numbers a link. Returns whether the robot has
   * poses.
   */
  sample(robot: string, now: number, out: Float64Array): boolean {
    const to = this.last?.poses.get(robot);
    if (!to || to.length !== out.length) return false;
    const from = this.before?.poses.get(robot);
    const progress = this.progress(now);
    if (!from || from.length !== to.length || progress >= 1) out.set(to);
    else for (let at = 0; at < to.length; at += 7) interpolate(from, to, at, progress, out);
    return true;
  }

  /** Returns the progress from the state before to the last one: 0 to 1. */
  private progress(now: number): number {
    if (!this.before || !this.last || this.still) return 1;
    const interval = Math.min(MAX_INTERVAL, this.last.receivedAt - this.before.receivedAt);
    return interval <= 0 ? 1 : Math.min(1, Math.max(0, (now - this.last.receivedAt) / interval));
  }
}

/** Linear for positions, along the shorter great circle for rotations (slerp, Shoemake, 1985). */
export function interpolate(from: Float64Array, to: Float64Array, at: number, share: number, out: Float64Array): void {
  for (let i = at; i < at + 3; i += 1) out[i] = mix(from, to, i, 1 - share, share);
  let dot = 0;
  for (let i = at + 3; i < at + 7; i += 1) dot += (from[i] ?? 0) * (to[i] ?? 0);
  // A quaternion and its negative are the same rotation: the nearer of the two is taken.
  const sign = dot < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(1, Math.abs(dot)));
  // For almost equal rotations the line is as good as the circle.
  const [a, b] = angle < 1e-4 ? [1 - share, share] : [Math.sin((1 - share) * angle) / Math.sin(angle), Math.sin(share * angle) / Math.sin(angle)];
  for (let i = at + 3; i < at + 7; i += 1) out[i] = mix(from, to, i, a, sign * b);
}

function mix(from: Float64Array, to: Float64Array, i: number, a: number, b: number): number {
  return a * (from[i] ?? 0) + b * (to[i] ?? 0);
}

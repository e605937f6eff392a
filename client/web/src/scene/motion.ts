// Where links are between two states: the picture is one interval behind, and moves evenly.
import type { Frame } from "../state/world";

/** Milliseconds: states that come more seldom than this are gone to as fast as if they came so often. */
const LONGEST = 100;
/** States this far apart, in milliseconds, have nothing to do with each other: a pause, a hidden tab. */
const GAP = 1000;

/** The last two states, and how far the picture is from the one to the other. */
export class Motion {
  private before: Frame | null = null;
  private last: Frame | null = null;

  /** Takes the newest state. */
  push(frame: Frame): void {
    const { last } = this;
    const continues = last !== null && frame.epoch === last.epoch && frame.sequence > last.sequence;
    this.before = continues && frame.receivedAt - last.receivedAt < GAP ? last : null;
    this.last = frame;
  }

  /** The newest state. */
  newest(): Frame | null {
    return this.last;
  }

  /** The newest two, where the one follows from the other. */
  lastTwo(): [Frame, Frame] | null {
    return this.before && this.last ? [this.before, this.last] : null;
  }

  /** Whether the picture at `now` is that of the newest state. */
  isSettled(now: number): boolean {
    return this.share(now) >= 1;
  }

  /** The newest state that the picture at `now` has reached. */
  reached(now: number): Frame | null {
    return this.isSettled(now) ? this.last : this.before;
  }

  /** Poses of a robot's links at `now`, into `out`: seven a link. Answers whether there are any. */
  sample(robot: string, now: number, out: Float64Array): boolean {
    const to = this.last?.poses.get(robot);
    if (!to || to.length !== out.length) return false;
    const from = this.before?.poses.get(robot);
    const share = this.share(now);
    if (!from || from.length !== to.length || share >= 1) out.set(to);
    else for (let at = 0; at < to.length; at += 7) interpolate(from, to, at, share, out);
    return true;
  }

  /** How far from the state before to the last one: 0 to 1. */
  private share(now: number): number {
    if (!this.before || !this.last) return 1;
    const interval = Math.min(LONGEST, this.last.receivedAt - this.before.receivedAt);
    return interval <= 0 ? 1 : Math.min(1, Math.max(0, (now - this.last.receivedAt) / interval));
  }
}

/** Places along the line, rotations along the shorter great circle (Shoemake, 1985). */
export function interpolate(from: Float64Array, to: Float64Array, at: number, share: number, out: Float64Array): void {
  for (let i = at; i < at + 3; i += 1) out[i] = mix(from, to, i, 1 - share, share);
  let dot = 0;
  for (let i = at + 3; i < at + 7; i += 1) dot += (from[i] ?? 0) * (to[i] ?? 0);
  // A quaternion and its negative are one rotation: the nearer of the two is meant.
  const sign = dot < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(1, Math.abs(dot)));
  // Where they are as good as equal, the line between them is the circle.
  const [a, b] = angle < 1e-4 ? [1 - share, share] : [Math.sin((1 - share) * angle) / Math.sin(angle), Math.sin(share * angle) / Math.sin(angle)];
  for (let i = at + 3; i < at + 7; i += 1) out[i] = mix(from, to, i, a, sign * b);
}

function mix(from: Float64Array, to: Float64Array, i: number, a: number, b: number): number {
  return a * (from[i] ?? 0) + b * (to[i] ?? 0);
}

// Targets of ball joints: each row sets one of three, and the daemon takes all three at once.
import { ballNow, type Triple } from "../state/joint-values";
import type { Axis, Frame, Mode } from "../state/world";

/** Milliseconds after which sent targets no longer override the daemon's state: a daemon that was restarted counts its states from one. */
const MAX_AGE = 30_000;

/** Value to which a row was set. */
export interface AxisTarget {
  axis: Axis;
  mode: Mode;
  value: number;
}

/** All three targets of a joint. */
export interface BallTarget {
  axis: Axis;
  mode: Mode;
  values: Triple;
}

/** Completes targets from those sent before, or from the daemon's state. */
export class BallTargets {
  /** `since` is the sequence of the first state with the target, once the daemon has answered. */
  private readonly sent = new Map<string, BallTarget & { at: number; since?: bigint }>();

  /**
   * Returns the targets of the ball joints among these, one a joint. The newest mode of a joint holds for all its rows. Times are
   * milliseconds.
   */
  of(targets: Iterable<AxisTarget>, frame: Frame | null, now: number): BallTarget[] {
    const joints = new Map<string, BallTarget>();
    for (const { axis, mode, value } of targets) {
      if (!axis.isBall) continue;
      const key = `${axis.robot}/${axis.joint}`;
      const before = joints.get(key);
      const values: Triple = before?.mode === mode ? before.values : this.present(key, axis, mode, frame, now);
      values[axis.axis] = value;
      joints.set(key, { axis, mode, values });
    }
    for (const [key, target] of joints) this.sent.set(key, { ...target, at: now });
    return [...joints.values()];
  }

  /** The daemon has applied targets of `of`, from this state on. */
  applied(targets: readonly BallTarget[], since: bigint): void {
    for (const { key, last } of this.sentOf(targets)) this.sent.set(key, { ...last, since });
  }

  /** The daemon has refused targets of `of`. */
  refused(targets: readonly BallTarget[]): void {
    for (const { key } of this.sentOf(targets)) this.sent.delete(key);
  }

  /** Returns what was sent for these targets, except where newer ones were sent. */
  private sentOf(targets: readonly BallTarget[]): { key: string; last: BallTarget & { at: number } }[] {
    return targets.flatMap(({ axis, values }) => {
      const key = `${axis.robot}/${axis.joint}`;
      const last = this.sent.get(key);
      return last?.values === values ? [{ key, last }] : [];
    });
  }

  private present(key: string, axis: Axis, mode: Mode, frame: Frame | null, now: number): Triple {
    const last = this.sent.get(key);
    const isOlder = last?.since === undefined || (frame?.sequence ?? 0n) < last.since;
    if (last && last.mode === mode && isOlder && now - last.at <= MAX_AGE) return [...last.values];
    const values = frame?.joints.get(axis.robot);
    return values ? ballNow(axis, mode, values) : [0, 0, 0];
  }
}

// Targets of ball joints: each row sets one of three, and the daemon takes all three at once.
import { ballNow, type Triple } from "../state/joint-values";
import type { Axis, Frame, Mode } from "../state/world";

/** Milliseconds for which sent targets override the daemon's state, which may be older. */
const RECENT = 1000;

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
  private readonly sent = new Map<string, BallTarget & { at: number }>();

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

  private present(key: string, axis: Axis, mode: Mode, frame: Frame | null, now: number): Triple {
    const last = this.sent.get(key);
    if (last && last.mode === mode && now - last.at <= RECENT) return [...last.values];
    const values = frame?.joints.get(axis.robot);
    return values ? ballNow(axis, mode, values) : [0, 0, 0];
  }
}

// A target that was set on this page and may not be applied yet: it is shown in place of the state of the daemon.
import type { Target } from "../state/world";

/** Milliseconds after the daemon's answer from which a target that it never reports is no longer shown. */
export const PENDING_TIMEOUT = 1000;

/** The last target that was set on this page. */
export class PendingTarget {
  private last: (Target & { at: number }) | null = null;
  private held = false;
  private isAnswered = false;

  /** All times are in milliseconds. */
  set(target: Target, now: number): void {
    this.last = { ...target, at: now };
    this.isAnswered = false;
  }

  /** The daemon has answered the last target. Before that its states do not contain it, however slow it is. */
  answered(now: number): void {
    this.isAnswered = true;
    if (this.last) this.last.at = now;
  }

  /** While a slider is dragged, only the pointer moves it. */
  hold(): void {
    this.held = true;
  }

  release(now: number): void {
    this.held = false;
    if (this.last) this.last.at = now;
  }

  get isHeld(): boolean {
    return this.held;
  }

  /** Returns the target to show; `known` is the daemon's target. */
  shown(known: Target, now: number): Target {
    const { last } = this;
    if (!last) return known;
    if (!this.held && (isSame(last, known) || (this.isAnswered && now - last.at > PENDING_TIMEOUT))) {
      this.last = null;
      return known;
    }
    return { mode: last.mode, value: last.value };
  }
}

/** A passive joint has no target, and the daemon sets the target of a joint that holds. */
function isSame(pending: Target, known: Target): boolean {
  if (pending.mode !== known.mode) return false;
  return pending.mode === "passive" || pending.mode === "hold" || Math.abs(pending.value - known.value) <= 1e-9 * (1 + Math.abs(known.value));
}

// What was asked for on this page and the daemon may not know yet: shown in place of what the daemon says.
import type { Mode } from "../state/world";

/** How long a row shows what was asked for here where the daemon never shows it: milliseconds. */
export const PATIENCE = 1000;

/** A joint's mode and target. */
export interface Target {
  mode: Mode;
  value: number;
}

/** The last target that was asked for here. */
export class Asked {
  private last: (Target & { at: number }) | null = null;
  private held = false;

  /** `now` in milliseconds, as in all of this. */
  set(target: Target, now: number): void {
    this.last = { ...target, at: now };
  }

  /** While a slider is held, nothing but the hand moves it. */
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

  /** What to show where the daemon says `known`. */
  shown(known: Target, now: number): Target {
    const { last } = this;
    if (!last) return known;
    if (!this.held && (isSame(last, known) || now - last.at > PATIENCE)) {
      this.last = null;
      return known;
    }
    return { mode: last.mode, value: last.value };
  }
}

/** A free joint has no target, and the daemon says where a joint that holds does. */
function isSame(asked: Target, known: Target): boolean {
  if (asked.mode !== known.mode) return false;
  return asked.mode === "passive" || asked.mode === "hold" || Math.abs(asked.value - known.value) <= 1e-9 * (1 + Math.abs(known.value));
}

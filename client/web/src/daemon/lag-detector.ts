// Detects a simulation that cannot keep up, as opposed to one that has just started.
import type { Simulation } from "../state/world";

/** The real-time factor is a mean over about a second: after a change it settles within this many polls. */
const POLLS = 3;
/** Below this share of the target factor the simulation is behind. */
const THRESHOLD = 0.97;

/** Takes the polls of the statistics one after the other. */
export class LagDetector {
  private slow = 0;
  private target = 0;

  /** Returns whether the simulation is behind. */
  update({ state, target, actual }: Omit<Simulation, "behind">): boolean {
    const changed = target !== this.target;
    this.target = target;
    const slow = state === "playing" && Number.isFinite(target) && actual < THRESHOLD * target;
    this.slow = slow && !changed ? this.slow + 1 : 0;
    return this.slow >= POLLS;
  }
}

// Tells a world that cannot keep up from one that has only just begun to run.
import type { Simulation } from "../state/world";

/** The factor is a mean over about a second: after a change it takes so many polls, twice a second, to settle. */
const POLLS = 3;
/** Less than this share of what was asked for is behind. */
const ENOUGH = 0.97;

/** Judges one poll after the other. */
export class Punctuality {
  private slow = 0;
  private target = 0;

  /** Whether the world is behind, now that `said` is what the daemon says. */
  judge(said: Omit<Simulation, "behind">): boolean {
    const changed = said.target !== this.target;
    this.target = said.target;
    const slow = said.state === "playing" && Number.isFinite(said.target) && said.actual < ENOUGH * said.target;
    this.slow = slow && !changed ? this.slow + 1 : 0;
    return this.slow >= POLLS;
  }
}

// Reason why a joint misses its target, from the daemon's answers: a word for its row, and a sentence as an explanation.
import type { Axis, Mode } from "../state/world";

/** Known state of a joint and its world. */
export interface Situation {
  axis: Pick<Axis, "label" | "kind" | "lower" | "upper" | "effortLimit">;
  mode: Mode;
  /** Target in the mode's quantity. */
  target: number;
  position: number;
  velocity: number;
  /** Flags of `JointValues.flags`. */
  flags: number;
  /** Value of `AxisValues.blockedBy`. */
  blockedBy: string;
  /** Reason why its robot is disabled; empty if it is not. */
  disabledReason: string;
  world: "stopped" | "playing" | "paused";
}

export interface Hold {
  word: string;
  sentence: string;
}

const SATURATED = 1;
const AT_LOWER = 2;
const AT_UPPER = 4;

/** Tolerance of a target: rad or m; for velocities rad/s or m/s. */
const CLOSE = { angle: 0.01, length: 0.002 } as const;

/** Reasons from those of all joints to those of one; the first that applies is shown. */
const HOLDS: readonly ((situation: Situation) => Hold | undefined)[] = [
  ({ disabledReason }) => (disabledReason === "" ? undefined : { word: "disabled", sentence: `Its robot is disabled: ${disabledReason}. A reset brings it back` }),
  (situation) => (situation.world !== "playing" && misses(situation) ? { word: situation.world, sentence: `The world is ${situation.world}: the joint goes to its target once it plays` } : undefined),
  ({ axis, flags }) => {
    if (!(flags & (AT_LOWER | AT_UPPER))) return undefined;
    const isLower = (flags & AT_LOWER) !== 0;
    const limit = isLower ? axis.lower : axis.upper;
    return { word: "at limit", sentence: `It is at its ${isLower ? "lower" : "upper"} limit${limit === undefined ? "" : `, ${Number(limit.toPrecision(4))} ${axis.kind === "angle" ? "rad" : "m"}`}` };
  },
  ({ blockedBy }) => (blockedBy === "" ? undefined : { word: `blocked by ${blockedBy}`, sentence: `${blockedBy} blocks it: it touches a link that this joint moves` }),
  ({ axis, flags }) => {
    if (!(flags & SATURATED)) return undefined;
    const most = axis.effortLimit === undefined ? "" : ` of ${Number(axis.effortLimit.toPrecision(4))} ${axis.kind === "angle" ? "N m" : "N"}`;
    return { word: "saturated", sentence: `Its actuator is at its maximum effort${most}: the load or an obstacle is stronger` };
  },
];

/** Returns the reason why a joint misses its target; undefined if none is known. */
export function whatHolds(situation: Situation): Hold | undefined {
  for (const hold of HOLDS) {
    const found = hold(situation);
    if (found) return found;
  }
  return undefined;
}

function misses({ axis, mode, target, position, velocity }: Situation): boolean {
  if (mode === "position") return Math.abs(target - position) > CLOSE[axis.kind];
  return mode === "velocity" && Math.abs(target - velocity) > CLOSE[axis.kind];
}

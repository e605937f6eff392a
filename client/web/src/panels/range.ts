// The range of a slider, and the step of an arrow key.
import type { Axis } from "../state/world";
import type { Quantity, Unit } from "./quantity";

/** The ends of a slider, SI. */
export interface Range {
  lower: number;
  upper: number;
  /** Whether that end has no limit: the value may be beyond it. */
  openLower: boolean;
  openUpper: boolean;
}

/** Ranges of joints without limits: typical for desktop robots. */
const DEFAULTS = {
  angle: { position: Math.PI, velocity: 2 * Math.PI, effort: 10 },
  length: { position: 1, velocity: 1, effort: 50 },
} as const;

/** The range of a joint's slider: its limits, or a full turn (2 m) with open ends. */
export function rangeOf(axis: Axis, quantity: Quantity): Range {
  const sensible = DEFAULTS[axis.kind][quantity];
  if (quantity === "position") {
    const { lower, upper } = axis;
    if (lower !== undefined && upper !== undefined) {
      // Equal limits would be a slider without length.
      const width = upper > lower ? 0 : 1e-3;
      return { lower: lower - width, upper: upper + width, openLower: false, openUpper: false };
    }
    if (lower !== undefined) return { lower, upper: lower + 2 * sensible, openLower: false, openUpper: true };
    if (upper !== undefined) return { lower: upper - 2 * sensible, upper, openLower: true, openUpper: false };
    return { lower: -sensible, upper: sensible, openLower: true, openUpper: true };
  }
  const limit = quantity === "velocity" ? axis.velocityLimit : axis.effortLimit;
  if (limit !== undefined && limit > 0 && Number.isFinite(limit)) {
    return { lower: -limit, upper: limit, openLower: false, openUpper: false };
  }
  return { lower: -sensible, upper: sensible, openLower: true, openUpper: true };
}

/**
 * Returns a range with both ends open, shifted by whole widths to contain `value`: a continuous joint is shown on its
 * present turn. The range `before` stays as long as the value is in it.
 */
export function turned(range: Range, value: number, before: Range): Range {
  if (!range.openLower || !range.openUpper || !Number.isFinite(value)) return range;
  const width = range.upper - range.lower;
  const isTurn = before.openLower && before.openUpper && Math.abs(before.upper - before.lower - width) < 1e-6 * width;
  if (isTurn && value >= before.lower && value <= before.upper) return before;
  const middle = Math.round(value / width) * width;
  return { ...range, lower: middle - width / 2, upper: middle + width / 2 };
}

/** The position of a value on a slider: 0 at the lower end, 1 at the upper. */
export function fractionOf(value: number, range: Range): number {
  const fraction = (value - range.lower) / (range.upper - range.lower);
  return Number.isFinite(fraction) ? Math.min(1, Math.max(0, fraction)) : 0;
}

/** The step of an arrow key, SI: about 1/200 of the slider, a round number in the shown unit. */
export function nudgeOf(range: Range, unit: Unit): number {
  return niceStep((range.upper - range.lower) / unit.scale / 200) * unit.scale;
}

/** Returns the largest of ..., 1, 2, 5, 10, ... that is not larger than `about`. */
export function niceStep(about: number): number {
  if (!(about > 0) || !Number.isFinite(about)) return 0.01;
  const power = 10 ** Math.floor(Math.log10(about));
  const lead = about / power;
  return (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
}

// Formats and parses joint values with their units, for instance "90 deg".
import type { Axis, Mode } from "../state/world";
import { compute, Unreadable, type Computed } from "./expression";

/** A quantity of a joint. */
export type Quantity = "position" | "velocity" | "effort";

/** The kind of axis that a value belongs to. */
export type Kind = Axis["kind"];

const DEGREE = Math.PI / 180;
const RPM = (2 * Math.PI) / 60;

/** The SI value of each unit. */
const UNITS: Record<Kind, Record<Quantity, Record<string, number>>> = {
  angle: {
    position: { rad: 1, deg: DEGREE, "°": DEGREE, degree: DEGREE, degrees: DEGREE, mrad: 1e-3, turn: 2 * Math.PI },
    velocity: { "rad/s": 1, "deg/s": DEGREE, "°/s": DEGREE, rpm: RPM },
    effort: { "N m": 1, Nm: 1, "N*m": 1, "N·m": 1 },
  },
  length: {
    position: { m: 1, cm: 1e-2, mm: 1e-3, um: 1e-6, in: 0.0254 },
    velocity: { "m/s": 1, "cm/s": 1e-2, "mm/s": 1e-3 },
    effort: { N: 1, kN: 1e3 },
  },
};

/** A unit to show values in: `value / scale` is the number to write. */
export interface Unit {
  name: string;
  /** Size of the unit in SI units. */
  scale: number;
}

/** Returns the unit in which a value is shown. */
export function unitOf(kind: Kind, quantity: Quantity, degrees: boolean): Unit {
  if (kind === "length") return { name: { position: "m", velocity: "m/s", effort: "N" }[quantity], scale: 1 };
  if (quantity === "effort") return { name: "N m", scale: 1 };
  const name = degrees ? "deg" : "rad";
  return { name: quantity === "position" ? name : `${name}/s`, scale: degrees ? DEGREE : 1 };
}

/** Returns the quantity of the target in a mode; a joint without an actuator is shown by its position. */
export function quantityOf(mode: Mode): Quantity {
  return mode === "velocity" || mode === "effort" ? mode : "position";
}

/** A value with a fixed number of decimals; never "-0.000". */
export function digits(value: number, unit: Unit): string {
  const shown = value / unit.scale;
  if (!Number.isFinite(shown)) return "–";
  const places = unit.name.startsWith("deg") ? 2 : unit.name.startsWith("N") ? 2 : 3;
  const text = shown.toFixed(places);
  return Number(text) === 0 ? (0).toFixed(places) : text;
}

/** Three significant digits, zeros too, and no exponent: 4.90, 12.3, 1230. */
export function threeDigits(value: number): string {
  const rounded = Number(value.toPrecision(3));
  const places = rounded === 0 ? 2 : 2 - Math.floor(Math.log10(Math.abs(rounded)));
  return rounded.toFixed(Math.min(20, Math.max(0, places)));
}

/** At most three significant digits: 12.3, 0.123, 1230. */
export function shortened(value: number): string {
  return Number.isFinite(value) ? String(Number(value.toPrecision(3))) : "–";
}

/**
 * Reads typed text in SI: "90 deg", "0,2 rad", "5 cm", "pi/2 rad", "2*0.3", "90 deg - (0.1 + 0.2) rad". Without a unit it
 * is in `unit`, but "pi/2" is always radians. Returns a message if it cannot be read.
 */
export function parse(text: string, kind: Kind, quantity: Quantity, unit: Unit): number | string {
  const known = UNITS[kind][quantity];
  let read: Computed;
  try {
    read = compute(text.trim(), known);
  } catch (error) {
    if (error instanceof Unreadable) return whyNot(text, error, known);
    throw error;
  }
  const scale = read.hasUnit || (read.hasPi && kind === "angle") ? 1 : unit.scale;
  const value = read.value * scale;
  return Number.isFinite(value) ? value : `"${text}" is not a finite number`;
}

/** Returns a message about the unreadable part, which it quotes as typed. */
function whyNot(text: string, { kind, part }: Unreadable, known: Record<string, number>): string {
  if (kind === "mixed") return `"${text}" adds a number without a unit to one with a unit: write the unit at each`;
  if (kind === "syntax") return `"${text}" is not a number`;
  const wanted = Object.keys(known).filter((name) => /^[\w/ ]+$/.test(name));
  return `"${part}" in "${text}" does not fit here: this takes ${wanted.slice(0, 4).join(", ")}`;
}

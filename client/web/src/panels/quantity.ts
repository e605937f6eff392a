// Formats and parses joint values with their units, for instance "90 deg".
import type { Axis, Mode } from "../state/world";

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
  /** How many SI units it is. */
  scale: number;
}

/** The unit that a value is shown in. */
export function unitOf(kind: Kind, quantity: Quantity, degrees: boolean): Unit {
  if (kind === "length") return { name: { position: "m", velocity: "m/s", effort: "N" }[quantity], scale: 1 };
  if (quantity === "effort") return { name: "N m", scale: 1 };
  const name = degrees ? "deg" : "rad";
  return { name: quantity === "position" ? name : `${name}/s`, scale: degrees ? DEGREE : 1 };
}

/** The quantity of the target in a mode; a joint without an actuator is shown by its position. */
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

/** Three significant digits: 12.3, 0.123, 1230. */
export function shortened(value: number): string {
  return Number.isFinite(value) ? String(Number(value.toPrecision(3))) : "–";
}

/** A number or pi, after the first one with its operator, which may be left out before pi. */
const FACTOR = /^\s*([*/]?)\s*(?:((?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?)|(pi|π))/i;

/** The value of a product like "2*pi/3" at the start of a text, with the rest; undefined if there is none. */
function product(text: string): { value: number; hasPi: boolean; rest: string } | undefined {
  const sign = /^[+-]?/.exec(text)?.[0] ?? "";
  let rest = text.slice(sign.length);
  let value = sign === "-" ? -1 : 1;
  let hasPi = false;
  for (let count = 0; ; count += 1) {
    const [whole, operator, number, pi] = FACTOR.exec(rest) ?? [];
    // The first factor has no operator; another number has one.
    const fits = count === 0 ? operator === "" : operator !== "" || pi !== undefined;
    if (whole === undefined || !fits) return count === 0 ? undefined : { value, hasPi, rest: rest.trim() };
    const factor = pi === undefined ? Number(number?.replace(",", ".")) : Math.PI;
    value = operator === "/" ? value / factor : value * factor;
    hasPi ||= pi !== undefined;
    rest = rest.slice(whole.length);
  }
}

/**
 * Reads what was typed, in SI: "90 deg", "0,2 rad", "5 cm", "pi/2 rad", "2*0.3". Without a unit it is in `unit`, but
 * "pi/2" is radians whatever is shown. Returns a message if it cannot be read.
 */
export function parse(text: string, kind: Kind, quantity: Quantity, unit: Unit): number | string {
  const typed = text.trim().replace("−", "-");
  const read = product(typed);
  // What follows a number is a unit, which begins with a letter or the sign for degrees.
  if (!read || /^[^\p{L}°]/u.test(read.rest)) return `"${text}" is not a number`;
  const { value: number, hasPi, rest } = read;
  const known = UNITS[kind][quantity];
  const scale = rest === "" ? (hasPi && kind === "angle" ? 1 : unit.scale) : known[rest] ?? findUnit(known, rest);
  if (scale === undefined) {
    const wanted = Object.keys(known).filter((name) => /^[\w/ ]+$/.test(name));
    return `"${rest}" in "${text}" does not fit here: this takes ${wanted.slice(0, 4).join(", ")}`;
  }
  const value = number * scale;
  return Number.isFinite(value) ? value : `"${text}" is not a finite number`;
}

/** A unit, ignoring case and blanks. */
function findUnit(known: Record<string, number>, typed: string): number | undefined {
  const plain = (name: string): string => name.toLowerCase().replaceAll(" ", "");
  const wanted = plain(typed);
  return Object.entries(known).find(([name]) => plain(name) === wanted)?.[1];
}

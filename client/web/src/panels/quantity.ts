// Joint values as people read and type them: units, digits, "90 deg".
import type { Axis, Mode } from "../state/world";

/** What a number says about a joint. */
export type Quantity = "position" | "velocity" | "effort";

/** The kind of axis that a value belongs to. */
export type Kind = Axis["kind"];

const DEGREE = Math.PI / 180;
const RPM = (2 * Math.PI) / 60;

/** How many SI units one of each is. */
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

/** What a mode's target is; a joint without an actuator is looked at by its position. */
export function quantityOf(mode: Mode): Quantity {
  return mode === "velocity" || mode === "effort" ? mode : "position";
}

/** A value with as many digits as are worth reading; never "-0.000". */
export function digits(value: number, unit: Unit): string {
  const shown = value / unit.scale;
  if (!Number.isFinite(shown)) return "–";
  const places = unit.name.startsWith("deg") ? 2 : unit.name.startsWith("N") ? 2 : 3;
  const text = shown.toFixed(places);
  return Number(text) === 0 ? (0).toFixed(places) : text;
}

/** Three digits that count: 12.3, 0.123, 1230. */
export function shortened(value: number): string {
  return Number.isFinite(value) ? String(Number(value.toPrecision(3))) : "–";
}

const NUMBER = /^([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?)?\s*\*?\s*(pi|π)?\s*(?:\/\s*(\d+(?:\.\d+)?))?/i;

/**
 * Reads what was typed, in SI: "90 deg", "0,2 rad", "5 cm", "pi/2 rad". Without a unit it is in `unit`, but
 * "pi/2" is radians whatever is shown. A sentence where it cannot be read.
 */
export function parse(text: string, kind: Kind, quantity: Quantity, unit: Unit): number | string {
  const typed = text.trim().replace("−", "-");
  const signed = /^([+-])\s*(?=pi|π)/i.exec(typed);
  const match = NUMBER.exec(signed ? typed.slice(signed[0].length) : typed);
  const [whole, factor, pi, divisor] = match ?? [];
  if (!whole || (factor === undefined && pi === undefined)) return `"${text}" is not a number`;
  const rest = typed.slice(whole.length + (signed ? signed[0].length : 0)).trim();
  let number = factor === undefined ? 1 : Number(factor.replace(",", "."));
  if (pi !== undefined) number *= Math.PI;
  if (divisor !== undefined) number /= Number(divisor);
  if (signed?.[1] === "-") number = -number;
  const known = UNITS[kind][quantity];
  const scale = rest === "" ? (pi !== undefined && kind === "angle" ? 1 : unit.scale) : known[rest] ?? byLetters(known, rest);
  if (scale === undefined) {
    const wanted = Object.keys(known).filter((name) => /^[\w/ ]+$/.test(name));
    return `"${rest}" does not fit here: this takes ${wanted.slice(0, 4).join(", ")}`;
  }
  const value = number * scale;
  return Number.isFinite(value) ? value : `"${text}" is not a finite number`;
}

/** A unit whatever its capitals and blanks. */
function byLetters(known: Record<string, number>, typed: string): number | undefined {
  const plain = (name: string): string => name.toLowerCase().replaceAll(" ", "");
  const wanted = plain(typed);
  return Object.entries(known).find(([name]) => plain(name) === wanted)?.[1];
}

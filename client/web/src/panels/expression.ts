// Computes expressions in number boxes: + - * /, parentheses, pi, and units after products.

/** A computed value. */
export interface Computed {
  /** In SI if `hasUnit`, else as typed. */
  value: number;
  hasUnit: boolean;
  /** Whether it is a multiple of pi, and so an angle in radians even without a unit. */
  hasPi: boolean;
}

/** Reason why a text cannot be computed. */
export class Unreadable extends Error {
  /** `kind`: a word in place of a unit, numbers with and without a unit in one sum, or anything else. */
  constructor(
    readonly kind: "unit" | "mixed" | "syntax",
    /** The part of the text that is wrong, as it was typed. */
    readonly part: string,
  ) {
    super(part);
  }
}

/** Maximum number of characters, and of nested parentheses. */
const MAX_LENGTH = 200;
const MAX_DEPTH = 32;

const NUMBER = /^(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?/i;
const PI = /^(?:pi(?![a-z])|π)/i;

/**
 * Returns the value of a whole text, for instance "2*0.3", "(pi - 1)/2", "90 deg + 0.1 rad". `units` has the SI value
 * of each unit. A unit applies to the product before it: "1/4 turn" is a quarter of a turn. Throws `Unreadable`.
 */
export function compute(text: string, units: Readonly<Record<string, number>> = {}): Computed {
  if (text.length > MAX_LENGTH) throw new Unreadable("syntax", `${text.slice(0, 20)}…`);
  const reader = new Reader(text.replaceAll("−", "-"), text, units);
  const computed = reader.sum(0);
  reader.end();
  return computed;
}

/** Reads a text from left to right. */
class Reader {
  private at = 0;
  /** Longest first, so that "mm" is not read as "m". */
  private readonly units: readonly { value: number; pattern: RegExp }[];

  constructor(
    /** With one sign for minus. */
    private readonly text: string,
    private readonly typed: string,
    units: Readonly<Record<string, number>>,
  ) {
    this.units = Object.entries(units)
      .sort(([a], [b]) => b.length - a.length)
      .map(([name, value]) => ({ value, pattern: patternOf(name) }));
  }

  /** Products with + and - between them. */
  sum(depth: number): Computed {
    let all = this.product(depth);
    for (;;) {
      const operator = this.take(/^[+-]/);
      if (operator === undefined) return all;
      const next = this.product(depth);
      // A multiple of pi is in radians, which are SI.
      const fits = all.hasUnit === next.hasUnit || (all.hasUnit ? next.hasPi : all.hasPi);
      if (!fits) throw new Unreadable("mixed", this.typed);
      all = {
        value: operator === "+" ? all.value + next.value : all.value - next.value,
        hasUnit: all.hasUnit || next.hasUnit,
        hasPi: all.hasPi || next.hasPi,
      };
    }
  }

  /** Factors with * and / between them, which may be left out before pi and parentheses, and units. */
  private product(depth: number): Computed {
    const negative = this.take(/^[+-]/) === "-";
    let all = this.factor(depth);
    for (;;) {
      const unit = this.unit();
      if (unit !== undefined) {
        if (all.hasUnit) throw new Unreadable("syntax", this.typed);
        all = { ...all, value: all.value * unit, hasUnit: true };
        continue;
      }
      const operator = this.take(/^[*/]/);
      if (operator === undefined && !this.beginsFactor()) break;
      const inverted = operator !== undefined && this.take(/^[+-]/) === "-";
      const next = this.factor(depth);
      if (next.hasUnit && (all.hasUnit || operator === "/")) throw new Unreadable("syntax", this.typed);
      const value = operator === "/" ? all.value / next.value : all.value * next.value;
      all = { value: inverted ? -value : value, hasUnit: all.hasUnit || next.hasUnit, hasPi: all.hasPi || next.hasPi };
    }
    return negative ? { ...all, value: -all.value } : all;
  }

  /** A number, pi, or a sum in parentheses. */
  private factor(depth: number): Computed {
    if (this.take(/^\(/) !== undefined) {
      if (depth >= MAX_DEPTH) throw new Unreadable("syntax", this.typed);
      const inner = this.sum(depth + 1);
      if (this.take(/^\)/) === undefined) throw new Unreadable("syntax", this.typed);
      return inner;
    }
    if (this.take(PI) !== undefined) return { value: Math.PI, hasUnit: false, hasPi: true };
    const number = this.take(NUMBER);
    if (number === undefined) throw new Unreadable("syntax", this.typed);
    return { value: Number(number.replace(",", ".")), hasUnit: false, hasPi: false };
  }

  /** Throws if text remains: a word is then an unknown unit. */
  end(): void {
    this.blanks();
    const rest = this.text.slice(this.at);
    if (rest === "") return;
    const word = /^[\p{L}°][^+\-()]*/u.exec(rest)?.[0].trim();
    if (word !== undefined) throw new Unreadable("unit", word);
    throw new Unreadable("syntax", this.typed);
  }

  private beginsFactor(): boolean {
    this.blanks();
    const rest = this.text.slice(this.at);
    return rest.startsWith("(") || PI.test(rest);
  }

  /** Returns the SI value of the next unit. */
  private unit(): number | undefined {
    for (const { value, pattern } of this.units) {
      if (this.take(pattern) !== undefined) return value;
    }
    return undefined;
  }

  private take(pattern: RegExp): string | undefined {
    this.blanks();
    const found = pattern.exec(this.text.slice(this.at))?.[0];
    if (found !== undefined) this.at += found.length;
    return found;
  }

  private blanks(): void {
    while (/^\s/.test(this.text.charAt(this.at))) this.at += 1;
  }
}

/** Returns a unit at the start of a text, in any case and with blanks, unless a letter follows it. */
function patternOf(name: string): RegExp {
  const letters = [...name.replaceAll(" ", "")].map((letter) => letter.replace(/[.*+?^${}()|[\]\\/]/g, "\\$&"));
  return new RegExp(`^${letters.join("\\s*")}(?![\\p{L}°])`, "iu");
}

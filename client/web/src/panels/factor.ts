// Real-time factors as people read and type them.

/** What the daemon takes. */
const LEAST = 0.001;
const MOST = 1000;

/** "1.00x"; "max" for as fast as possible. */
export function shownFactor(factor: number): string {
  if (factor === Infinity) return "max";
  return `${factor >= 100 ? factor.toFixed(0) : factor >= 10 ? factor.toFixed(1) : factor.toFixed(2)}x`;
}

/** Reads "0.25", "0,25x", "max"; a sentence where it cannot be read. */
export function readFactor(text: string): number | string {
  const typed = text.trim().toLowerCase().replace(/([\d.,])\s*x$/, "$1").replace(",", ".");
  if (typed === "max") return Infinity;
  const factor = Number(typed);
  if (typed === "" || Number.isNaN(factor)) return `"${text}" is not a speed: type a number like 0.25, or max.`;
  if (factor < LEAST || factor > MOST) return `A speed of ${text} is out of range: it is ${LEAST} to ${MOST} times real time, or max.`;
  return factor;
}

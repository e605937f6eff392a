// Formats and parses real-time factors.

/** The range that the daemon accepts. */
const MIN_FACTOR = 0.001;
const MAX_FACTOR = 1000;

/** "1.00x"; "max" for as fast as possible. */
export function shownFactor(factor: number): string {
  if (factor === Infinity) return "max";
  return `${factor >= 100 ? factor.toFixed(0) : factor >= 10 ? factor.toFixed(1) : factor.toFixed(2)}x`;
}

/** Parses "0.25", "0,25x", "max". Returns a message if the text is none of these. */
export function readFactor(text: string): number | string {
  const typed = text.trim().toLowerCase().replace(/([\d.,])\s*x$/, "$1").replace(",", ".");
  if (typed === "max") return Infinity;
  const factor = Number(typed);
  if (typed === "" || Number.isNaN(factor)) return `"${text}" is not a speed: type a number like 0.25, or max.`;
  if (factor < MIN_FACTOR || factor > MAX_FACTOR) return `A speed of ${text} is out of range: it is ${MIN_FACTOR} to ${MAX_FACTOR} times real time, or max.`;
  return factor;
}

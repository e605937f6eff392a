// How long to wait before a lost daemon is tried again.

const FIRST = 250;
const LONGEST = 5000;

/** Milliseconds after so many failures in a row, from 1: doubling, up to five seconds. */
export function retryDelay(failures: number): number {
  return Math.min(LONGEST, FIRST * 2 ** Math.max(0, failures - 1));
}

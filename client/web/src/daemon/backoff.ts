// The delay before the next attempt to reconnect.

const FIRST = 250;
const LONGEST = 5000;

/** Milliseconds after this many failures in a row, from 1: doubles each time, up to five seconds. */
export function retryDelay(failures: number): number {
  return Math.min(LONGEST, FIRST * 2 ** Math.max(0, failures - 1));
}

// Counts the calls of this page, for measurements.
let requests = 0;

export function countRequest(): void {
  requests += 1;
}

/** Calls since the page was loaded. */
export function requestCount(): number {
  return requests;
}

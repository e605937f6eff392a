// Counts the calls that this page makes, for those who want to know what a tab costs.
let requests = 0;

export function countRequest(): void {
  requests += 1;
}

/** Calls since the page was loaded. */
export function requestCount(): number {
  return requests;
}

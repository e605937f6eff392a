// Secrets of this tab's claims, kept over a reload, and the choice of the one that a call carries.

/** Key of the world in place of a robot's name. */
export const WORLD = "";

const KEY = "simd.claims";

let held: Map<string, string> | undefined;

/** By the robot's name. */
export function heldClaims(): ReadonlyMap<string, string> {
  held ??= read();
  return held;
}

/** Keeps the secret of a claim, or forgets it. */
export function keepClaims(what: string, secret: string | undefined): void {
  const next = new Map(heldClaims());
  if (secret === undefined) next.delete(what);
  else next.set(what, secret);
  held = next;
  try {
    sessionStorage.setItem(KEY, JSON.stringify([...next]));
  } catch {
    // Without storage it is released when its time is over.
  }
}

function read(): Map<string, string> {
  try {
    const kept: unknown = JSON.parse(sessionStorage.getItem(KEY) ?? "[]");
    const isPair = (pair: unknown): pair is [string, string] => Array.isArray(pair) && pair.length === 2 && pair.every((part) => typeof part === "string");
    return new Map(Array.isArray(kept) ? kept.filter(isPair) : []);
  } catch {
    return new Map();
  }
}

/**
 * Returns the claim that a request is sent with: the claim of its robot, else the claim of the world, else the only
 * claim held.
 */
export function claimFor(request: object): string {
  const claims = heldClaims();
  if (claims.size === 0) return "";
  for (const robot of robotsOf(request)) {
    const own = claims.get(robot);
    if (own !== undefined) return own;
  }
  return claims.get(WORLD) ?? [...claims.values()][0] ?? "";
}

function robotsOf(request: object): string[] {
  const { robot, robots } = request as { robot?: unknown; robots?: unknown };
  const named = Array.isArray(robots) ? robots.map((each: unknown) => (typeof each === "object" && each !== null ? (each as { robot?: unknown }).robot : each)) : [];
  return [robot, ...named].filter((name): name is string => typeof name === "string" && name !== "");
}

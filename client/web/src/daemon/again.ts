// Robots that this page has loaded, and loads again after a restart of the daemon.
import { restarted } from "../state/restart";

/** Maximum number of remembered robots, the newest. */
const MAX = 100;

/** Requests to load robots again, by name. */
const loads = new Map<string, () => Promise<unknown>>();

/** Remembers how a robot was loaded. */
export function remember(robot: string, again: () => Promise<unknown>): void {
  loads.delete(robot);
  loads.set(robot, again);
  for (const oldest of [...loads.keys()].slice(0, -MAX)) loads.delete(oldest);
}

/** Offers the robots that the daemon lost by its restart, if this page can load them again. */
export function offerAgain(before: readonly string[], now: readonly string[], at = new Date()): void {
  const robots = before.filter((robot) => loads.has(robot) && !now.includes(robot));
  restarted.value = robots.length > 0 ? { at, robots } : null;
}

/** Loads the offered robots, one after the other. Messages report errors of each. */
export async function loadAgain(): Promise<void> {
  const robots = restarted.peek()?.robots ?? [];
  restarted.value = null;
  for (const robot of robots) await loads.get(robot)?.();
}

// Robots that this page has loaded, and loads again after a restart of the daemon.
import { restarted } from "../state/restart";

/** Robots that are remembered, the newest. */
const MOST = 100;

/** How a robot is brought in again, by its name. */
const loads = new Map<string, () => Promise<unknown>>();

/** Remembers how a robot was brought in. */
export function remember(robot: string, again: () => Promise<unknown>): void {
  loads.delete(robot);
  loads.set(robot, again);
  for (const oldest of [...loads.keys()].slice(0, -MOST)) loads.delete(oldest);
}

/** Offers the robots that the daemon had before its restart and has no more, as far as this page can bring them in. */
export function offerAgain(before: readonly string[], now: readonly string[], at = new Date()): void {
  const robots = before.filter((robot) => loads.has(robot) && !now.includes(robot));
  restarted.value = robots.length > 0 ? { at, robots } : null;
}

/** Brings in the robots that are offered, one after the other. Each says itself what goes wrong. */
export async function loadAgain(): Promise<void> {
  const robots = restarted.peek()?.robots ?? [];
  restarted.value = null;
  for (const robot of robots) await loads.get(robot)?.();
}

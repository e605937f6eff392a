// Position of a spawned robot: beside the others, since contact forces separate robots that overlap. The daemon is asked when the
// position is needed: the page's picture is older than its last change.
import { services } from "../daemon/services";
import { MAX_DEPTH } from "../state/report";

/** Metres between other robots and the origin of the new one, whose size is not known yet. */
const DISTANCE = 1;
/** Metres between other robots and the nearest part of the new one. */
const GAP = 0.2;
/** Extent from which an object counts as ground, because a robot cannot be placed beside it: metres along x and along y. */
const WIDE = 10;

/** Extent of a robot along y, and the height of its lowest collision shape: metres. */
export interface Reach {
  lower: number;
  upper: number;
  bottom: number;
}

/** Returns the origin of an empty world, else a position to the left of all robots, along y: world_from_root, metres. */
export async function freePlace(): Promise<{ x: number; y: number; z: number }> {
  return { x: 0, y: nextPlace(await reaches()), z: 0 };
}

/** Returns the distances that a new robot must move to stand beside all others, along y, and on the ground, along z. */
export async function wayOut(robot: string): Promise<{ aside: number; up: number }> {
  const all = await reaches();
  return { aside: shiftOf(robot, all), up: liftOf(robot, all) };
}

/** Returns the next origin along y. */
export function nextPlace(all: ReadonlyMap<string, Reach>): number {
  const left = Math.max(...[...all.values()].map(({ upper }) => upper));
  return Number.isFinite(left) ? left + DISTANCE : 0;
}

/** Returns the distance along y that a robot must move to have a gap to all others. */
export function shiftOf(robot: string, all: ReadonlyMap<string, Reach>): number {
  const own = all.get(robot);
  const left = Math.max(...[...all].filter(([name]) => name !== robot).map(([, { upper }]) => upper));
  return own && Number.isFinite(left) ? Math.max(0, left + GAP - own.lower) : 0;
}

/** Returns the distance along z that a robot must move for its collision shapes to be above z = 0. */
export function liftOf(robot: string, all: ReadonlyMap<string, Reach>): number {
  const { bottom = 0 } = all.get(robot) ?? {};
  return bottom < -MAX_DEPTH ? -bottom : 0;
}

/** Returns the extent of each robot that is not ground, by its collision shapes and the origins of its links. */
async function reaches(): Promise<Map<string, Reach>> {
  const { contacts, entities } = services();
  const [{ links }, { robots }] = await Promise.all([contacts.getLinkBounds({}), entities.getLinkPoses({})]);
  const ground = new Set(links.filter(({ lower, upper }) => lower && upper && upper.x - lower.x > WIDE && upper.y - lower.y > WIDE).map(({ robot }) => robot));
  // Planes have no bounds, nor do robots without collision shapes.
  const bounded = new Set(links.map(({ robot }) => robot));
  const unbounded = robots.map(({ robot }) => robot).filter((robot) => !bounded.has(robot));
  const { robots: scenes } = unbounded.length === 0 ? { robots: [] } : await entities.getScene({ robots: unbounded });
  for (const { robot, collisions } of scenes) if (collisions.some(({ geometry }) => geometry.case === "plane")) ground.add(robot);
  const found = new Map<string, Reach>();
  const widen = (robot: string, lower: number, upper: number, bottom = Infinity): void => {
    if (ground.has(robot)) return;
    const known = found.get(robot) ?? { lower: Infinity, upper: -Infinity, bottom: Infinity };
    found.set(robot, { lower: Math.min(known.lower, lower), upper: Math.max(known.upper, upper), bottom: Math.min(known.bottom, bottom) });
  };
  for (const { robot, lower, upper } of links) if (lower && upper) widen(robot, lower.y, upper.y, lower.z);
  for (const { robot, poses } of robots) for (let at = 1; at < poses.length; at += 7) widen(robot, poses[at] ?? 0, poses[at] ?? 0);
  return found;
}

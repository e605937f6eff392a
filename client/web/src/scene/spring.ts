// Strength of the pull on a dragged link, by the mass that moves along. The daemon computes the spring in each step.
import type { RobotScene } from "../state/scene";
import type { Mode } from "../state/world";

/** Stiffness per mass, 1/s^2: one metre accelerates with about six times gravity. */
const STIFFNESS = 60;
/** Upper bound of force per mass, m/s^2. */
const MAX_ACCELERATION = 60;
/**
 * Joints that hold make one body of the links that they connect, but only up to their effort limits. A pull carries at most this many times the
 * carried mass.
 */
const MAX_MASS_RATIO = 4;

/** Minimum and maximum time of a pull that is not renewed, wall seconds. */
const MIN = 0.5;
const MAX = 5;
/** Simulated seconds that the daemon allows for a pull. */
const DAEMON_MOST = 60;

/**
 * Returns the duration of a pull, simulated seconds. The page sends a pull each `interval` milliseconds; the world runs `factor` simulated seconds
 * a second. A pull lasts as long as three intervals, so that slow pages do not let go.
 */
export function pullDuration(interval: number, factor: number): number {
  return Math.min(DAEMON_MOST, Math.min(MAX, Math.max(MIN, (3 * interval) / 1000)) * Math.max(1, factor));
}

/** A spring with a limit. */
export interface Spring {
  /** N/m. */
  stiffness: number;
  /** N. */
  limit: number;
}

/** `modeOf` returns the mode of the joint that moves a link; undefined for joints that cannot move. */
export function springFor(scene: RobotScene, link: number, modeOf: (link: string) => Mode | undefined): Spring {
  const carried = massBelow(scene, link);
  const pulled = Math.min(MAX_MASS_RATIO * carried, massBelow(scene, firstCompliant(scene, link, modeOf)));
  return { stiffness: STIFFNESS * pulled, limit: MAX_ACCELERATION * pulled };
}

/** Returns the link at the first joint towards the root that is not held. */
function firstCompliant(scene: RobotScene, link: number, modeOf: (link: string) => Mode | undefined): number {
  let at = link;
  for (;;) {
    const here = scene.links[at];
    if (!here || here.parent < 0) return at;
    const mode = modeOf(here.name);
    if (mode === "passive" || mode === "effort") return at;
    at = here.parent;
  }
}

/** Returns the mass of a link and its descendants, kilograms. */
function massBelow(scene: RobotScene, link: number): number {
  const carried = new Set([link]);
  let mass = 0;
  // Parents come before their children.
  scene.links.forEach((each, index) => {
    if (carried.has(each.parent)) carried.add(index);
    if (carried.has(index)) mass += each.mass;
  });
  return mass;
}

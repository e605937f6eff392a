// The spring and damper that pull a dragged link to the pointer, scaled by the mass that is moved and limited by the
// delay of the page.
import type { RobotScene, Vector } from "../state/scene";
import type { Mode } from "../state/world";

/** Upper bound of stiffness per mass, 1/s^2: one metre accelerates with about six times gravity. */
const STIFFNESS = 60;
/** Upper bound of damping per mass, 1/s. */
const DAMPING = 5;
/** Upper bound of force per mass, m/s^2. */
const MAX_ACCELERATION = 60;
/**
 * A force with a delay T is stable on a single mass m while d T / m < pi / 2 and k T < d: the delay reduces the damping by
 * k T. The effective mass at the end of a rod is a quarter of its mass, which leaves a margin of a third for the former.
 */
const DAMPING_DELAY = 0.25;
const STIFFNESS_DELAY = 0.4;
/** Joints that hold make one body of what they connect, but only up to their effort limits: at most this many times the carried mass is pulled. */
const MAX_MASS_RATIO = 4;

/** A spring and damper with a limit. */
export interface Spring {
  /** N/m. */
  stiffness: number;
  /** N s/m. */
  damping: number;
  /** N. */
  limit: number;
}

/**
 * `modeOf` returns the mode of the joint that moves a link; undefined for joints that cannot move. `delay` is the time
 * from a state to the end of the force for it, in simulated seconds.
 */
export function springFor(scene: RobotScene, link: number, modeOf: (link: string) => Mode | undefined, delay: number): Spring {
  const carried = massBelow(scene, link);
  const pulled = Math.min(MAX_MASS_RATIO * carried, massBelow(scene, firstCompliant(scene, link, modeOf)));
  const damping = Math.min(DAMPING, DAMPING_DELAY / delay);
  const stiffness = Math.min(STIFFNESS, (STIFFNESS_DELAY * damping) / delay);
  return { stiffness: stiffness * pulled, damping: damping * carried, limit: MAX_ACCELERATION * pulled };
}

/** The link at the first joint towards the root that is not held. */
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

/** The mass of a link and its descendants, kilograms. */
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

/** The force in newtons, in the axes of the arguments: metres, and metres per second. */
export function springForce(spring: Spring, point: Vector, velocity: Vector, target: Vector): [number, number, number] {
  const force = [0, 1, 2].map((i) => spring.stiffness * ((target[i] ?? 0) - (point[i] ?? 0)) - spring.damping * (velocity[i] ?? 0));
  const [x = 0, y = 0, z = 0] = force;
  const strength = Math.hypot(x, y, z);
  const share = strength > spring.limit ? spring.limit / strength : 1;
  return [share * x, share * y, share * z];
}

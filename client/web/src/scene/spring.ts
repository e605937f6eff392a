// The law by which a dragged link follows the pointer: a spring and a damper, as strong as what hangs on it is heavy
// and as the page is quick.
import type { RobotScene, Vector } from "../state/scene";
import type { Mode } from "../state/world";

/** Per second squared, at the most: one metre pulls with this acceleration, about six times that of gravity. */
const STIFFNESS = 60;
/** Per second, at the most. */
const DAMPING = 5;
/** Metres per second squared, of the mass that is pulled. */
const MOST = 60;
/**
 * A force that follows the state by a delay T is stable on a mass m alone while d T / m < pi / 2 and k T < d: the delay takes
 * k T from the damper. The end of a rod moves as a quarter of its mass, which leaves the first a third of room.
 */
const DAMPING_DELAY = 0.25;
const STIFFNESS_DELAY = 0.4;
/** Held joints make one body of what they connect, but give way at their limits: no more than so many times what is carried is pulled. */
const HELD = 4;

/** What a link is pulled with. */
export interface Spring {
  /** N/m. */
  stiffness: number;
  /** N s/m. */
  damping: number;
  /** N. */
  limit: number;
}

/**
 * `modeOf` says what the joint does that moves a link; nothing for joints that cannot move. `delay` is how many
 * simulated seconds pass between a state and the end of the force that answers it.
 */
export function springFor(scene: RobotScene, link: number, modeOf: (link: string) => Mode | undefined, delay: number): Spring {
  const carried = massBelow(scene, link);
  const pulled = Math.min(HELD * carried, massBelow(scene, firstFree(scene, link, modeOf)));
  const damping = Math.min(DAMPING, DAMPING_DELAY / delay);
  const stiffness = Math.min(STIFFNESS, (STIFFNESS_DELAY * damping) / delay);
  return { stiffness: stiffness * pulled, damping: damping * carried, limit: MOST * pulled };
}

/** Up to the first joint that gives way, all of it is pulled. */
function firstFree(scene: RobotScene, link: number, modeOf: (link: string) => Mode | undefined): number {
  let at = link;
  for (;;) {
    const here = scene.links[at];
    if (!here || here.parent < 0) return at;
    const mode = modeOf(here.name);
    if (mode === "passive" || mode === "effort") return at;
    at = here.parent;
  }
}

/** Kilograms of a link and all that it carries. */
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

/** Newtons, in the axes of the points: metres, and metres per second. */
export function pull(spring: Spring, point: Vector, velocity: Vector, target: Vector): [number, number, number] {
  const force = [0, 1, 2].map((i) => spring.stiffness * ((target[i] ?? 0) - (point[i] ?? 0)) - spring.damping * (velocity[i] ?? 0));
  const [x = 0, y = 0, z = 0] = force;
  const strength = Math.hypot(x, y, z);
  const share = strength > spring.limit ? spring.limit / strength : 1;
  return [share * x, share * y, share * z];
}

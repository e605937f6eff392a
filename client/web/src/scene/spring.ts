// The law by which a dragged link follows the pointer: a spring and a damper, as strong as what hangs on it is heavy.
import type { RobotScene, Vector } from "../state/scene";
import type { Mode } from "../state/world";

/** Per second squared: one metre pulls with this acceleration, about four times that of gravity. */
const STIFFNESS = 40;
/**
 * Per second. The force is that of a state some 40 ms ago and lasts until the next, so that a damper is
 * stable where its rate times that delay is less than the share of the mass that a point of a
 * link has: a quarter for the end of a rod.
 */
const DAMPING = 5;
/** Metres per second squared, of all the mass that moves along. */
const MOST = 60;

/** What a link is pulled with. */
export interface Spring {
  /** N/m. */
  stiffness: number;
  /** N s/m. */
  damping: number;
  /** N. */
  limit: number;
}

/** `modeOf` says what the joint does that moves a link; nothing for joints that cannot move. */
export function springFor(scene: RobotScene, link: number, modeOf: (link: string) => Mode | undefined): Spring {
  const carried = massBelow(scene, link);
  const moved = massBelow(scene, firstFree(scene, link, modeOf));
  return { stiffness: STIFFNESS * moved, damping: DAMPING * carried, limit: MOST * moved };
}

/** Held joints make one body of what they connect: up to the first that gives way, all of it is pulled. */
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

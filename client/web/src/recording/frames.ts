// World poses of links, from transforms of links in their parents.
import type { Transform } from "./cdr";

/** The frame that robots are in. */
const WORLD = "world";
/**
 * Maximum number of links between a link and the world: more than any robot has, and an end for cyclic
 * transforms.
 */
const MAX_DEPTH = 10_000;

/** world_from_link by link, by robot: x y z, then the quaternion x y z w. */
export type RobotPoses = Map<string, Map<string, Float64Array>>;

/**
 * Returns the world poses of all links that have a known path of transforms. If a link has two transforms,
 * the last counts.
 */
export function worldPoses(...lists: readonly (readonly Transform[])[]): RobotPoses {
  const parents = new Map<string, Transform>();
  for (const list of lists) for (const transform of list) parents.set(transform.child, transform);
  const known = new Map<string, Float64Array | null>();
  const resolve = (frame: string): Float64Array | null => {
    // The search runs from the link towards the world, and back: recursion would be as deep as a rope is
    // long.
    const way: Transform[] = [];
    let at = frame;
    let base: Float64Array | null = null;
    for (;;) {
      if (at === WORLD) break;
      const there = known.get(at);
      if (there !== undefined) {
        if (there === null) return null;
        base = there;
        break;
      }
      const transform = parents.get(at);
      if (!transform || way.length > MAX_DEPTH) {
        for (const { child } of way) known.set(child, null);
        return null;
      }
      way.push(transform);
      at = transform.parent;
    }
    for (const transform of way.reverse()) {
      base = base ? compose(base, transform.pose) : transform.pose;
      known.set(transform.child, base);
    }
    return base;
  };
  const robots: RobotPoses = new Map();
  for (const child of parents.keys()) {
    const pose = resolve(child);
    const slash = child.indexOf("/");
    if (!pose || slash < 0) continue;
    const robot = child.slice(0, slash);
    let links = robots.get(robot);
    if (!links) {
      links = new Map();
      robots.set(robot, links);
    }
    links.set(child.slice(slash + 1), pose);
  }
  return robots;
}

/** Returns a_from_c from a_from_b and b_from_c. */
function compose(a: Float64Array, b: Float64Array): Float64Array {
  const [ax = 0, ay = 0, az = 0, x = 0, y = 0, z = 0, w = 1] = a;
  const [bx = 0, by = 0, bz = 0, i = 0, j = 0, k = 0, r = 1] = b;
  // v + 2 q x (q x v + w v)
  const [u, v, t] = [y * bz - z * by + w * bx, z * bx - x * bz + w * by, x * by - y * bx + w * bz];
  return Float64Array.of(
    ax + bx + 2 * (y * t - z * v),
    ay + by + 2 * (z * u - x * t),
    az + bz + 2 * (x * v - y * u),
    w * i + x * r + y * k - z * j,
    w * j - x * k + y * r + z * i,
    w * k + x * j - y * i + z * r,
    w * r - x * i - y * j - z * k,
  );
}

// Ground and scenery of the world: large things that cannot move, and do not decide the first view.
import { Box3, Sphere, Vector3 } from "three";
import type { RobotScene } from "../state/scene";

/** Minimum length and width of ground, metres. */
const WIDE = 10;
/** Maximum height of flat ground, as a share of its width. */
const FLAT = 0.01;
/**
 * Maximum size of fixed things in the first view: this radius in metres, or this many times the radius of the moving things.
 */
const SMALL = 3;
const RELATIVE = 4;

/** Whether no link of a robot can move at all. */
export function isFixed({ links }: RobotScene): boolean {
  return links.every(({ movable }) => !movable);
}

/** Whether it consists of planes, or is one flat and wide thing that cannot move: it is drawn as ground. */
export function isFlatGround(scene: RobotScene, box: Box3): boolean {
  if (!isFixed(scene)) return false;
  if (box.isEmpty()) return hasPlane(scene);
  const { x, y, z } = box.getSize(new Vector3());
  return Math.min(x, y) >= WIDE && z <= FLAT * Math.min(x, y);
}

/** Whether robots can stand on it: a plane, or something wide with collision shapes that cannot move. */
export function isGround(scene: RobotScene, box: Box3): boolean {
  if (!isFixed(scene) || scene.colliders.length + scene.collisions.length === 0) return false;
  if (hasPlane(scene)) return true;
  const { x, y } = box.getSize(new Vector3());
  return !box.isEmpty() && Math.min(x, y) >= WIDE;
}

function hasPlane({ visuals, collisions }: RobotScene): boolean {
  return [...visuals, ...collisions].some(({ geometry }) => geometry.kind === "plane");
}

/**
 * Returns the bounds of the first view: all that moves, and fixed things that are not much larger. Empty if nothing
 * qualifies.
 */
export function framed(things: Iterable<{ scene: RobotScene; box: Box3 }>): Box3 {
  const all = new Box3();
  const scenery: Box3[] = [];
  for (const { scene, box } of things) {
    if (box.isEmpty() || isFlatGround(scene, box)) continue;
    if (isFixed(scene)) scenery.push(box);
    else all.union(box);
  }
  const most = all.isEmpty() ? Infinity : Math.max(SMALL, RELATIVE * radius(all));
  for (const box of scenery) {
    if (radius(box) <= most) all.union(box);
  }
  return all;
}

function radius(box: Box3): number {
  return box.getBoundingSphere(new Sphere()).radius;
}

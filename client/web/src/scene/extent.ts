// Size and weight of robots, for the scale of marks.
import { Sphere, type Box3 } from "three";
import type { RobotViews } from "./robot-views";

const GRAVITY = 9.81;

/** Returns metres; one without content. */
export function radiusOf(box: Box3): number {
  return box.isEmpty() ? 1 : box.getBoundingSphere(new Sphere()).radius;
}

/** Returns the weight of the heaviest robot, without links that cannot move, newtons. */
export function weightOf(robots: RobotViews): number {
  const masses = [...robots.all()].map(({ scene }) => scene.links.reduce((sum, link) => sum + (link.movable ? link.mass : 0), 0));
  return GRAVITY * Math.max(0, ...masses);
}

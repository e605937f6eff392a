// A dragged link is pulled as hard as what moves along is heavy, and never harder than the limit.
import { expect, test } from "vitest";
import type { RobotScene } from "../state/scene";
import type { Mode } from "../state/world";
import { pull, springFor } from "./spring";

/** A base of 8 kg, an upper arm of 2, a forearm of 1 and a hand of half a kilogram. */
const arm: RobotScene = {
  robot: "arm",
  layoutVersion: 1n,
  links: [
    { name: "base", parent: -1, movable: false, mass: 8 },
    { name: "upper", parent: 0, movable: true, mass: 2 },
    { name: "fore", parent: 1, movable: true, mass: 1 },
    { name: "hand", parent: 2, movable: true, mass: 0.5 },
  ],
  visuals: [],
  collisions: [],
};
const modes = (passive: string[]) => (link: string): Mode | undefined => (link === "base" ? undefined : passive.includes(link) ? "passive" : "hold");

test("the stiffness is of all that moves along up to the first joint that gives way", () => {
  expect(springFor(arm, 3, modes([])).stiffness).toBe(40 * 11.5);
  expect(springFor(arm, 3, modes(["upper"])).stiffness).toBe(40 * 3.5);
  expect(springFor(arm, 3, modes(["upper", "hand"])).stiffness).toBe(40 * 0.5);
});

test("the damping is of what the link carries, whatever holds it", () => {
  for (const passive of [[], ["upper"]]) expect(springFor(arm, 2, modes(passive)).damping).toBe(5 * 1.5);
});

test("the force is k times the distance less d times the velocity", () => {
  const spring = { stiffness: 10, damping: 2, limit: 100 };
  expect(pull(spring, [0, 0, 1], [1, 0, 0], [0, 2, 1])).toEqual([-2, 20, 0]);
});

test("the force keeps its direction at the limit", () => {
  const spring = { stiffness: 1000, damping: 0, limit: 5 };
  const [x, y, z] = pull(spring, [0, 0, 0], [0, 0, 0], [3, 0, 4]);
  expect([x, y, z]).toEqual([3, 0, 4]);
});

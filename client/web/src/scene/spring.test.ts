// A dragged link is pulled as hard as what moves along is heavy, and never harder than the limit.
import { expect, test } from "vitest";
import type { RobotScene } from "../state/scene";
import type { Mode } from "../state/world";
import { springFor, springForce } from "./spring";

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
  colliders: [],
};
const modes = (passive: string[]) => (link: string): Mode | undefined => (link === "base" ? undefined : passive.includes(link) ? "passive" : "hold");

/** Of a page that draws sixty pictures a second. */
const QUICK = 0.035;
/** Per second squared: what a delay of that leaves of 60, 0.4 times the damping of 5 by the delay. */
const K = (0.4 * 5) / QUICK;

test("the stiffness is of all that moves along up to the first joint that gives way, and of four times what is carried at the most", () => {
  expect(springFor(arm, 3, modes(["hand"]), QUICK).stiffness).toBeCloseTo(K * 0.5, 9);
  expect(springFor(arm, 3, modes(["fore"]), QUICK).stiffness).toBeCloseTo(K * 1.5, 9);
  expect(springFor(arm, 3, modes([]), QUICK).stiffness).toBeCloseTo(K * 4 * 0.5, 9);
  expect(springFor(arm, 1, modes([]), QUICK).stiffness).toBeCloseTo(K * 11.5, 9);
});

test("the damping is of what the link carries, whatever holds it", () => {
  for (const passive of [[], ["upper"]]) expect(springFor(arm, 2, modes(passive), QUICK).damping).toBe(5 * 1.5);
});

/**
 * The end of a free rod in no gravity, pulled to a metre away by forces that are each of a state `delay / 2` ago and last
 * for `delay / 2`: what a page does. Semi-implicit Euler with 1 ms. Answers how far it is from the target in the last second.
 */
function unrest(delay: number): number {
  const rod: RobotScene = { ...arm, links: [{ name: "rod", parent: -1, movable: true, mass: 2 }] };
  const spring = springFor(rod, 0, () => undefined, delay);
  const inertia = 2 / 4;
  const half = Math.round(delay / 2 / 0.001);
  const past: [number, number][] = [];
  let [x, v, force, worst] = [0, 0, 0, 0];
  for (let step = 0; step < 60_000; step += 1) {
    past.push([x, v]);
    const [seen, rate] = past[Math.max(0, step - half)] ?? [0, 0];
    if (step % half === 0) force = springForce(spring, [seen, 0, 0], [rate, 0, 0], [1, 0, 0])[0];
    v += (force / inertia) * 0.001;
    x += v * 0.001;
    if (step > 59_000) worst = Math.max(worst, Math.abs(x - 1));
  }
  return worst;
}

test("the end of a rod comes to rest at the target, however slow the page is", () => {
  for (const delay of [0.01, 0.035, 0.1, 0.2, 0.5, 1]) expect(unrest(delay), `${delay} s`).toBeLessThan(0.02);
});

test("the force is k times the distance less d times the velocity", () => {
  const spring = { stiffness: 10, damping: 2, limit: 100 };
  expect(springForce(spring, [0, 0, 1], [1, 0, 0], [0, 2, 1])).toEqual([-2, 20, 0]);
});

test("the force keeps its direction at the limit", () => {
  const spring = { stiffness: 1000, damping: 0, limit: 5 };
  const [x, y, z] = springForce(spring, [0, 0, 0], [0, 0, 0], [3, 0, 4]);
  expect([x, y, z]).toEqual([3, 0, 4]);
});

// The pull on a dragged link is proportional to the mass that moves along, up to the limit.
import { expect, test } from "vitest";
import type { RobotScene } from "../state/scene";
import type { Mode } from "../state/world";
import { pullDuration, springFor } from "./spring";

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

test("the stiffness is of all that moves along up to the first joint that gives way, and of four times what is carried at the most", () => {
  expect(springFor(arm, 3, modes(["hand"])).stiffness).toBeCloseTo(60 * 0.5, 9);
  expect(springFor(arm, 3, modes(["fore"])).stiffness).toBeCloseTo(60 * 1.5, 9);
  expect(springFor(arm, 3, modes([])).stiffness).toBeCloseTo(60 * 4 * 0.5, 9);
  expect(springFor(arm, 1, modes([])).stiffness).toBeCloseTo(60 * 11.5, 9);
});

test("the force is at most sixty metres per second squared of the same mass", () => {
  expect(springFor(arm, 2, modes(["fore"])).limit).toBeCloseTo(60 * 1.5, 9);
});

test("a pull lasts until the page sends the next one, however seldom it draws and however fast the world runs", () => {
  expect(pullDuration(16, 1)).toBe(0.5);
  expect(pullDuration(1000, 1)).toBe(3);
  expect(pullDuration(1000, 4)).toBe(12);
  // The pull of a page that hangs ends.
  expect(pullDuration(60_000, 1)).toBe(5);
  expect(pullDuration(60_000, 1000)).toBe(60);
  // In a slow world a pull lasts at least half a second.
  expect(pullDuration(16, 0.01)).toBe(0.5);
});

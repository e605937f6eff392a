// The way of a camera from one position to another.
import { Vector3 } from "three";
import { expect, test } from "vitest";
import { between, orbited, panned, seenFrom, zoomed, type View } from "./viewpoints";

const view = (position: [number, number, number], target: [number, number, number] = [0, 0, 0]): View => ({ position: new Vector3(...position), target: new Vector3(...target) });

function near(actual: Vector3, expected: [number, number, number], digits = 9): void {
  actual.toArray().forEach((value, index) => expect(value).toBeCloseTo(expected[index] ?? NaN, digits));
}

test("a preset keeps the target and the distance", () => {
  const from = view([3, 4, 1], [0, 0, 1]);
  near(seenFrom(from, "front").position, [5, 0, 1]);
  near(seenFrom(from, "left").position, [0, 5, 1]);
  near(seenFrom(from, "top").position, [0, 0, 6], 3);
  near(seenFrom(from, "top").target, [0, 0, 1]);
});

test("the path to the opposite side goes around the scene", () => {
  const [from, to] = [view([2, 0, 0]), view([-2, 0, 0])];
  for (const share of [0, 0.25, 0.5, 0.75, 1]) expect(between(from, to, share).position.length()).toBeCloseTo(2, 9);
  near(between(from, to, 1).position, [-2, 0, 0]);
  near(between(from, to, 0).position, [2, 0, 0]);
});

test("an orbit keeps the distance, and ends before it looks straight down", () => {
  near(orbited(view([2, 0, 0]), Math.PI / 2, 0).position, [0, 2, 0]);
  const over = orbited(view([2, 0, 0]), 0, 9).position;
  expect(over.length()).toBeCloseTo(2, 9);
  expect(over.z).toBeLessThan(2);
  expect(over.z).toBeGreaterThan(1.999);
});

test("panning moves camera and target alike, in the plane of the picture", () => {
  const moved = panned(view([2, 0, 0]), 0.5, 0.25);
  near(moved.target, [0, 0.5, 0.25]);
  near(moved.position, [2, 0.5, 0.25]);
});

test("zooming has its bounds", () => {
  near(zoomed(view([2, 0, 0]), 0.5, 0.1, 10).position, [1, 0, 0]);
  near(zoomed(view([2, 0, 0]), 0.001, 0.1, 10).position, [0.1, 0, 0]);
  near(zoomed(view([2, 0, 0]), 1000, 0.1, 10).position, [10, 0, 0]);
});

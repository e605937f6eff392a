// Large fixed things do not decide the first view, and wide solid things are ground.
import { Box3, Vector3 } from "three";
import { expect, test } from "vitest";
import type { Geometry, RobotScene, Shape } from "../state/scene";
import { framed, isFlatGround, isGround } from "./scenery";

function thing(movable: boolean, geometry: Geometry = { kind: "box", size: [1, 1, 1] }): RobotScene {
  const shape: Shape = { link: 0, linkFromShape: [0, 0, 0, 0, 0, 0, 1], geometry };
  return { robot: "r", layoutVersion: 1n, links: [{ name: "base", parent: -1, movable, mass: 1 }], visuals: [shape], collisions: [shape], colliders: [shape] };
}

const box = (x: number, y: number, z: number) => new Box3(new Vector3(-x / 2, -y / 2, 0), new Vector3(x / 2, y / 2, z));
const arm = { scene: thing(true), box: box(1, 1, 1) };

test("a plane that is a mesh is ground, and no part of the first view", () => {
  const plane = { scene: thing(false), box: box(200, 200, 0) };
  expect(isFlatGround(plane.scene, plane.box)).toBe(true);
  expect(isGround(plane.scene, plane.box)).toBe(true);
  expect(framed([arm, plane])).toEqual(arm.box);
  expect(framed([plane]).isEmpty()).toBe(true);
});

test("a plane of the physics is ground, though it has no bounds", () => {
  const plane = thing(false, { kind: "plane", normal: [0, 0, 1] });
  expect(isFlatGround(plane, new Box3())).toBe(true);
  expect(isGround(plane, new Box3())).toBe(true);
});

test("a table is framed with its arm, and a hall is not", () => {
  const table = { scene: thing(false), box: box(2, 1, 0.7) };
  expect(framed([arm, table])).toEqual(arm.box.clone().union(table.box));
  const hall = { scene: thing(false), box: box(60, 40, 8) };
  expect(framed([arm, hall])).toEqual(arm.box);
  // Alone it is the whole view, and robots can stand in it.
  expect(framed([hall])).toEqual(hall.box);
  expect(isFlatGround(hall.scene, hall.box)).toBe(false);
  expect(isGround(hall.scene, hall.box)).toBe(true);
});

test("moving shapes and visuals are never ground", () => {
  expect(isGround(thing(true), box(200, 200, 0))).toBe(false);
  expect(isGround({ ...thing(false), collisions: [], colliders: [] }, box(200, 200, 0))).toBe(false);
});

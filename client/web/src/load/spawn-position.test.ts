// A loaded robot is not spawned inside another.
import { expect, test } from "vitest";
import type { RobotScene } from "../state/scene";
import type { Frame } from "../state/world";
import { nextSpawnPosition } from "./spawn-position";

const scene = (robot: string, plane = false): [string, RobotScene] => [
  robot,
  {
    robot,
    layoutVersion: 1n,
    links: [],
    visuals: [],
    colliders: [],
    collisions: plane ? [{ link: 0, linkFromShape: [0, 0, 0, 0, 0, 0, 1], geometry: { kind: "plane", normal: [0, 0, 1] } }] : [],
  },
];
const at = (...ys: number[]) => Float64Array.from(ys.flatMap((y) => [0, y, 0, 0, 0, 0, 1]));
const frame = (poses: [string, Float64Array][]) => ({ poses: new Map(poses) }) as Frame;

test("the first robot is spawned at the origin, also with a ground", () => {
  expect(nextSpawnPosition(new Map(), null)).toEqual({ x: 0, y: 0, z: 0 });
  expect(nextSpawnPosition(new Map([scene("ground", true)]), frame([["ground", at(7)]]))).toEqual({ x: 0, y: 0, z: 0 });
});

test("the next is spawned a metre to the left of the leftmost link", () => {
  const scenes = new Map([scene("arm"), scene("leg")]);
  expect(nextSpawnPosition(scenes, frame([["arm", at(0, 0.4, -0.2)], ["leg", at(-3)]]))).toEqual({ x: 0, y: 1.4, z: 0 });
});

// End points of a lidar's rays.
import { expect, test } from "vitest";
import type { Pose } from "../state/scene";
import { pointsOf } from "./lidar-points";

const half = Math.PI / 2;
const scan = { horizontal: { samples: 3, min: -half, max: half }, vertical: { samples: 2, min: 0, max: half } };
const rounded = (points: Float32Array) => [...points].map((value) => Number(value.toFixed(6)) + 0);

test("rays go row by row from the least angles on, and those that met nothing have no point", () => {
  const here: Pose = [0, 0, 0, 0, 0, 0, 1];
  expect(rounded(pointsOf(scan, here, [1, 2, 3, Infinity, 5, NaN]))).toEqual([0, -1, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5]);
});

test("points are in the frame of the link", () => {
  // Half a metre up, turned a quarter turn about z.
  const mounted: Pose = [0, 0, 0.5, 0, 0, Math.SQRT1_2, Math.SQRT1_2];
  const one = { horizontal: { samples: 1, min: 0, max: 0 }, vertical: { samples: 1, min: 0, max: 0 } };
  expect(rounded(pointsOf(one, mounted, [2]))).toEqual([0, 2, 0.5]);
});

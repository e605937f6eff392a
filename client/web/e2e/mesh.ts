// Corners of a binary STL in the world, by the daemon's pose: the reference for a picture.

import { readFile } from "node:fs/promises";

/** Corners in the file's axes. */
export async function corners(path: string): Promise<number[][]> {
  const file = await readFile(path);
  const points = [];
  for (let triangle = 0; triangle < file.readUInt32LE(80); triangle += 1) {
    for (let corner = 0; corner < 3; corner += 1) {
      const at = 84 + 50 * triangle + 12 * (corner + 1);
      points.push([0, 4, 8].map((offset) => file.readFloatLE(at + offset)));
    }
  }
  return points;
}

/** Returns a point moved by a pose: x y z, then the quaternion x y z w. */
export function moved(pose: number[], point: number[]): [number, number, number] {
  const [px = 0, py = 0, pz = 0, x = 0, y = 0, z = 0, w = 1] = pose;
  const [a = 0, b = 0, c = 0] = point;
  // v + 2 q x (q x v + w v)
  const [u, v, t] = [y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c];
  return [px + a + 2 * (y * t - z * v), py + b + 2 * (z * u - x * t), pz + c + 2 * (x * v - y * u)];
}

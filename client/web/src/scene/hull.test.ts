// Colliders are drawn as what they are to the physics: hulls of meshes.
import { BoxGeometry, Mesh, PlaneGeometry, SphereGeometry, TorusGeometry, Vector3, type BufferGeometry } from "three";
import { expect, test } from "vitest";
import { extremes, hullOf } from "./hull";

const ONE = new Vector3(1, 1, 1);

/** Signed volume by the divergence theorem: a sixth of the sum of a . (b x c) over triangles. */
function volume(geometry: BufferGeometry): number {
  const flat = geometry.index ? geometry.toNonIndexed() : geometry;
  const position = flat.getAttribute("position");
  const at = (i: number) => new Vector3().fromBufferAttribute(position, i);
  let sum = 0;
  for (let i = 0; i < position.count; i += 3) sum += at(i).dot(at(i + 1).cross(at(i + 2))) / 6;
  return sum;
}

test("the hull of a ring is the disc around it", async () => {
  const hull = await hullOf(new Mesh(new TorusGeometry(2, 0.5, 24, 48)), ONE);
  if (!hull) throw new Error("a ring has a hull");
  // It has more than a thousand corners, and its hull is made of 256 extremes: it lies within the
  // disc of radius 2.5 with a rounded rim, of volume pi*4*1 + pi^2*2*0.25 + 4/3*pi*0.125, and is not much smaller.
  const exact = Math.PI * 4 + (Math.PI ** 2 * 2) / 4 + (4 / 3) * Math.PI * 0.125;
  expect(volume(hull)).toBeLessThan(exact);
  expect(volume(hull)).toBeGreaterThan(0.9 * exact);
});

test("a box is its own hull, with the scale that the description gives it", async () => {
  const hull = await hullOf(new Mesh(new BoxGeometry(1, 2, 3)), new Vector3(2, 1, 1));
  expect(hull && volume(hull)).toBeCloseTo(12, 9);
});

test("what is flat is its box", async () => {
  const hull = await hullOf(new Mesh(new PlaneGeometry(2, 3)), ONE);
  expect(hull && volume(hull)).toBeCloseTo(2 * 3 * 1e-6, 12);
});

test("extremes are among the points, each once", () => {
  const sphere = new SphereGeometry(1, 64, 48).getAttribute("position");
  const points = Array.from({ length: sphere.count }, (_, i) => new Vector3().fromBufferAttribute(sphere, i));
  const found = extremes(points);
  expect(found.length).toBeLessThanOrEqual(256);
  expect(found.length).toBeGreaterThan(200);
  expect(found.every((point) => points.includes(point))).toBe(true);
});

// Ellipsoids of equal inertia.
import { Matrix4, Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import { ellipsoidOf, principal } from "./inertia";

/** Half axes and mass of a solid ellipsoid, m and kg. */
const [a, b, c, mass] = [0.3, 0.2, 0.1, 2];
const moments = [b * b + c * c, a * a + c * c, a * a + b * b].map((sum) => (mass * sum) / 5);

test("a solid ellipsoid is its own ellipsoid", () => {
  const [xx = 0, yy = 0, zz = 0] = moments;
  const found = ellipsoidOf(mass, [1, 2, 3], [xx, 0, 0, yy, 0, zz]);
  const scale = new Vector3();
  const at = new Vector3();
  found?.decompose(at, new Quaternion(), scale);
  expect(scale.toArray().map(Math.abs).map((value) => Number(value.toFixed(12)))).toEqual([a, b, c]);
  expect(at.toArray()).toEqual([1, 2, 3]);
});

test("one that is turned has the same axes, turned", () => {
  const turn = new Matrix4().makeRotationFromQuaternion(new Quaternion(0.1, -0.3, 0.5, 0.8).normalize());
  const inner = new Matrix4().makeScale(moments[0] ?? 0, moments[1] ?? 0, moments[2] ?? 0);
  const { elements: e } = turn.clone().multiply(inner).multiply(turn.clone().transpose());
  const inertia = [e[0], e[4], e[8], e[5], e[9], e[10]];
  expect(principal(inertia).moments.toSorted()).toEqual(moments.toSorted().map((value) => expect.closeTo(value, 12)));
  const found = ellipsoidOf(mass, [0, 0, 0], inertia);
  if (!found) throw new Error("no ellipsoid");
  // The longest axis of the ellipsoid is along the turned x.
  const columns = [0, 1, 2].map((index) => new Vector3().setFromMatrixColumn(found, index));
  const longest = columns.toSorted((one, other) => other.length() - one.length())[0];
  expect(longest?.length()).toBeCloseTo(a, 9);
  expect(Math.abs(longest?.clone().normalize().dot(new Vector3().setFromMatrixColumn(turn, 0)) ?? 0)).toBeCloseTo(1, 9);
});

test("a link without mass has no ellipsoid, and an impossible inertia a thin one", () => {
  expect(ellipsoidOf(0, [0, 0, 0], [1, 0, 0, 1, 0, 1])).toBeUndefined();
  expect(ellipsoidOf(1, [0, 0, 0], [0, 0, 0, 0, 0, 0])).toBeUndefined();
  const thin = ellipsoidOf(1, [0, 0, 0], [10, 0, 0, 1, 0, 1]);
  expect(thin?.elements.every(Number.isFinite)).toBe(true);
});

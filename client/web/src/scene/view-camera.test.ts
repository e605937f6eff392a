// An orthographic picture has no vanishing point, and a ray through a pixel meets the object drawn there.
import { Raycaster, Vector2, Vector3 } from "three";
import { expect, test } from "vitest";
import { aim, projected, ViewCamera } from "./view-camera";

function camera(): ViewCamera {
  const made = new ViewCamera(38, 2, 0.1, 100);
  made.up.set(0, 0, 1);
  made.position.set(5, 0, 0);
  made.lookAt(0, 0, 0);
  made.updateMatrixWorld();
  return made;
}

test("in an orthographic picture the distance of a point does not matter", () => {
  const flat = camera();
  const height = (x: number) => projected(new Vector3(x, 0, 0.5), flat)?.y ?? NaN;
  expect(height(2)).toBeGreaterThan(height(-2));
  flat.flatten(1, 100);
  expect(height(2)).toBeCloseTo(0.5, 9);
  expect(height(-2)).toBeCloseTo(0.5, 9);
  // This holds behind the camera too, which is only the viewpoint.
  expect(height(20)).toBeCloseTo(0.5, 9);
  flat.flatten(0, 100);
  expect(flat.isFlat).toBe(false);
});

test("a ray through the picture of a point goes through that point, in both kinds", () => {
  const point = new Vector3(1, 0.7, -0.4);
  for (const half of [0, 1.5]) {
    const one = camera();
    if (half > 0) one.flatten(half, 50);
    const at = projected(point, one);
    if (!at) throw new Error("the point is in view");
    const { ray } = aim(new Raycaster(), new Vector2(at.x, at.y), one);
    expect(ray.distanceToPoint(point)).toBeLessThan(1e-6);
  }
});

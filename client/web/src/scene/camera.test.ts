// Fitting puts all of a box into the view, with no more margin than necessary.
import { Box3, PerspectiveCamera, Vector3 } from "three";
import { expect, test } from "vitest";
import { distanceToFit } from "./camera";

const boxes = [
  new Box3(new Vector3(-1, -1, 0), new Vector3(1, 1, 2)),
  new Box3(new Vector3(0, -0.1, -0.1), new Vector3(3, 0.1, 0.1)),
  new Box3(new Vector3(5, 5, 0), new Vector3(5.1, 5.2, 1.4)),
];

test("the farthest corner touches the edge of the view, and no other is outside", () => {
  const direction = new Vector3(1, -1.15, 0.62).normalize();
  for (const box of boxes) {
    for (const aspect of [0.5, 1.3, 2.4]) {
      const middle = box.getCenter(new Vector3());
      const camera = new PerspectiveCamera(38, aspect, 0.01, 100);
      camera.up.set(0, 0, 1);
      camera.position.copy(middle).addScaledVector(direction, distanceToFit(box, direction, 38, aspect));
      camera.lookAt(middle);
      camera.updateMatrixWorld();
      const { min, max } = box;
      const corners = [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => new Vector3(x, y, z))));
      const places = corners.map((corner) => corner.project(camera)).map(({ x, y }) => Math.max(Math.abs(x), Math.abs(y)));
      expect(Math.max(...places)).toBeCloseTo(1, 9);
    }
  }
});

// Parts of markers that are drawn as instances.
import { Matrix4, Vector3, type CylinderGeometry, type Quaternion } from "three";

/** Moves the origin of a geometry to its base, and its axis from y to z. */
export function along<T extends CylinderGeometry>(geometry: T): T {
  return geometry.translate(0, 0.5, 0).rotateX(Math.PI / 2);
}

/** Returns the matrix of an instance: its width in x and y, and its length in z. */
export function marker(at: Vector3, turn: Quaternion, width: number, length: number): Matrix4 {
  return new Matrix4().compose(at, turn, new Vector3(width, width, length));
}

// The convex hull that a collision mesh is to the physics: made by the rule of server/core/src/collision/shapes.rs.
import { BoxGeometry, Box3, Mesh, Vector3, type BufferGeometry, type Object3D } from "three";

/** A mesh with more corners than this has its hull made of its extremes alone. */
const MOST_POINTS = 1000;
const DIRECTIONS = 256;
/** Metres; what is thinner has no hull, and its box stands for it. */
const THINNEST = 1e-6;

/** The hull of all meshes in an object, whose coordinates are multiplied by `scale`; nothing where there is no corner. */
export async function hullOf(object: Object3D, scale: Vector3): Promise<BufferGeometry | undefined> {
  const points = cornersOf(object, scale);
  if (points.length === 0) return undefined;
  const box = new Box3().setFromPoints(points);
  const size = box.getSize(new Vector3());
  if (Math.min(size.x, size.y, size.z) <= THINNEST) {
    const { x, y, z } = box.getCenter(new Vector3());
    return new BoxGeometry(Math.max(size.x, THINNEST), Math.max(size.y, THINNEST), Math.max(size.z, THINNEST)).translate(x, y, z);
  }
  // Fetched when colliders are first looked at.
  const { ConvexGeometry } = await import("three/examples/jsm/geometries/ConvexGeometry.js");
  return new ConvexGeometry(points.length > MOST_POINTS ? extremes(points) : points);
}

/** Each corner once. */
function cornersOf(object: Object3D, scale: Vector3): Vector3[] {
  const corners = new Map<string, Vector3>();
  object.updateMatrixWorld(true);
  object.traverse((each) => {
    if (!(each instanceof Mesh)) return;
    const position = (each.geometry as BufferGeometry).getAttribute("position");
    for (let i = 0; i < position.count; i += 1) {
      const corner = new Vector3().fromBufferAttribute(position, i).applyMatrix4(each.matrixWorld).multiply(scale);
      corners.set(`${corner.x},${corner.y},${corner.z}`, corner);
    }
  });
  return [...corners.values()];
}

/** The points that are farthest in directions spread evenly over the sphere (a Fibonacci lattice), each once. */
export function extremes(points: readonly Vector3[]): Vector3[] {
  const golden = Math.PI * (3 - Math.sqrt(5));
  const kept = new Set<Vector3>();
  for (let i = 0; i < DIRECTIONS; i += 1) {
    const z = 1 - (2 * i + 1) / DIRECTIONS;
    const across = Math.sqrt(1 - z * z);
    const direction = new Vector3(across * Math.cos(golden * i), across * Math.sin(golden * i), z);
    let best: Vector3 | undefined;
    let farthest = -Infinity;
    for (const point of points) {
      const far = point.dot(direction);
      if (far < farthest) continue;
      farthest = far;
      best = point;
    }
    if (best) kept.add(best);
  }
  return [...kept];
}

// Triangles of primitives, about z as in URDF.
import { BoxGeometry, CapsuleGeometry, CircleGeometry, CylinderGeometry, SphereGeometry, type BufferGeometry } from "three";
import type { Geometry } from "../state/scene";

/** Radius of a drawn plane, metres: the fog hides its edge. */
export const PLANE_RADIUS = 200;

/** All shapes but those that are fetched from the daemon. */
export type Primitive = Exclude<Geometry, { kind: "mesh" | "convex" }>;

/** The triangles of a primitive; the caller disposes of them. */
export function triangles(primitive: Primitive): BufferGeometry {
  switch (primitive.kind) {
    case "box":
      return new BoxGeometry(...primitive.size);
    case "sphere":
      return new SphereGeometry(primitive.radius, 40, 24);
    case "cylinder":
      return new CylinderGeometry(primitive.radius, primitive.radius, primitive.length, 40).rotateX(Math.PI / 2);
    case "capsule":
      return new CapsuleGeometry(primitive.radius, primitive.length, 12, 32).rotateX(Math.PI / 2);
    case "plane":
      // Along z; the caller rotates it to its normal.
      return new CircleGeometry(PLANE_RADIUS, 64);
  }
}

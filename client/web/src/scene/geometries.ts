// Primitives as triangles: about z, as URDF has them, made once for each size.
import { BoxGeometry, CapsuleGeometry, CircleGeometry, CylinderGeometry, SphereGeometry, type BufferGeometry } from "three";
import type { Geometry } from "../state/scene";

/** Metres from the middle of a plane to its end: it fades into the distance before that. */
export const PLANE_RADIUS = 200;

/** All but meshes. */
export type Primitive = Exclude<Geometry, { kind: "mesh" }>;

/** The triangles of a primitive; whoever asks disposes of them. */
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
      // Along z; the shape is turned to its normal where it is placed.
      return new CircleGeometry(PLANE_RADIUS, 64);
  }
}

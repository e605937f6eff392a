// Triangles of primitives, about z as in URDF.
import { BoxGeometry, CapsuleGeometry, CircleGeometry, ConeGeometry, CylinderGeometry, SphereGeometry, type BufferGeometry } from "three";
import type { Geometry, TextureRepeat } from "../state/scene";

/** Radius of a drawn plane, metres: the fog hides its edge. */
export const PLANE_RADIUS = 200;

/** All shapes except those that are fetched from the daemon. */
export type Primitive = Exclude<Geometry, { kind: "mesh" | "convex" }>;

/** Returns the triangles of a primitive; the caller disposes of them. */
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
    case "cone":
      return new ConeGeometry(primitive.radius, primitive.length, 40).rotateX(Math.PI / 2);
    case "plane":
      // Along z; the caller rotates it to its normal.
      return new CircleGeometry(PLANE_RADIUS, 64);
  }
}

/** Repeats a picture on the triangles of a primitive as its material specifies. */
export function repeatPicture(made: BufferGeometry, primitive: Primitive, { x, y, perMetre }: TextureRepeat): void {
  const places = made.getAttribute("uv");
  for (let index = 0; index < places.count; index += 1) {
    const [across, up] = perMetre ? metres(primitive, index) : [1, 1];
    // On surfaces measured in metres, the picture's middle is in their middle; on others it begins at the edge.
    const from = perMetre ? 0.5 : 0;
    places.setXY(index, from + (places.getX(index) - from) * x * across, from + (places.getY(index) - from) * y * up);
  }
}

/**
 * Returns the size of the surface that a picture covers once, metres. Four corners of a box make a side, in the order x,
 * y, z, two sides each.
 */
function metres(primitive: Primitive, corner: number): readonly [number, number] {
  if (primitive.kind === "plane") return [2 * PLANE_RADIUS, 2 * PLANE_RADIUS];
  if (primitive.kind !== "box") return [1, 1];
  const [x, y, z] = primitive.size;
  return ([[z, y], [x, z], [x, y]] as const)[Math.floor(corner / 8)] ?? [1, 1];
}

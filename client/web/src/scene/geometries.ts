// Triangles of primitives, about z as in URDF.
import { BoxGeometry, CapsuleGeometry, CircleGeometry, ConeGeometry, CylinderGeometry, SphereGeometry, type BufferGeometry } from "three";
import type { Geometry, TextureRepeat } from "../state/scene";

/** Radius of a drawn plane, metres: the fog hides its edge. */
export const PLANE_RADIUS = 200;

/** All shapes except those that are fetched from the daemon. */
export type Primitive = Exclude<Geometry, { kind: "mesh" | "convex" }>;

/** Sides of round primitives; and of those that are so small in the picture that their edge is off by less than half a pixel. */
const ROUND = 40;
const COARSE = 12;
/** Pixels of the largest radius for which `COARSE` is enough. */
const COARSE_RADIUS = 0.4 / (1 - Math.cos(Math.PI / COARSE));

/** Triangles of primitives: equal ones are shared, and disposed of with their last user. */
export class Primitives {
  private readonly entries = new Map<string, { made: BufferGeometry; users: number }>();
  private readonly rounds = new WeakMap<BufferGeometry, { primitive: Primitive; radius: number; coarse?: BufferGeometry }>();

  /** Returns the triangles, and a function that releases them. */
  acquire(primitive: Primitive, repeat?: TextureRepeat): { made: BufferGeometry; release: () => void } {
    const key = JSON.stringify([primitive, repeat]);
    let entry = this.entries.get(key);
    if (!entry) {
      entry = { made: triangles(primitive), users: 0 };
      if (repeat) repeatPicture(entry.made, primitive, repeat);
      else if ("radius" in primitive) this.rounds.set(entry.made, { primitive, radius: primitive.radius });
      this.entries.set(key, entry);
    }
    const { made } = entry;
    entry.users += 1;
    return { made, release: () => this.release(key) };
  }

  /** Returns the triangles that suffice where a metre has this many pixels: the same, or fewer that look equal. */
  readonly sufficient = (made: BufferGeometry, pixels: number): BufferGeometry => {
    const round = this.rounds.get(made);
    if (!round || round.radius * pixels > COARSE_RADIUS) return made;
    round.coarse ??= triangles(round.primitive, COARSE);
    return round.coarse;
  };

  private release(key: string): void {
    const entry = this.entries.get(key);
    if (!entry) return;
    entry.users -= 1;
    if (entry.users > 0) return;
    this.entries.delete(key);
    this.rounds.get(entry.made)?.coarse?.dispose();
    entry.made.dispose();
  }
}

/** Returns the triangles of a primitive, with this number of sides if it is round; the caller disposes of them. */
export function triangles(primitive: Primitive, sides = ROUND): BufferGeometry {
  switch (primitive.kind) {
    case "box":
      return new BoxGeometry(...primitive.size);
    case "sphere":
      return new SphereGeometry(primitive.radius, sides, Math.round(0.6 * sides));
    case "cylinder":
      return new CylinderGeometry(primitive.radius, primitive.radius, primitive.length, sides).rotateX(Math.PI / 2);
    case "capsule":
      return new CapsuleGeometry(primitive.radius, primitive.length, Math.round(0.3 * sides), Math.round(0.8 * sides)).rotateX(Math.PI / 2);
    case "cone":
      return new ConeGeometry(primitive.radius, primitive.length, sides).rotateX(Math.PI / 2);
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

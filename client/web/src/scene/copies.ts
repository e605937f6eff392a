// Draws equal meshes of all robots at once, by one call for each kind of mesh: many calls take much of a slow machine's time.
import { DynamicDrawUsage, Frustum, Group, InstancedMesh, Matrix4, Mesh, Sphere, type BufferGeometry, type Camera, type Material, type Object3D } from "three";

/** Minimum number of equal meshes that are drawn at once. */
const LEAST = 4;
/** Layer of the meshes that are drawn as copies. Cameras leave it out; the pointer finds it. */
export const COPIED = 1;

const EVERYTHING = new Sphere(undefined, Infinity);

/** Meshes that differ only in their places. */
interface Kind {
  geometry: BufferGeometry;
  material: Material;
  first: Mesh;
  meshes: Mesh[];
}

/** Copies of the meshes of a scene. The meshes stay where they are, for the pointer, highlights and bounds. */
export class Copies {
  readonly group = new Group();
  private readonly drawn = new Map<string, InstancedMesh>();
  private kinds: { meshes: readonly Mesh[]; copies: InstancedMesh; geometry: BufferGeometry }[] = [];
  private readonly frustum = new Frustum();
  private readonly product = new Matrix4();
  private readonly sphere = new Sphere();

  /** `sufficient` returns the triangles that look equal at this number of pixels per metre. */
  constructor(private readonly sufficient: (geometry: BufferGeometry, pixels: number) => BufferGeometry = (geometry) => geometry) {}

  /** Finds equal meshes among the visible ones. Called for each picture, so that a mesh may change its material or vanish at any time. */
  gather(from: Object3D): void {
    const found = new Map<string, Kind>();
    from.traverseVisible((object) => {
      if (!(object instanceof Mesh)) return;
      object.layers.set(0);
      const material = object.material as Material | Material[];
      // Transparent meshes are sorted by their distance.
      if (Array.isArray(material) || material.transparent || !material.visible) return;
      const geometry = object.geometry as BufferGeometry;
      const key = `${geometry.id} ${material.id} ${object.castShadow} ${object.receiveShadow}`;
      const kind = found.get(key);
      if (kind) kind.meshes.push(object);
      else found.set(key, { geometry, material, first: object, meshes: [object] });
    });
    this.kinds = [];
    for (const [key, kind] of found) {
      if (kind.meshes.length < LEAST) continue;
      for (const mesh of kind.meshes) mesh.layers.set(COPIED);
      this.kinds.push({ meshes: kind.meshes, copies: this.copiesOf(key, kind), geometry: kind.geometry });
    }
    const used = new Set(this.kinds.map(({ copies }) => copies));
    for (const [key, copies] of this.drawn) if (!used.has(copies)) this.remove(key, copies);
  }

  /**
   * Puts the copies where their meshes are, for a picture of this many pixels from below to above. Copies out of the camera's view are left out,
   * unless they may cast shadows into it.
   */
  place(camera: Camera, height: number, hasShadows: boolean): void {
    const { projectionMatrix, matrixWorldInverse } = camera;
    this.frustum.setFromProjectionMatrix(this.product.multiplyMatrices(projectionMatrix, matrixWorldInverse));
    const isFlat = projectionMatrix.elements[15] === 1;
    for (const { meshes, copies, geometry } of this.kinds) {
      const { instanceMatrix } = copies;
      if (geometry.boundingSphere === null) geometry.computeBoundingSphere();
      let count = 0;
      let nearest = Infinity;
      for (const { matrixWorld } of meshes) {
        this.sphere.copy(geometry.boundingSphere ?? EVERYTHING).applyMatrix4(matrixWorld);
        if (!hasShadows && !this.frustum.intersectsSphere(this.sphere)) continue;
        matrixWorld.toArray(instanceMatrix.array, 16 * count);
        count += 1;
        nearest = Math.min(nearest, -this.sphere.center.applyMatrix4(matrixWorldInverse).z - this.sphere.radius);
      }
      const pixels = (projectionMatrix.elements[5] * height) / 2 / (isFlat ? 1 : Math.max(0, nearest));
      copies.geometry = hasShadows ? geometry : this.sufficient(geometry, pixels);
      copies.count = count;
      copies.visible = count > 0;
      instanceMatrix.clearUpdateRanges();
      instanceMatrix.addUpdateRange(0, 16 * count);
      instanceMatrix.needsUpdate = true;
    }
  }

  /** Number of meshes that are drawn as copies, and of the calls that draw them. */
  counts(): { meshes: number; calls: number } {
    return { meshes: this.kinds.reduce((sum, { meshes }) => sum + meshes.length, 0), calls: this.kinds.length };
  }

  dispose(): void {
    for (const [key, copies] of this.drawn) this.remove(key, copies);
    this.kinds = [];
  }

  private copiesOf(key: string, { geometry, material, first, meshes }: Kind): InstancedMesh {
    const before = this.drawn.get(key);
    if (before && before.instanceMatrix.count >= meshes.length) return before;
    if (before) this.remove(key, before);
    // Room for more, so that a robot that is added seldom needs a new buffer.
    const copies = new InstancedMesh(geometry, material, 2 * meshes.length);
    copies.instanceMatrix.setUsage(DynamicDrawUsage);
    copies.castShadow = first.castShadow;
    copies.receiveShadow = first.receiveShadow;
    copies.frustumCulled = false;
    // Only the order of drawing depends on it.
    copies.boundingSphere = new Sphere();
    this.drawn.set(key, copies);
    this.group.add(copies);
    return copies;
  }

  private remove(key: string, copies: InstancedMesh): void {
    this.drawn.delete(key);
    copies.removeFromParent();
    copies.dispose();
  }
}

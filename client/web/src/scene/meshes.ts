// Meshes by the hash of their file: each is fetched once, shared by all that show it, and let go with the last.
import { Group, Mesh, type BufferGeometry, type Material, type Object3D } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";

/** A mesh that somebody shows. */
interface Kept {
  users: number;
  /** Nothing where it could not be had. */
  loaded: Promise<Object3D | undefined>;
}

/** Those that are shown. */
export class Meshes {
  private readonly kept = new Map<string, Kept>();
  private readonly loader = new GLTFLoader();
  private loading = 0;

  /** Whether all that was asked for has come, or is known not to. */
  isComplete(): boolean {
    return this.loading === 0;
  }

  /** A copy that shares triangles and materials with all others. Each has to be given back with `release`. */
  async acquire(sha256: string): Promise<Object3D | undefined> {
    let kept = this.kept.get(sha256);
    if (!kept) {
      kept = { users: 0, loaded: this.load(sha256) };
      this.kept.set(sha256, kept);
    }
    kept.users += 1;
    return (await kept.loaded)?.clone();
  }

  release(sha256: string): void {
    const kept = this.kept.get(sha256);
    if (!kept) return;
    kept.users -= 1;
    if (kept.users > 0) return;
    this.kept.delete(sha256);
    void kept.loaded.then(dispose);
  }

  private async load(sha256: string): Promise<Object3D | undefined> {
    this.loading += 1;
    try {
      return (await this.loader.loadAsync(`/meshes/${encodeURIComponent(sha256)}.glb`)).scene;
    } catch {
      // The daemon no longer has it, or it cannot be read: a marker stands in for it.
      return undefined;
    } finally {
      this.loading -= 1;
    }
  }
}

/** Whether the file gave it no colour, so that the robot's description can: the daemon's stand-in has no name. */
export function isUnpainted(mesh: Mesh): boolean {
  const material = mesh.material as Material | Material[];
  return !Array.isArray(material) && material.name === "";
}

function dispose(object: Object3D | undefined): void {
  (object ?? new Group()).traverse((each) => {
    if (!(each instanceof Mesh)) return;
    (each.geometry as BufferGeometry).dispose();
    const materials = each.material as Material | Material[];
    for (const material of Array.isArray(materials) ? materials : [materials]) material.dispose();
  });
}

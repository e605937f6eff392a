// Cache of meshes and convex colliders by their address, and of primitives. Each is fetched or made once, shared by its users, and disposed of with the
// last.
import { Group, Mesh, MeshStandardMaterial, type BufferGeometry, type Material, type Object3D } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import type { Geometry } from "../state/scene";
import { Primitives } from "./geometries";
import { Surface } from "./surface";

/** A mesh in use. */
interface Entry {
  users: number;
  /** Undefined if it could not be fetched. */
  loaded: Promise<Object3D | undefined>;
}

/** Returns the address of a mesh or a convex collider; undefined if the file of the mesh is missing. */
export function addressOf(geometry: Extract<Geometry, { sha256: string }>): string | undefined {
  if (geometry.sha256 === "") return undefined;
  return `/${geometry.kind === "mesh" ? "meshes" : "colliders"}/${encodeURIComponent(geometry.sha256)}.glb`;
}

/** Cache with reference counts. */
export class MeshCache {
  readonly primitives = new Primitives();
  private readonly entries = new Map<string, Entry>();
  private readonly loader = new GLTFLoader().register(() => ({ name: "surface", getMaterialType: () => Surface }));
  private loading = 0;

  /** Whether no request is pending. */
  isComplete(): boolean {
    return this.loading === 0;
  }

  /** Returns a copy that shares triangles and materials with all others. Each call needs one of `release`. */
  async acquire(address: string): Promise<Object3D | undefined> {
    let entry = this.entries.get(address);
    if (!entry) {
      entry = { users: 0, loaded: this.load(address) };
      this.entries.set(address, entry);
    }
    entry.users += 1;
    return (await entry.loaded)?.clone();
  }

  release(address: string): void {
    const entry = this.entries.get(address);
    if (!entry) return;
    entry.users -= 1;
    if (entry.users > 0) return;
    this.entries.delete(address);
    void entry.loaded.then(dispose);
  }

  private async load(address: string): Promise<Object3D | undefined> {
    this.loading += 1;
    try {
      return (await this.loader.loadAsync(address)).scene;
    } catch {
      // The daemon no longer has it, or it cannot be read: a marker is drawn instead.
      return undefined;
    } finally {
      this.loading -= 1;
    }
  }
}

/**
 * Whether the file has no material, so that the robot's description may set one: the daemon's default material has no name. This is
 * RViz's rule: materials of a mesh override the URDF's.
 */
export function isUnpainted(mesh: Mesh): boolean {
  const material = mesh.material as Material | Material[];
  return !Array.isArray(material) && material.name === "";
}

function dispose(object: Object3D | undefined): void {
  (object ?? new Group()).traverse((each) => {
    if (!(each instanceof Mesh)) return;
    (each.geometry as BufferGeometry).dispose();
    const materials = each.material as Material | Material[];
    for (const material of Array.isArray(materials) ? materials : [materials]) {
      if (material instanceof MeshStandardMaterial) material.map?.dispose();
      material.dispose();
    }
  });
}

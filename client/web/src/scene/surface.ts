// The material of all lit surfaces: robots, grounds and mesh files.
import { Mesh, MeshStandardMaterial, type Material, type Object3D, type WebGLProgramParametersWithUniforms } from "three";
import { CORNER_FRAGMENT, CORNER_VERTEX } from "./corner-light";

let atCorners = false;

/** A material whose light is computed at each pixel, or at corners only: see `lightAtCorners`. */
export class Surface extends MeshStandardMaterial {
  override onBeforeCompile(shader: WebGLProgramParametersWithUniforms): void {
    if (!atCorners) return;
    shader.vertexShader = CORNER_VERTEX;
    shader.fragmentShader = CORNER_FRAGMENT;
  }

  override customProgramCacheKey(): string {
    return atCorners ? "corners" : "pixels";
  }
}

/** Switches the light of all surfaces to corners, or back to pixels. */
export function lightAtCorners(isCheap: boolean, scene: Object3D): void {
  if (atCorners === isCheap) return;
  atCorners = isCheap;
  scene.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const materials = object.material as Material | Material[];
    for (const material of Array.isArray(materials) ? materials : [materials]) {
      if (material instanceof Surface) material.needsUpdate = true;
    }
  });
}

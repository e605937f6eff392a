// Ambient occlusion: darkens edges and gaps of a drawn picture, since less light reaches surfaces that are near one another. Loaded
// on first use.
import { DoubleSide, Mesh, MeshStandardMaterial, Vector2, type Material, type Object3D, type Scene, type WebGLRenderer } from "three";
import { GTAOPass } from "three/examples/jsm/postprocessing/GTAOPass.js";
import { FullScreenQuad } from "three/examples/jsm/postprocessing/Pass.js";
import type { ViewCamera } from "./view-camera";

/** Radius of the search for occluders, as a part of the distance to the camera's target; and its minimum and maximum, metres. */
const REACH = 0.06;
const MIN_REACH = 0.02;
const MAX_REACH = 0.5;
/** Share of the occluded light that is removed. */
const INTENSITY = 0.85;
const SAMPLES = 12;

/** "Practical Realtime Strategies for Accurate Indirect Occlusion" (Jimenez and others, 2016), in three.js's implementation. */
export class AmbientOcclusion {
  private readonly pass: GTAOPass;
  private readonly quad: FullScreenQuad;
  private readonly size = new Vector2();
  private readonly hidden: Object3D[] = [];

  constructor(
    private readonly scene: Scene,
    camera: ViewCamera,
  ) {
    this.pass = new GTAOPass(scene, camera, 1, 1);
    // The picture is already smoothed and in screen colours: this pass only multiplies it.
    this.pass.output = GTAOPass.OUTPUT.Off;
    // Meshes may be open shells.
    this.pass.normalMaterial.side = DoubleSide;
    this.pass.updateGtaoMaterial({ samples: SAMPLES });
    this.pass.blendMaterial.uniforms["intensity"]!.value = INTENSITY;
    this.pass.blendMaterial.uniforms["tDiffuse"]!.value = this.pass.gtaoMap;
    this.quad = new FullScreenQuad(this.pass.blendMaterial);
  }

  /** Darkens the picture that the renderer has just drawn; the camera's target is this many metres away. */
  darken(renderer: WebGLRenderer, distance: number): void {
    const { x, y } = renderer.getDrawingBufferSize(this.size);
    if (x !== this.pass.width || y !== this.pass.height) this.pass.setSize(x, y);
    const radius = Math.min(MAX_REACH, Math.max(MIN_REACH, REACH * distance));
    this.pass.updateGtaoMaterial({ radius, thickness: radius });
    const { autoClear } = renderer;
    const { background } = this.scene;
    const { autoUpdate } = renderer.shadowMap;
    // Shadows stay as in the picture.
    renderer.shadowMap.autoUpdate = false;
    this.scene.background = null;
    this.hide();
    try {
      const unused = this.pass.gtaoRenderTarget;
      this.pass.render(renderer, unused, unused, 0, false);
    } finally {
      for (const object of this.hidden) object.visible = true;
      this.hidden.length = 0;
      this.scene.background = background;
      renderer.shadowMap.autoUpdate = autoUpdate;
      renderer.setRenderTarget(null);
    }
    renderer.autoClear = false;
    this.quad.render(renderer);
    renderer.autoClear = autoClear;
  }

  dispose(): void {
    this.pass.dispose();
    this.pass.gtaoMaterial.dispose();
    this.pass.blendMaterial.dispose();
    this.quad.dispose();
  }

  /** Leaves out everything that is not solid: marks, names, the grid, and transparent things. */
  private hide(): void {
    this.scene.traverseVisible((object) => {
      if (!isDrawn(object) || isSolid(object)) return;
      this.hidden.push(object);
    });
    for (const object of this.hidden) object.visible = false;
  }
}

function isDrawn(object: Object3D): object is Object3D & { material: Material | Material[] } {
  return "material" in object;
}

function isSolid(object: Object3D & { material: Material | Material[] }): boolean {
  const all = Array.isArray(object.material) ? object.material : [object.material];
  return object instanceof Mesh && all.every((material) => material instanceof MeshStandardMaterial && !material.transparent);
}

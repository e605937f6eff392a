// A hemisphere light and a directional light with a soft shadow.
import { DirectionalLight, HemisphereLight, Vector3, type Scene, type Sphere } from "three";
import type { Palette } from "./palette";

/** Direction to the directional light: above, in front, a little to the left. */
const SUN = new Vector3(1.2, 0.5, 2.4).normalize();
const SHADOW_PIXELS = 2048;

/** Both lights. */
export class Light {
  private readonly sky = new HemisphereLight();
  private readonly sun = new DirectionalLight();

  constructor(scene: Scene) {
    // z is up here, not y.
    this.sky.position.set(0, 0, 1);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    this.sun.shadow.radius = 3;
    this.sun.shadow.normalBias = 0.01;
    scene.add(this.sky, this.sun, this.sun.target);
  }

  paint(palette: Palette): void {
    this.sky.color.set(palette.sky);
    this.sky.groundColor.set(palette.earth);
    this.sky.intensity = palette.skyIntensity;
    this.sun.intensity = palette.sunIntensity;
  }

  /** Fits the shadow map to a sphere. */
  cover({ center, radius }: Sphere): void {
    const reach = Math.max(0.2, 1.6 * radius);
    const { camera } = this.sun.shadow;
    this.sun.target.position.copy(center);
    this.sun.position.copy(center).addScaledVector(SUN, 2 * reach);
    camera.left = camera.bottom = -reach;
    camera.right = camera.top = reach;
    camera.near = 0.01 * reach;
    camera.far = 5 * reach;
    this.sun.shadow.bias = -0.0004 * reach;
    this.sun.shadow.normalBias = 0.004 * reach;
    camera.updateProjectionMatrix();
  }

  dispose(): void {
    this.sun.dispose();
    this.sky.dispose();
  }
}

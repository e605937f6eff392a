// A hemisphere light and a directional light with a soft shadow.
import { DirectionalLight, HemisphereLight, Sphere, Vector3, type Scene } from "three";
import type { Palette } from "./palette";

/** Direction to the directional light: above, in front, a little to the left. */
const SUN = new Vector3(1.2, 0.5, 2.4).normalize();
const SHADOW_PIXELS = 2048;
/** The share of the sky's light that remains in addition to the light of a room. */
const BESIDE_ROOM = 0.5;
/**
 * Relative change of the visible size or position after which the shadow is fitted again. Fitting at each step would
 * make its edges flicker.
 */
const ZOOMED = 1.3;
const MOVED = 0.25;
/** Radius of the visible area about the target, as a share of the distance. */
const SEEN = 0.9;

/** Both lights. */
export class Light {
  private readonly sky = new HemisphereLight();
  private readonly sun = new DirectionalLight();
  private skyIntensity = 1;
  private hasRoom = false;
  /** Sphere to which the shadow is fitted. */
  private readonly fitted = new Sphere(new Vector3(), 0);
  private readonly content = new Sphere(new Vector3(), 0);

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
    this.skyIntensity = palette.skyIntensity;
    this.sun.intensity = palette.sunIntensity;
    this.balance();
  }

  /** Sets shadows and the room's light on or off. */
  refine(shadows: boolean, room: boolean): void {
    this.sun.castShadow = shadows;
    this.hasRoom = room;
    this.balance();
  }

  private balance(): void {
    this.sky.intensity = this.skyIntensity * (this.hasRoom ? BESIDE_ROOM : 1);
  }

  /**
   * Fits the shadow map to the visible content, from this distance to a point: close views have fine shadow edges too.
   */
  cover(content: Sphere, target: Vector3, distance: number): void {
    const seen = new Sphere(target, SEEN * distance);
    const wanted = seen.radius < content.radius ? seen : content;
    const { fitted } = this;
    const ratio = wanted.radius / fitted.radius;
    const isFine = ratio < ZOOMED && ratio > 1 / ZOOMED && wanted.center.distanceTo(fitted.center) < MOVED * fitted.radius;
    if (isFine && content.equals(this.content)) return;
    this.content.copy(content);
    if (!isFine) fitted.copy(wanted);
    const reach = Math.max(0.2, 1.6 * fitted.radius);
    // All of the content casts shadows, even from outside of the view.
    const depth = Math.max(reach, content.radius + content.center.distanceTo(fitted.center));
    const { camera } = this.sun.shadow;
    this.sun.target.position.copy(fitted.center);
    this.sun.position.copy(fitted.center).addScaledVector(SUN, 1.2 * depth);
    camera.left = camera.bottom = -reach;
    camera.right = camera.top = reach;
    camera.near = 0.01 * depth;
    camera.far = 1.2 * depth + 3 * Math.max(reach, content.radius);
    this.sun.shadow.bias = -0.0004 * reach;
    this.sun.shadow.normalBias = 0.004 * reach;
    camera.updateProjectionMatrix();
  }

  dispose(): void {
    this.sun.dispose();
    this.sky.dispose();
  }
}

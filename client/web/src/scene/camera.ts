// Where the world is looked at from: orbit, pan, zoom, and fitting what is to be seen into the view.
import { MathUtils, MOUSE, PerspectiveCamera, Vector3, type Box3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

/** Degrees, from top to bottom. */
const FIELD = 38;
/** From the front, from its left, from above: a robot looks along x. */
const FIRST_DIRECTION = new Vector3(1, 1.15, 0.62).normalize();
/** Room around what is fitted: it is about to move, and buttons lie over the edge. */
const MARGIN = 1.3;
/** Metres. */
const NEAREST = 0.05;
/** Milliseconds that a flight takes. */
const FLIGHT = 260;

/** A camera and the hands on it. */
export class Camera {
  readonly camera = new PerspectiveCamera(FIELD, 1, 0.01, 500);
  readonly controls: OrbitControls;
  /** Somebody chose what to see; it is not chosen anew for them. */
  touched = false;
  private flight: { began: number; from: View; to: View } | null = null;

  /** `changed` is called when a new picture is due. */
  constructor(canvas: HTMLElement, changed: () => void) {
    this.camera.up.set(0, 0, 1);
    this.camera.position.copy(FIRST_DIRECTION).multiplyScalar(3);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0, 0, 0.2);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.18;
    this.controls.zoomToCursor = true;
    this.controls.minDistance = 0.02;
    this.controls.maxDistance = 150;
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.PAN };
    this.controls.addEventListener("start", () => {
      this.touched = true;
      this.flight = null;
    });
    this.controls.addEventListener("change", changed);
    this.controls.update();
  }

  resize(width: number, height: number): void {
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
  }

  /** Looks at a box from the side that the camera is on, as near as all of it is in the view. */
  fit(box: Box3, now: number, fly: boolean): void {
    const center = box.getCenter(new Vector3());
    const direction = this.camera.position.clone().sub(this.controls.target).normalize();
    const distance = MARGIN * Math.max(NEAREST, distanceToFit(box, direction, FIELD, this.camera.aspect));
    const to = { target: center, position: center.clone().addScaledVector(direction, distance) };
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (fly && !calm) {
      this.flight = { began: now, from: this.view(), to };
    } else {
      this.flight = null;
      this.take(to);
    }
  }

  /** Moves on. Answers whether it has to be asked again for the next picture. */
  update(now: number): boolean {
    if (this.flight) {
      const { began, from, to } = this.flight;
      const t = Math.min(1, Math.max(0, (now - began) / FLIGHT));
      const share = t * t * (3 - 2 * t);
      this.take({
        target: from.target.clone().lerp(to.target, share),
        position: from.position.clone().lerp(to.position, share),
      });
      if (t >= 1) this.flight = null;
      return true;
    }
    const moving = this.controls.update();
    this.limitDepth();
    return moving;
  }

  isStill(): boolean {
    return this.flight === null;
  }

  /** Metres to what is looked at. */
  distance(): number {
    return this.camera.position.distanceTo(this.controls.target);
  }

  dispose(): void {
    this.controls.dispose();
  }

  private view(): View {
    return { target: this.controls.target.clone(), position: this.camera.position.clone() };
  }

  private take({ target, position }: View): void {
    this.controls.target.copy(target);
    this.camera.position.copy(position);
    this.controls.update();
    this.limitDepth();
  }

  /** Depth is exact where the nearest and the farthest that is drawn are not too far apart. */
  private limitDepth(): void {
    const near = Math.max(0.002, 0.02 * this.distance());
    if (Math.abs(near - this.camera.near) < 0.05 * near) return;
    this.camera.near = near;
    this.camera.far = Math.max(60, 20_000 * near);
    this.camera.updateProjectionMatrix();
  }
}

interface View {
  target: Vector3;
  position: Vector3;
}

/**
 * How far from the middle of a box a camera has to be, in a direction, that each corner is in its
 * field: a corner that is x to the side and z towards the camera is where x <= (distance - z) tan(field / 2).
 */
export function distanceToFit(box: Box3, direction: Vector3, field: number, aspect: number): number {
  const up = Math.tan(MathUtils.degToRad(field / 2));
  const right = new Vector3(0, 0, 1).cross(direction).normalize();
  const above = direction.clone().cross(right);
  const half = box.max.clone().sub(box.min).multiplyScalar(0.5);
  let distance = 0;
  for (const x of [-half.x, half.x]) {
    for (const y of [-half.y, half.y]) {
      for (const z of [-half.z, half.z]) {
        const corner = new Vector3(x, y, z);
        const aside = Math.max(Math.abs(corner.dot(right)) / (up * aspect), Math.abs(corner.dot(above)) / up);
        distance = Math.max(distance, aside + corner.dot(direction));
      }
    }
  }
  return distance;
}

// The camera: orbit, pan, zoom, and fitting a box into the view.
import { MathUtils, MOUSE, Vector3, type Box3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Vector } from "../state/scene";
import { cameraView, type CameraMove } from "../state/view";
import { ViewCamera } from "./view-camera";
import { between, DIRECTIONS, orbited, panned, seenFrom, zoomed, type View } from "./viewpoints";

/** Vertical field of view, degrees. */
const FIELD = 38;
/** Margin around a fitted box, since robots move, and buttons cover the edges. */
const MARGIN = 1.3;
/** Metres. */
const NEAREST = 0.05;
/** Duration of an animation, milliseconds. */
const FLIGHT = 260;
/** Depth of an orthographic picture in front of the camera and behind it, as a multiple of the target's distance. */
const FLAT_DEPTH = 60;

/** A camera with its controls. */
export class Camera {
  readonly camera = new ViewCamera(FIELD, 1, 0.01, 500);
  readonly controls: OrbitControls;
  /** Whether the user has moved it: from then on it is not fitted to new content. */
  movedByUser = false;
  /** Number of times that the user has begun to move it. */
  gestures = 0;
  /** Whether it has moved since its view was stored, except to fit new content. */
  private unsaved = false;
  private orthographic = false;
  private flight: { began: number; from: View; to: View } | null = null;

  /** `changed` is called if the scene must be drawn again. */
  constructor(canvas: HTMLElement, changed: () => void) {
    this.camera.up.set(0, 0, 1);
    this.camera.position.copy(DIRECTIONS.corner).multiplyScalar(3);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0, 0, 0.2);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.18;
    this.controls.zoomToCursor = true;
    this.controls.minDistance = 0.02;
    this.controls.maxDistance = 150;
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.PAN };
    this.controls.addEventListener("start", () => this.begin());
    this.controls.addEventListener("change", () => {
      this.unsaved ||= this.movedByUser;
      changed();
    });
    this.restore();
    this.controls.update();
    // The page may be reloaded before it is still.
    addEventListener("pagehide", this.leave);
  }

  /** The user begins to move it. */
  private begin(): void {
    this.movedByUser = true;
    this.gestures += 1;
    this.flight = null;
  }

  private readonly leave = (): void => {
    if (this.unsaved) this.store();
  };

  /** Keeps the view for a reload of the page. */
  private store(): void {
    this.unsaved = false;
    const { position, target } = this.view();
    cameraView.value = [position.toArray(), target.toArray()];
  }

  private restore(): void {
    const view = cameraView.peek();
    if (!view) return;
    this.camera.position.set(...view[0]);
    this.controls.target.set(...view[1]);
    this.movedByUser = true;
  }

  /**
   * Moves at once to a position, looking at a target: metres. The vertical field of view is in radians; 0 keeps it.
   */
  look(position: Vector, target: Vector, fieldOfView: number): void {
    this.movedByUser = true;
    this.gestures += 1;
    this.unsaved = true;
    this.flight = null;
    this.widen(fieldOfView);
    // Without damping, an update applies the rest of a drag, which would otherwise continue from there.
    this.controls.enableDamping = false;
    this.controls.update();
    this.controls.enableDamping = true;
    this.apply({ position: new Vector3(...position), target: new Vector3(...target) });
  }

  /** Sets the vertical field of view, radians; 0 keeps it. */
  widen(fieldOfView: number): void {
    if (fieldOfView <= 0) return;
    this.camera.fov = MathUtils.radToDeg(fieldOfView);
    this.camera.updateProjectionMatrix();
  }

  resize(width: number, height: number): void {
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
  }

  /** Moves along the present direction until all of a box is just in view. */
  fit(box: Box3, now: number, fly: boolean): void {
    // A program may have set another field of view.
    this.widen(MathUtils.degToRad(FIELD));
    const center = box.getCenter(new Vector3());
    const direction = this.camera.position.clone().sub(this.controls.target).normalize();
    const distance = MARGIN * Math.max(NEAREST, distanceToFit(box, direction, FIELD, this.camera.aspect));
    const to = { target: center, position: center.clone().addScaledVector(direction, distance) };
    this.unsaved ||= fly;
    this.go(to, now, fly);
  }

  /** Moves it by the user's key or button. */
  move(move: CameraMove, now: number): void {
    const present = this.flight?.to ?? this.view();
    this.begin();
    const size = present.position.distanceTo(present.target);
    switch (move.kind) {
      case "from":
        this.go(seenFrom(present, move.viewpoint), now, true);
        break;
      case "orbit":
        this.apply(orbited(present, move.right, move.up));
        break;
      case "pan":
        this.apply(panned(present, move.right * size, move.up * size));
        break;
      case "zoom":
        this.apply(zoomed(present, move.factor, this.controls.minDistance, this.controls.maxDistance));
        break;
    }
  }

  /** Moves it with the object that it follows, metres. */
  carry(shift: Vector3): void {
    for (const point of [this.camera.position, this.controls.target]) point.add(shift);
    for (const view of this.flight ? [this.flight.from, this.flight.to] : []) {
      view.position.add(shift);
      view.target.add(shift);
    }
  }

  /** Orthographic, or perspective. */
  setOrthographic(on: boolean): void {
    this.orthographic = on;
    // The controls compute the ray to the pointer only in perspective.
    this.controls.zoomToCursor = !on;
    this.limitDepth();
  }

  private go(to: View, now: number, fly: boolean): void {
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (fly && !calm) {
      this.flight = { began: now, from: this.view(), to };
    } else {
      this.flight = null;
      this.apply(to);
    }
  }

  /** Called for each frame. Returns whether it is still moving. */
  update(now: number): boolean {
    if (this.flight) {
      const { began, from, to } = this.flight;
      const t = Math.min(1, Math.max(0, (now - began) / FLIGHT));
      const share = t * t * (3 - 2 * t);
      this.apply(between(from, to, share));
      if (t >= 1) this.flight = null;
      return true;
    }
    const moving = this.controls.update();
    this.limitDepth();
    // Stored only after the damping has ended.
    if (!moving && this.unsaved) this.store();
    return moving;
  }

  isStill(): boolean {
    return this.flight === null;
  }

  /** The distance to the target, metres. */
  distance(): number {
    return this.camera.position.distanceTo(this.controls.target);
  }

  dispose(): void {
    removeEventListener("pagehide", this.leave);
    this.controls.dispose();
  }

  private view(): View {
    return { target: this.controls.target.clone(), position: this.camera.position.clone() };
  }

  private apply({ target, position }: View): void {
    this.controls.target.copy(target);
    this.camera.position.copy(position);
    this.controls.update();
    this.limitDepth();
  }

  /** Keeps the ratio of the depth range small, for the precision of the depth buffer. */
  private limitDepth(): void {
    const distance = this.distance();
    const near = Math.max(0.002, 0.02 * distance);
    const far = this.orthographic ? FLAT_DEPTH * distance : Math.max(60, 20_000 * near);
    const wasFlat = this.camera.isFlat;
    this.camera.flatten(this.orthographic ? distance * Math.tan(MathUtils.degToRad(this.camera.fov / 2)) : 0, far);
    if (this.orthographic) return;
    if (!wasFlat && Math.abs(near - this.camera.near) < 0.05 * near) return;
    this.camera.near = near;
    this.camera.far = far;
    this.camera.updateProjectionMatrix();
  }
}

/**
 * Returns the distance from a box's centre, in a direction, from which a camera has all its corners in view. A corner
 * that is x to the side and z towards the camera is in view if x <= (distance - z) tan(field / 2).
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

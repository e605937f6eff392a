// A perspective or orthographic camera: the same object, so that its holders need not know which.
import { PerspectiveCamera, Raycaster, Vector3, type Vector2 } from "three";

/** Perspective until `flatten` is called with a size. */
export class ViewCamera extends PerspectiveCamera {
  /** Half of the height of an orthographic picture, metres; 0 is perspective. */
  private half = 0;

  get isFlat(): boolean {
    return this.half > 0;
  }

  /**
   * Shows `half` metres above and below the axis, whatever their distance, and nothing farther than `depth` metres in front of
   * the camera and behind it. With 0 it is perspective again.
   */
  flatten(half: number, depth: number): void {
    if (half === this.half && (half === 0 || this.far === depth)) return;
    this.half = half;
    this.near = half > 0 ? -depth : this.near;
    this.far = depth;
    this.updateProjectionMatrix();
  }

  override updateProjectionMatrix(): void {
    // The constructor of the base class calls this before the size is set.
    if (!(this.half > 0)) {
      super.updateProjectionMatrix();
      return;
    }
    const width = this.half * this.aspect;
    this.projectionMatrix.makeOrthographic(-width, width, this.half, -this.half, this.near, this.far, this.coordinateSystem);
    this.projectionMatrixInverse.copy(this.projectionMatrix).invert();
  }
}

/** Sets a ray through a point of the picture; x and y from -1 to 1, y up. */
export function aim(raycaster: Raycaster, at: Vector2, camera: ViewCamera): Raycaster {
  if (!camera.isFlat) {
    raycaster.setFromCamera(at, camera);
    return raycaster;
  }
  camera.updateMatrixWorld();
  raycaster.camera = camera;
  raycaster.ray.origin.set(at.x, at.y, -1).unproject(camera);
  camera.getWorldDirection(raycaster.ray.direction);
  return raycaster;
}

/** Returns the position of a point of the world in the picture, x and y from -1 to 1; undefined behind the camera. */
export function projected(point: Vector3, camera: ViewCamera): Vector3 | undefined {
  const at = point.clone().project(camera);
  return at.z >= -1 && at.z <= 1 ? at : undefined;
}

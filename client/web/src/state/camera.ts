// Camera of this page, and the camera that programs request.
import { signal } from "@preact/signals";
import type { Vector } from "./scene";

/** Camera that programs request: world axes, metres. */
export interface CameraTarget {
  /** Increases with each request. */
  version: bigint;
  position: Vector;
  target: Vector;
  /** Vertical field of view, radians; 0 keeps the present one. */
  fieldOfView: number;
  /** Whether it was set before this page was opened. */
  isOld: boolean;
}

/** The newest request; null without one. */
export const cameraTarget = signal<CameraTarget | null>(null);

/** The camera of this page: world axes, metres, radians, CSS pixels. */
export interface ShownCamera {
  position: Vector;
  target: Vector;
  fieldOfView: number;
  width: number;
  height: number;
  /** Version of the newest `CameraTarget` that it has followed; 0 without one. */
  followed: bigint;
}

/** Camera of the last picture; null before the first picture. */
export const shownCamera = signal<ShownCamera | null>(null);

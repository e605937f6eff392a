// Where the camera of this page is, and where programs want it to be.
import { signal } from "@preact/signals";
import type { Vector } from "./scene";

/** Where programs want cameras to be: world axes, metres. */
export interface CameraTarget {
  /** Grows with each. */
  version: bigint;
  position: Vector;
  target: Vector;
  /** Vertical, radians; 0: as it is. */
  fieldOfView: number;
  /** It was set before this page was opened. */
  isOld: boolean;
}

/** The newest; null if there is none. */
export const cameraTarget = signal<CameraTarget | null>(null);

/** The camera of this page: world axes, metres, radians, CSS pixels. */
export interface ShownCamera {
  position: Vector;
  target: Vector;
  fieldOfView: number;
  width: number;
  height: number;
  /** Version of the newest `CameraTarget` that it has followed; 0: none. */
  followed: bigint;
}

/** As it was drawn last; null before the first picture. */
export const shownCamera = signal<ShownCamera | null>(null);

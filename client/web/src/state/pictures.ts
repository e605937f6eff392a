// Pictures of robots' cameras as the page shows them.
import { signal } from "@preact/signals";

/** A picture as the page draws it. */
export interface SensorPicture {
  width: number;
  height: number;
  /** Red, green, blue and opacity of each pixel, row by row from the upper left one. */
  pixels: Uint8ClampedArray<ArrayBuffer>;
  /** Time of the drawn state, simulated seconds. */
  time: number;
}

/** The newest picture of each camera of the robot in the panel, by the sensor's name. */
export const cameraPictures = signal<ReadonlyMap<string, SensorPicture>>(new Map());

/** Keeps the newest picture of a camera; undefined drops it. */
export function keepPicture(sensor: string, picture: SensorPicture | undefined): void {
  if (!picture && !cameraPictures.peek().has(sensor)) return;
  const kept = new Map(cameraPictures.peek());
  if (picture) kept.set(sensor, picture);
  else kept.delete(sensor);
  cameraPictures.value = kept;
}

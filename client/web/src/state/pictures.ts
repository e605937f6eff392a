// What the cameras of robots see, as the page shows it.

/** A picture as the page draws it. */
export interface SensorPicture {
  width: number;
  height: number;
  /** Red, green, blue and opacity of each pixel, row by row from the upper left one. */
  pixels: Uint8ClampedArray<ArrayBuffer>;
  /** Of the state that was drawn, simulated seconds. */
  time: number;
}

// Scale of the arrows of contacts: a bar in the corner of the picture, with the force of an arrow of this length.
import { MathUtils } from "three";
import { shortened } from "../panels/quantity";
import type { ViewCamera } from "./view-camera";

/** Length of the longest bar, CSS pixels. */
const LONGEST = 110;

/** Returns the largest of 1, 2 and 5 times a power of ten that does not exceed the value. */
export function roundBelow(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (value >= 5 * power ? 5 : value >= 2 * power ? 2 : 1);
}

export class ContactScale {
  private readonly bar = document.createElement("div");

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.bar.className = "contact-scale";
    this.bar.dataset["testid"] = "contact-scale";
    this.bar.hidden = true;
    canvas.after(this.bar);
  }

  /** Shows it for arrows of this many metres a newton, as seen at a distance in metres; 0 hides it. */
  show(metresPerNewton: number, camera: ViewCamera, distance: number): void {
    const pixelsPerMetre = this.canvas.clientHeight / (2 * distance * Math.tan(MathUtils.degToRad(camera.fov) / 2));
    const newtons = LONGEST / (pixelsPerMetre * metresPerNewton);
    const isShown = metresPerNewton > 0 && Number.isFinite(newtons) && newtons > 0;
    if (this.bar.hidden === isShown) this.bar.hidden = !isShown;
    if (!isShown) return;
    const round = roundBelow(newtons);
    const text = `${shortened(round)} N`;
    if (this.bar.textContent !== text) this.bar.textContent = text;
    this.bar.style.width = `${round * metresPerNewton * pixelsPerMetre}px`;
  }

  dispose(): void {
    this.bar.remove();
  }
}

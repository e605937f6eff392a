// Names beside points of the scene, as text of the page: sharp at any size, and in the page's colours.
import { Vector3 } from "three";
import { projected, type ViewCamera } from "./view-camera";

/** Maximum number of shown names. */
const MAX = 200;

/** A name, and its position. */
export interface Label {
  text: string;
  /** World axes. */
  at: Vector3;
}

/** A layer over the canvas. Screen readers skip it: the panel has the same names. */
export class Labels {
  private readonly layer = document.createElement("div");
  private readonly texts: HTMLElement[] = [];

  constructor(private readonly canvas: HTMLElement) {
    this.layer.className = "scene-labels";
    this.layer.setAttribute("aria-hidden", "true");
    canvas.after(this.layer);
  }

  /** Shows exactly these. */
  show(labels: readonly Label[], camera: ViewCamera): void {
    const [width, height] = labels.length > 0 ? [this.canvas.clientWidth, this.canvas.clientHeight] : [0, 0];
    let shown = 0;
    for (const { text, at } of labels.slice(0, MAX)) {
      const place = projected(at, camera);
      if (!place || Math.abs(place.x) > 1 || Math.abs(place.y) > 1) continue;
      const element = this.texts[shown] ?? this.add();
      if (element.textContent !== text) element.textContent = text;
      element.style.transform = `translate(${((place.x + 1) * width) / 2}px, ${((1 - place.y) * height) / 2}px)`;
      element.hidden = false;
      shown += 1;
    }
    for (const element of this.texts.slice(shown)) element.hidden = true;
  }

  dispose(): void {
    this.layer.remove();
  }

  private add(): HTMLElement {
    const element = document.createElement("span");
    element.className = "scene-label";
    this.layer.append(element);
    this.texts.push(element);
    return element;
  }
}

// Small views of the same scene from the front, the left and above, over the picture: orthographic, with the camera's target.
import { MathUtils, Vector2, type Scene, type WebGLRenderer } from "three";
import { moveCamera, type Viewpoint } from "../state/view";
import type { Camera } from "./camera";
import { ViewCamera } from "./view-camera";
import { DIRECTIONS } from "./viewpoints";

const VIEWS: readonly { viewpoint: Viewpoint; label: string; keys: string }[] = [
  { viewpoint: "front", label: "front", keys: "X" },
  { viewpoint: "left", label: "left", keys: "Y" },
  { viewpoint: "top", label: "top", keys: "Z" },
];

/** CSS pixels: gap between the views and around them, and the width of pages on which they are side by side. */
const GAP = 8;
const NARROW = 620;
/** Size as a share of the picture's height, and its maximum in CSS pixels. */
const SHARE = 0.27;
const MAX_WIDTH = 240;
/** Ratio of width to height. */
const SHAPE = 4 / 3;
/** Extent in front of the camera and behind it, as a multiple of the distance to its target. */
const DEPTH = 60;

/** A view's place on the canvas, CSS pixels from its upper left corner. */
export interface Place {
  left: number;
  top: number;
  width: number;
  height: number;
}

/** Below each other at the right, or side by side at the top if space is short. */
export function places(width: number, height: number): Place[] {
  const isNarrow = width < NARROW;
  const high = isNarrow ? (width - GAP * (VIEWS.length + 1)) / VIEWS.length / SHAPE : Math.min(MAX_WIDTH, SHARE * height);
  const wide = SHAPE * high;
  return VIEWS.map((_, index) =>
    isNarrow
      ? { left: GAP + index * (wide + GAP), top: GAP, width: wide, height: high }
      : { left: width - GAP - wide, top: GAP + index * (high + GAP), width: wide, height: high },
  );
}

/** The views, each with a frame that is a button: pressed, the camera looks from that side. */
export class SideViews {
  private readonly layer = document.createElement("div");
  private readonly frames: HTMLElement[];
  private readonly camera = new ViewCamera(38, SHAPE, 0.01, 500);

  constructor(canvas: HTMLCanvasElement) {
    this.layer.className = "side-views";
    this.layer.setAttribute("role", "group");
    this.layer.setAttribute("aria-label", "Views from the sides");
    this.frames = VIEWS.map(({ viewpoint, label, keys }) => {
      const frame = document.createElement("button");
      frame.type = "button";
      frame.textContent = label;
      frame.title = `Look from the ${viewpoint} (${keys})`;
      frame.dataset["testid"] = `side-${viewpoint}`;
      frame.addEventListener("click", () => moveCamera({ kind: "from", viewpoint }));
      return frame;
    });
    this.layer.append(...this.frames);
    // Added after the elements that it covers.
    canvas.parentElement?.append(this.layer);
    this.camera.up.set(0, 0, 1);
  }

  /** Draws the views over the picture. */
  draw(renderer: WebGLRenderer, scene: Scene, { camera, controls }: Camera): void {
    const size = renderer.getSize(new Vector2());
    const away = camera.position.distanceTo(controls.target);
    const half = away * Math.tan(MathUtils.degToRad(camera.fov) / 2);
    // Shadows stay as in the picture.
    renderer.shadowMap.autoUpdate = false;
    renderer.setScissorTest(true);
    places(size.x, size.y).forEach(({ left, top, width, height }, index) => {
      const view = VIEWS[index];
      if (!view) return;
      const below = size.y - top - height;
      renderer.setViewport(left, below, width, height);
      renderer.setScissor(left, below, width, height);
      this.camera.position.copy(controls.target).addScaledVector(DIRECTIONS[view.viewpoint], away);
      this.camera.lookAt(controls.target);
      this.camera.flatten(half, DEPTH * away);
      renderer.render(scene, this.camera);
      const { style } = this.frames[index] ?? this.layer;
      style.transform = `translate(${left}px, ${top}px)`;
      style.width = `${width}px`;
      style.height = `${height}px`;
    });
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, size.x, size.y);
    renderer.shadowMap.autoUpdate = true;
  }

  dispose(): void {
    this.layer.remove();
  }
}

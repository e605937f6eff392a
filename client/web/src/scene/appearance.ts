// Quality of the picture: light, shadows, reflections, ambient occlusion and pixels, by the user's choice or by the frame rate.
import type { Scene, WebGLRenderer, WebGLRenderTarget } from "three";
import { pictureInterval } from "../state/picture";
import type { Quality } from "../state/view";
import type { AmbientOcclusion } from "./ambient-occlusion";
import { isSoftware } from "./drawing-context";
import { FrameTimes } from "./frame-times";
import type { Grid } from "./grid";
import type { Light } from "./light";
import { lightAtCorners } from "./surface";
import type { ViewCamera } from "./view-camera";

/** Upper bounds of device pixels per CSS pixel. */
const MAX_PIXEL_RATIO = 2;
const LOW_PIXEL_RATIO = 1;
/** Share of a side's pixels that is drawn while something moves and full pictures come too slowly. */
const COARSE = 0.5;
/** Number of pictures after which slowness is known: it is visible at once. */
const FEW = 6;
/** Intensity of the room's light, in addition to the sun and the sky. */
const ROOM_INTENSITY = 0.26;

/** Applies a quality to the scene. */
export class Appearance {
  private readonly times = new FrameTimes();
  private readonly lowTimes = new FrameTimes(FEW);
  /** "auto" has found that pictures come too slowly, or that the processor draws them. */
  private isSlow: boolean;
  private choice: Quality = "auto";
  private room: WebGLRenderTarget | undefined;
  private isLoading = false;
  /** "auto" has found whether the time suffices for ambient occlusion. */
  private occludes: "unknown" | "yes" | "no" = "unknown";
  private occlusion: AmbientOcclusion | undefined;
  private isLoadingOcclusion = false;
  /** Pictures of low quality came too slowly, too. */
  private halves = false;
  private disposed = false;

  /** `changed` is called if the picture must be drawn again. */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly scene: Scene,
    private readonly light: Light,
    private readonly grid: Grid,
    private readonly camera: ViewCamera,
    private readonly changed: () => void,
  ) {
    this.isSlow = isSoftware(renderer.getContext());
    scene.environmentIntensity = ROOM_INTENSITY;
  }

  /** Quality of the current picture. */
  get quality(): "low" | "high" {
    if (this.choice !== "auto") return this.choice;
    return this.isSlow ? "low" : "high";
  }

  /** Whether nothing is being loaded. */
  isComplete(): boolean {
    return !this.isLoading && !this.isLoadingOcclusion;
  }

  /** Whether gaps and edges are darkened. */
  get hasOcclusion(): boolean {
    // In orthographic pictures the pass does not know depths behind the camera.
    return this.wantsOcclusion() && this.occlusion !== undefined && !this.camera.isFlat;
  }

  /** Draws the picture; the camera's target is this many metres away. Returns the number of calls that draw the scene. */
  draw(distance: number): number {
    this.renderer.render(this.scene, this.camera);
    const { calls } = this.renderer.info.render;
    if (this.hasOcclusion) this.occlusion?.darken(this.renderer, distance);
    return calls;
  }

  /** Sets the device pixels per CSS pixel of a picture with or without motion. Returns whether they are fewer than in a still one. */
  setPixels(moves = false): boolean {
    const isCoarse = moves && this.halves && this.quality === "low";
    const full = Math.min(this.quality === "high" ? MAX_PIXEL_RATIO : LOW_PIXEL_RATIO, devicePixelRatio);
    const ratio = isCoarse ? COARSE * full : full;
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    return isCoarse;
  }

  /** Applies the user's choice. "auto" begins again, unless the processor draws. */
  choose(choice: Quality): void {
    if (choice !== this.choice) {
      this.isSlow = isSoftware(this.renderer.getContext());
      this.halves = false;
      this.lowTimes.forget();
      this.occludes = "unknown";
      this.times.forget();
    }
    this.choice = choice;
    this.apply();
  }

  /** Takes an animation frame: see `FrameTimes.take`. */
  measure(at: number, drew: boolean, goesOn: boolean): void {
    const times = this.quality === "low" ? this.lowTimes : this.times;
    times.take(at, drew, goesOn);
    pictureInterval.value = times.median() ?? 0;
    if (times === this.lowTimes) {
      this.halves ||= times.isSlow();
      return;
    }
    if (this.choice !== "auto") return;
    // The effect that was drawn last is left out first.
    if (this.occludes === "unknown" && this.times.isFast()) this.occludes = "yes";
    else if (this.occludes === "yes" && this.hasOcclusion && this.times.isLate()) this.occludes = "no";
    else if (this.times.isSlow()) this.isSlow = true;
    else return;
    this.times.forget();
    this.apply();
  }

  /** Draws again what the graphics processor has lost: three.js restores everything except textures that it has rendered. */
  restored(): void {
    this.forget();
    this.apply();
  }

  dispose(): void {
    this.disposed = true;
    this.forget();
  }

  private forget(): void {
    this.room?.dispose();
    this.occlusion?.dispose();
    this.room = this.occlusion = undefined;
  }

  private wantsOcclusion(): boolean {
    return this.quality === "high" && (this.choice === "high" || this.occludes === "yes");
  }

  private apply(): void {
    const isHigh = this.quality === "high";
    if (isHigh && !this.room) void this.load();
    if (this.wantsOcclusion() && !this.occlusion) void this.loadOcclusion();
    this.scene.environment = isHigh ? (this.room?.texture ?? null) : null;
    this.light.refine(isHigh, this.scene.environment !== null);
    lightAtCorners(!isHigh, this.scene);
    this.grid.simplify(!isHigh);
    this.setPixels();
    this.changed();
  }

  private async load(): Promise<void> {
    if (this.isLoading) return;
    this.isLoading = true;
    try {
      const { roomOf } = await import("./environment");
      if (this.disposed) return;
      this.room = roomOf(this.renderer);
    } catch {
      // The code is no longer reachable: without reflections.
      return;
    } finally {
      this.isLoading = false;
    }
    this.apply();
  }

  private async loadOcclusion(): Promise<void> {
    if (this.isLoadingOcclusion) return;
    this.isLoadingOcclusion = true;
    try {
      const { AmbientOcclusion } = await import("./ambient-occlusion");
      if (this.disposed) return;
      this.occlusion = new AmbientOcclusion(this.scene, this.camera);
    } catch {
      // The code is no longer reachable: without ambient occlusion.
      return;
    } finally {
      this.isLoadingOcclusion = false;
    }
    this.times.forget();
    this.changed();
  }
}

// How fine the picture is: shadows, reflections and pixels, by the choice of the user or by how fast pictures come.
import type { Scene, Texture, WebGLRenderer } from "three";
import type { Quality } from "../state/view";
import { FrameTimes } from "./frame-times";
import type { Light } from "./light";

/** Upper bounds of device pixels per CSS pixel. */
const MAX_PIXEL_RATIO = 2;
const LOW_PIXEL_RATIO = 1;
/** Of the light of the room, beside the sun and the sky. */
const ROOM_INTENSITY = 0.26;

/** Applies a quality to the scene. */
export class Appearance {
  private readonly times = new FrameTimes();
  /** "auto" has found that pictures come too slowly, or are drawn by the processor. */
  private isSlow: boolean;
  private choice: Quality = "auto";
  private room: Texture | undefined;
  private isLoading = false;
  private disposed = false;

  /** `changed` is called when the picture is to be drawn again. */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly scene: Scene,
    private readonly light: Light,
    private readonly changed: () => void,
  ) {
    this.isSlow = isSoftware(renderer);
    scene.environmentIntensity = ROOM_INTENSITY;
  }

  /** What is drawn now. */
  get quality(): "low" | "high" {
    if (this.choice !== "auto") return this.choice;
    return this.isSlow ? "low" : "high";
  }

  /** Whether nothing is being loaded. */
  isComplete(): boolean {
    return !this.isLoading;
  }

  /** Sets the device pixels per CSS pixel. */
  setPixels(): void {
    const ratio = Math.min(this.quality === "high" ? MAX_PIXEL_RATIO : LOW_PIXEL_RATIO, devicePixelRatio);
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
  }

  /** Draws as the user wants it. "auto" begins anew, unless no graphics processor draws. */
  choose(choice: Quality): void {
    if (choice !== this.choice) {
      this.isSlow = isSoftware(this.renderer);
      this.times.forget();
    }
    this.choice = choice;
    this.apply();
  }

  /** Takes an animation frame: see `FrameTimes.take`. */
  measure(at: number, drew: boolean, goesOn: boolean): void {
    if (this.quality === "low") return;
    this.times.take(at, drew, goesOn);
    if (this.choice !== "auto" || !this.times.isSlow()) return;
    this.isSlow = true;
    this.apply();
  }

  dispose(): void {
    this.disposed = true;
    this.room?.dispose();
  }

  private apply(): void {
    const isHigh = this.quality === "high";
    if (isHigh && !this.room) void this.load();
    this.scene.environment = isHigh ? (this.room ?? null) : null;
    this.light.refine(isHigh, this.scene.environment !== null);
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
      // Not reachable any more: without reflections.
      return;
    } finally {
      this.isLoading = false;
    }
    this.apply();
  }
}

/** Whether the processor draws, as far as the browser says. */
function isSoftware(renderer: WebGLRenderer): boolean {
  const context = renderer.getContext();
  const names = [context.getParameter(context.RENDERER) as unknown];
  const extension = context.getExtension("WEBGL_debug_renderer_info");
  if (extension) names.push(context.getParameter(extension.UNMASKED_RENDERER_WEBGL) as unknown);
  return names.some((name) => typeof name === "string" && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name));
}

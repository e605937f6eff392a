// Handles in the picture that move robots, ends of arms and joints; their code is loaded on first use.
import { effect } from "@preact/signals";
import type { Scene } from "three";
import type { Gizmo } from "../build/gizmo";
import { placing, placingMode } from "../state/tools";
import { toast } from "../state/toasts";
import type { Camera } from "./camera";
import type { RobotViews } from "./robot-views";

/** Parts of the scene that handles need. */
export interface HandleScene {
  scene: Scene;
  camera: Camera;
  canvas: HTMLCanvasElement;
  robots: RobotViews;
  /** Requests a picture. */
  changed: () => void;
}

/** The handles of one scene, once they are loaded. */
export class Handles {
  private gizmo: Gizmo | null = null;
  private disposed = false;
  private readonly end: () => void;

  constructor(private readonly at: HandleScene) {
    this.end = effect(() => {
      const [wanted, mode] = [placing.value, placingMode.value];
      if (wanted && !this.gizmo) void this.load();
      this.gizmo?.place(wanted, mode);
      this.at.changed();
    });
  }

  /** Called for each picture, before it is drawn: handles move with their object. */
  update(): void {
    this.gizmo?.update();
  }

  dispose(): void {
    this.disposed = true;
    this.end();
    this.gizmo?.dispose();
  }

  private async load(): Promise<void> {
    try {
      const { Gizmo } = await import("../build/gizmo");
      if (this.disposed || this.gizmo) return;
      this.gizmo = new Gizmo(this.at);
      this.gizmo.place(placing.peek(), placingMode.peek());
      this.at.changed();
    } catch {
      placing.value = null;
      toast("error", "The handles could not be loaded from the daemon; place it again once it answers.");
    }
  }
}

// All robots as they are drawn, kept to what the daemon says there is.
import { Box3, Group, Sphere, Vector3 } from "three";
import type { RobotScene } from "../state/scene";
import type { LinkName } from "../state/view";
import { Meshes } from "./meshes";
import type { Motion } from "./motion";
import { Paints } from "./paint";
import { RobotView, type Shown } from "./robot";

/** Axes of links are this part of their robot's size. */
const AXIS_SHARE = 0.18;

/** The views of robots, by name. */
export class Robots {
  readonly group = new Group();
  readonly paints = new Paints();
  readonly meshes = new Meshes();
  private readonly views = new Map<string, RobotView>();
  private readonly poses = new Map<string, Float64Array>();
  private shown: Shown = { visuals: true, collisions: false, frames: false };

  /** `grown` is called when a mesh has come. */
  constructor(private readonly grown: () => void) {}

  all(): Iterable<RobotView> {
    return this.views.values();
  }

  get(name: string): RobotView | undefined {
    return this.views.get(name);
  }

  /** Makes what is new, and lets go of what is gone. */
  keep(scenes: ReadonlyMap<string, RobotScene>): void {
    for (const [name, view] of this.views) {
      if (scenes.get(name) === view.scene) continue;
      view.dispose();
      this.views.delete(name);
      this.poses.delete(name);
    }
    for (const [name, scene] of scenes) {
      if (this.views.has(name)) continue;
      const view = new RobotView(scene, this.meshes, this.paints, this.grown);
      this.views.set(name, view);
      this.poses.set(name, new Float64Array(7 * scene.links.length));
      this.group.add(view.group);
      this.showOne(view);
    }
  }

  /** Places all links as they are at `now`. Answers whether any moved. */
  pose(motion: Motion, now: number): boolean {
    let moved = false;
    for (const [name, view] of this.views) {
      const poses = this.poses.get(name);
      if (poses && motion.sample(name, now, poses)) moved = view.pose(poses) || moved;
    }
    return moved;
  }

  /** Whether it is known of each where it is. */
  arePosed(): boolean {
    return [...this.views.values()].every((view) => view.isPosed());
  }

  show(shown: Shown): void {
    this.shown = shown;
    for (const view of this.views.values()) this.showOne(view);
  }

  /** Lights up one link and no other. Answers whether that changed anything. */
  highlight(link: LinkName | null): boolean {
    let changed = false;
    for (const [name, view] of this.views) {
      const index = link?.robot === name ? view.scene.links.findIndex((each) => each.name === link.link) : -1;
      changed = view.highlight(index) || changed;
    }
    return changed;
  }

  hasPlane(): boolean {
    const isPlane = (view: RobotView) => view.scene.visuals.some((shape) => shape.geometry.kind === "plane");
    return [...this.views.values()].some(isPlane);
  }

  /** Around one robot, or all; planes do not count. */
  bounds(name = ""): Box3 {
    const box = new Box3();
    const one = this.views.get(name);
    for (const view of one ? [one] : this.views.values()) box.union(view.bounds());
    // A plane alone is looked at where the world begins.
    return box.isEmpty() ? new Box3(new Vector3(-0.5, -0.5, 0), new Vector3(0.5, 0.5, 0.5)) : box;
  }

  /** Metres: the radius of what there is. */
  size(): number {
    return this.bounds().getBoundingSphere(new Sphere()).radius;
  }

  dispose(): void {
    this.keep(new Map());
    this.paints.dispose();
  }

  private showOne(view: RobotView): void {
    const box = view.bounds();
    const size = box.isEmpty() ? 1 : box.getBoundingSphere(new Sphere()).radius;
    view.show(this.shown, AXIS_SHARE * size);
  }
}

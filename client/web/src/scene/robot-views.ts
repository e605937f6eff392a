// The drawings of all robots, kept up to date with the scenes.
import { Box3, Group, type Matrix4, Sphere, Vector3 } from "three";
import type { Rgba, RobotColors } from "../state/markers";
import type { RobotScene } from "../state/scene";
import type { LinkName } from "../state/view";
import { radiusOf } from "./extent";
import { MeshCache } from "./mesh-cache";
import type { PoseInterpolator } from "./pose-interpolator";
import { Materials } from "./materials";
import { RobotView, type Shown } from "./robot-view";
import { framed, isFlatGround, isGround } from "./scenery";

/** Length of the axes of links, as a fraction of the size of the robot. */
const AXIS_FRACTION = 0.18;

const NONE: ReadonlyMap<string, Rgba> = new Map();

/** The views of robots, by name. */
export class RobotViews {
  readonly group = new Group();
  readonly materials: Materials;
  readonly meshes = new MeshCache();
  private readonly views = new Map<string, RobotView>();
  private readonly poses = new Map<string, Float64Array>();
  private radii = new WeakMap<RobotView, number>();
  private hidden: ReadonlySet<string> = new Set();
  private shown: Shown = { visuals: true, collisions: false, frames: false };

  /** `changed` is called when a mesh or a picture was loaded. */
  constructor(private readonly changed: () => void) {
    this.materials = new Materials(changed);
  }

  /** Returns the visible ones: none while a recording is shown alone. */
  all(): Iterable<RobotView> {
    return this.group.visible ? [...this.views.values()].filter(({ group }) => group.visible) : [];
  }

  /** Shows all robots but these. */
  hide(names: ReadonlySet<string>): void {
    this.hidden = names;
    for (const [name, view] of this.views) view.group.visible = !names.has(name);
  }

  get(name: string): RobotView | undefined {
    return this.views.get(name);
  }

  /** Returns world_from_link of a link as drawn, or of the root if the name is empty. */
  readonly worldFromLink = (robot: string, link: string): Matrix4 | undefined => {
    const view = this.views.get(robot);
    const index = link === "" ? 0 : (view?.scene.links.findIndex(({ name }) => name === link) ?? -1);
    return view?.scene.links[index] && view.worldFromLink(index);
  };

  /** Returns the radius of a robot in metres as first measured: marks keep their size while it moves. */
  readonly radiusOf = (view: RobotView): number => {
    const radius = this.radii.get(view) ?? radiusOf(view.bounds());
    this.radii.set(view, radius);
    return radius;
  };

  /** Measures radii again: the content has changed. */
  forgetRadii(): void {
    this.radii = new WeakMap();
  }

  /** Whether no mesh and no picture is being loaded. */
  areLoaded(): boolean {
    return this.meshes.isComplete() && this.materials.isComplete();
  }

  /** Creates views of new scenes, and disposes of those that are gone. */
  sync(scenes: ReadonlyMap<string, RobotScene>): void {
    for (const [name, view] of this.views) {
      if (scenes.get(name) === view.scene) continue;
      view.dispose();
      this.views.delete(name);
      this.poses.delete(name);
    }
    for (const [name, scene] of scenes) {
      if (this.views.has(name)) continue;
      const view = new RobotView(scene, this.meshes, this.materials, this.changed);
      this.views.set(name, view);
      this.poses.set(name, new Float64Array(7 * scene.links.length));
      this.group.add(view.group);
      view.group.visible = !this.hidden.has(name);
      this.showOne(view);
    }
  }

  /** Sets the poses of all links at `now`. Returns whether any moved. */
  pose(interpolator: PoseInterpolator, now: number): boolean {
    let moved = false;
    for (const [name, view] of this.views) {
      const poses = this.poses.get(name);
      if (poses && interpolator.sample(name, now, poses)) moved = view.pose(poses) || moved;
    }
    return moved;
  }

  /** Whether all links have a pose. */
  arePosed(): boolean {
    return [...this.views.values()].every((view) => view.isPosed());
  }

  show(shown: Shown): void {
    this.shown = shown;
    for (const view of this.views.values()) this.showOne(view);
  }

  /** Gives links the colours that programs have given them. */
  color(colors: ReadonlyMap<string, RobotColors>): void {
    for (const [name, view] of this.views) {
      const given = colors.get(name);
      view.color(given && given.layoutVersion === view.scene.layoutVersion ? given.links : NONE);
    }
  }

  /** Highlights one link and no other. Returns whether that changed anything. */
  highlight(link: LinkName | null): boolean {
    let changed = false;
    for (const [name, view] of this.views) {
      const index = link?.robot === name ? view.scene.links.findIndex((each) => each.name === link.link) : -1;
      changed = view.highlight(index) || changed;
    }
    return changed;
  }

  /** Draws ground as such, once its meshes are loaded. Returns whether robots can stand anywhere. */
  findGround(): boolean {
    let found = false;
    for (const view of this.views.values()) {
      const box = view.bounds();
      if (isFlatGround(view.scene, box)) view.layFlat();
      found ||= isGround(view.scene, box);
    }
    return found;
  }

  /** Returns the bounding box of one robot, or of the first view. */
  bounds(name = ""): Box3 {
    const one = this.views.get(name);
    const views = one ? [one] : [...this.views.values()].filter(({ group }) => group.visible);
    const things = views.map((view) => ({ scene: view.scene, box: view.bounds() }));
    const box = framed(things);
    // If only ground exists, the origin is shown.
    return box.isEmpty() ? new Box3(new Vector3(-0.5, -0.5, 0), new Vector3(0.5, 0.5, 0.5)) : box;
  }

  /** The radius of the bounding sphere, metres. */
  size(): number {
    return this.bounds().getBoundingSphere(new Sphere()).radius;
  }

  dispose(): void {
    this.sync(new Map());
    this.materials.dispose();
  }

  private showOne(view: RobotView): void {
    const box = view.bounds();
    const size = box.isEmpty() ? 1 : box.getBoundingSphere(new Sphere()).radius;
    view.show(this.shown, AXIS_FRACTION * size);
  }
}

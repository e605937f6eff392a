// Robots of a recording: translucent next to the live ones, or opaque if those are hidden.
import { Box3, Group } from "three";
import type { Ghosts } from "../state/playback";
import type { MeshCache } from "./mesh-cache";
import type { Materials } from "./materials";
import { GHOST } from "./palette";
import { RobotView } from "./robot-view";
import { Surface } from "./surface";

/** Their views, by name. */
export class GhostViews {
  readonly group = new Group();
  private readonly views = new Map<string, RobotView>();
  /** Drawn in front of a live robot at the same place. */
  private readonly paint = new Surface({ color: GHOST, transparent: true, opacity: 0.45, roughness: 0.8, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 });
  private alone = false;

  /** `changed` is called when a mesh was loaded. */
  constructor(
    private readonly meshes: MeshCache,
    private readonly materials: Materials,
    private readonly changed: () => void,
  ) {}

  /** Draws exactly these robots. Returns whether any came or went. */
  show(ghosts: Ghosts | null, alone: boolean): boolean {
    let changed = false;
    for (const [name, view] of this.views) {
      if (alone === this.alone && ghosts?.scenes.get(name) === view.scene) continue;
      view.dispose();
      this.views.delete(name);
      changed = true;
    }
    this.alone = alone;
    for (const [name, scene] of ghosts?.scenes ?? []) {
      let view = this.views.get(name);
      if (!view) {
        view = new RobotView(scene, this.meshes, this.materials, this.changed, alone ? undefined : this.paint);
        this.views.set(name, view);
        this.group.add(view.group);
        changed = true;
      }
      const poses = ghosts?.poses.get(name);
      if (poses) view.pose(poses);
    }
    return changed;
  }

  /** Returns world_from_link as drawn: x y z, then the quaternion x y z w. */
  pose(robot: string, link: string): number[] | undefined {
    const view = this.views.get(robot);
    const index = view?.scene.links.findIndex(({ name }) => name === link) ?? -1;
    return view && index >= 0 ? view.drawnPose(index) : undefined;
  }

  /** Empty without any. */
  bounds(): Box3 {
    const box = new Box3();
    for (const view of this.views.values()) box.union(view.bounds());
    return box;
  }

  dispose(): void {
    this.show(null, this.alone);
    this.paint.dispose();
  }
}

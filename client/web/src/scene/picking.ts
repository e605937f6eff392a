// Picking of the link under the pointer.
import { Raycaster, Vector2, type Object3D, type Vector3 } from "three";
import { COPIED } from "./copies";
import type { RobotView } from "./robot-view";
import { aim, type ViewCamera } from "./view-camera";

/** A point on a link. */
export interface Hit {
  view: RobotView;
  /** Index of the link. */
  link: number;
  /** World axes. */
  point: Vector3;
}

const raycaster = new Raycaster();
raycaster.layers.enable(COPIED);

/** Returns the ray of the camera through a point of the canvas; x and y from -1 to 1, y up. */
export function pickRay(at: Vector2, camera: ViewCamera): Raycaster {
  return aim(raycaster, at, camera);
}

/** Returns the nearest link on that ray. */
export function pick(at: Vector2, camera: ViewCamera, views: Iterable<RobotView>): Hit | undefined {
  const ray = pickRay(at, camera);
  let nearest: Hit | undefined;
  let distance = Infinity;
  for (const view of views) {
    const [first] = ray.intersectObjects(view.targets(), true);
    if (!first || first.distance >= distance) continue;
    const link = linkOf(first.object);
    if (link === undefined) continue;
    distance = first.distance;
    nearest = { view, link, point: first.point };
  }
  return nearest;
}

function linkOf(object: Object3D): number | undefined {
  for (let at: Object3D | null = object; at; at = at.parent) {
    const link: unknown = at.userData["link"];
    if (typeof link === "number") return link;
  }
  return undefined;
}

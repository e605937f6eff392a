// Where a loaded robot is spawned: beside the others, since robots that overlap are separated by contact forces.
import type { RobotScene } from "../state/scene";
import type { Frame } from "../state/world";

/** Metres between the links of other robots and the new one, whose size is not known yet. */
const DISTANCE = 1;

/** world_from_root of the next robot: the origin of an empty world, else to the left of all, along y. */
export function nextSpawnPosition(scenes: ReadonlyMap<string, RobotScene>, frame: Frame | null): { x: number; y: number; z: number } {
  let left = -Infinity;
  for (const [name, scene] of scenes) {
    // Planes are the ground.
    if (scene.collisions.some((shape) => shape.geometry.kind === "plane")) continue;
    const poses = frame?.poses.get(name) ?? [];
    for (let at = 1; at < poses.length; at += 7) left = Math.max(left, poses[at] ?? left);
  }
  return { x: 0, y: Number.isFinite(left) ? left + DISTANCE : 0, z: 0 };
}

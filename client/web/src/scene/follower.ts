// Moves the camera with a robot.
import { Vector3 } from "three";
import type { Camera } from "./camera";
import type { RobotViews } from "./robot-views";

/** Keeps the position of the followed robot's root. */
export class Follower {
  private name = "";
  private before: Vector3 | null = null;

  /**
   * Called for each frame, with the name of the robot, which may be gone or empty. Returns whether the camera moved.
   */
  update(name: string, robots: RobotViews, camera: Camera): boolean {
    const [x, y, z] = robots.get(name)?.drawnPose(0) ?? [];
    if (x === undefined || y === undefined || z === undefined) {
      this.before = null;
      return false;
    }
    const now = new Vector3(x, y, z);
    // The start is its position when it is chosen: only its motion counts.
    const shift = this.name === name && this.before ? now.clone().sub(this.before) : new Vector3();
    this.name = name;
    this.before = now;
    if (shift.lengthSq() === 0) return false;
    camera.carry(shift);
    return true;
  }
}

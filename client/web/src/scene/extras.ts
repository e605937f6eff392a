// What is in the picture beside robots and their marks: handles, and points that sensors have met.
import { Handles, type HandleScene } from "./handles";
import { LidarPoints } from "./lidar-points";

export class Extras {
  readonly points: LidarPoints;
  private readonly handles: Handles;

  constructor(at: HandleScene) {
    this.handles = new Handles(at);
    this.points = new LidarPoints(at.robots, at.changed);
    at.scene.add(this.points.group);
  }

  /** Called for each picture, before it is drawn. */
  update(): void {
    this.handles.update();
    this.points.update();
  }

  dispose(): void {
    this.handles.dispose();
    this.points.dispose();
  }
}

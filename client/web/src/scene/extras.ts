// Parts of the picture other than robots and their marks: handles, points of lidars, and camera pictures.
import { CameraPictures } from "./camera-pictures";
import { Handles, type HandleScene } from "./handles";
import { LidarPoints } from "./lidar-points";

export class Extras {
  readonly points: LidarPoints;
  readonly pictures: CameraPictures;
  private readonly handles: Handles;

  constructor(at: HandleScene) {
    this.handles = new Handles(at);
    this.points = new LidarPoints(at.robots, at.changed);
    this.pictures = new CameraPictures(at.robots, at.changed);
    at.scene.add(this.points.group, this.pictures.group);
  }

  /** Called for each picture, before it is drawn. */
  update(): void {
    this.handles.update();
    this.points.update();
    this.pictures.update();
  }

  dispose(): void {
    this.handles.dispose();
    this.points.dispose();
    this.pictures.dispose();
  }
}

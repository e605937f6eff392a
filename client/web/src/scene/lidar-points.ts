// Points that lidars and range finders of the robot in the panel have measured.
import { effect } from "@preact/signals";
import { BufferAttribute, BufferGeometry, Group, Points, PointsMaterial, Quaternion, Vector3 } from "three";
import type { Pose } from "../state/scene";
import { readings, sensors, sensorsShownOf, type Scan, type Sensor } from "../state/sensors";
import { pointsShown } from "../state/view";
import type { RobotViews } from "./robot-views";

/** CSS pixels. */
const SIZE = 3;
const COLOR = 0xe11d48;

/** Returns directions of the rays of a scan, in the sensor's frame: row by row from the least vertical angle on. */
export function rayOf({ horizontal, vertical }: Scan, index: number): Vector3 {
  const columns = Math.max(1, horizontal.samples);
  const angle = ({ samples, min, max }: Scan["horizontal"], at: number): number => (samples > 1 ? min + ((max - min) * at) / (samples - 1) : min);
  const [turn, up] = [angle(horizontal, index % columns), angle(vertical, Math.floor(index / columns))];
  return new Vector3(Math.cos(up) * Math.cos(turn), Math.cos(up) * Math.sin(turn), Math.sin(up));
}

/**
 * Returns the end points of a reading's rays in the link's frame, three numbers a point. Rays without a hit have
 * none.
 */
export function pointsOf(scan: Scan, linkFromSensor: Pose, ranges: readonly number[]): Float32Array<ArrayBuffer> {
  const [x, y, z, qx, qy, qz, qw] = linkFromSensor;
  const turn = new Quaternion(qx, qy, qz, qw);
  const points = new Float32Array(3 * ranges.length);
  let count = 0;
  ranges.forEach((range, index) => {
    if (!Number.isFinite(range)) return;
    const at = rayOf(scan, index).multiplyScalar(range).applyQuaternion(turn);
    points.set([x + at.x, y + at.y, z + at.z], count);
    count += 3;
  });
  return points.slice(0, count);
}

/** The points of all such sensors of one robot. */
export class LidarPoints {
  readonly group = new Group();
  private readonly material = new PointsMaterial({ size: SIZE, sizeAttenuation: false, color: COLOR });
  private drawn: { points: Points; robot: string; link: string }[] = [];
  private readonly end: () => void;

  constructor(
    private readonly robots: RobotViews,
    changed: () => void,
  ) {
    this.end = effect(() => {
      const shown = pointsShown.value ? sensors.value.filter(({ robot, scan }) => robot === sensorsShownOf.value && scan) : [];
      const found = shown.flatMap((sensor) => this.made(sensor) ?? []);
      const before = this.drawn;
      for (const { points } of before) {
        points.removeFromParent();
        points.geometry.dispose();
      }
      this.drawn = found;
      for (const { points } of found) this.group.add(points);
      if (before.length + found.length > 0) changed();
    });
  }

  /** Called for each picture: the points move with their links. */
  update(): void {
    for (const { points, robot, link } of this.drawn) {
      const view = this.robots.get(robot);
      const index = link === "" ? 0 : (view?.scene.links.findIndex(({ name }) => name === link) ?? -1);
      const [x, y, z, qx, qy, qz, qw] = view?.drawnPose(index) ?? [];
      points.visible = x !== undefined && view?.group.visible === true;
      if (x === undefined || y === undefined || z === undefined) continue;
      points.position.set(x, y, z);
      points.quaternion.set(qx ?? 0, qy ?? 0, qz ?? 0, qw ?? 1);
    }
  }

  /** Number of drawn points. */
  count(): number {
    return this.drawn.reduce((sum, { points }) => sum + (points.geometry.getAttribute("position")?.count ?? 0), 0);
  }

  dispose(): void {
    this.end();
    for (const { points } of this.drawn) points.geometry.dispose();
    this.material.dispose();
  }

  private made({ robot, name, on, pose, scan }: Sensor): { points: Points; robot: string; link: string } | undefined {
    const measured = readings.value.get(name);
    const ranges = measured?.kind === "lidar" ? measured.ranges : measured?.kind === "range" ? [measured.range] : undefined;
    if (!scan || !pose || !ranges) return undefined;
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(pointsOf(scan, pose, ranges), 3));
    const points = new Points(geometry, this.material);
    points.frustumCulled = false;
    return { points, robot, link: on };
  }
}

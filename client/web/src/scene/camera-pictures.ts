// Pictures of the cameras of the robot in the panel: the newest picture of each in the scene, at the end of its viewing pyramid.
import { effect } from "@preact/signals";
import { BufferAttribute, BufferGeometry, DataTexture, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, SRGBColorSpace } from "three";
import { cameraPictures, type SensorPicture } from "../state/pictures";
import { sensors, sensorsShownOf, type Lens, type Sensor } from "../state/sensors";
import { pointsShown } from "../state/view";
import type { RobotViews } from "./robot-views";

const COLOR = 0xe11d48;
/** Maximum distance from the camera to its picture, metres, if its range allows. */
const AWAY = 0.4;

/**
 * The corners of a picture in the sensor's frame: upper left, upper right, lower right, lower left. The frame has x forwards, y to the left and z up.
 */
export function cornersOf({ width, height, fieldOfView, near, far }: Lens): [number, number, number][] {
  const x = Math.min(Math.max(AWAY, near), far);
  const y = x * Math.tan(fieldOfView / 2);
  const z = (y * height) / Math.max(1, width);
  return [
    [x, y, z],
    [x, -y, z],
    [x, -y, -z],
    [x, y, -z],
  ];
}

/** A drawn picture. */
interface Drawn {
  sensor: Sensor;
  group: Group;
  picture: SensorPicture;
  texture: DataTexture;
  /** Pixels of the texture. */
  pixels: Uint8ClampedArray<ArrayBuffer>;
  dispose(): void;
}

/** The pictures of all cameras of one robot. */
export class CameraPictures {
  readonly group = new Group();
  private readonly lines = new LineBasicMaterial({ color: COLOR });
  /** By the sensor's name. */
  private drawn = new Map<string, Drawn>();
  private readonly end: () => void;

  constructor(
    private readonly robots: RobotViews,
    changed: () => void,
  ) {
    this.end = effect(() => {
      const shown = pointsShown.value ? sensors.value.filter(({ robot, lens }) => robot === sensorsShownOf.value && lens) : [];
      const pictures = cameraPictures.value;
      const before = this.drawn;
      this.drawn = new Map();
      for (const sensor of shown) {
        const picture = pictures.get(sensor.name);
        const old = before.get(sensor.name);
        if (!picture || !sensor.lens) continue;
        const stays = old?.sensor === sensor && old.picture.width === picture.width && old.picture.height === picture.height;
        const drawn = stays ? old : this.made(sensor, sensor.lens, picture);
        if (stays && old.picture !== picture) {
          old.pixels.set(picture.pixels);
          old.texture.needsUpdate = true;
          old.picture = picture;
        }
        this.drawn.set(sensor.name, drawn);
      }
      const kept = new Set(this.drawn.values());
      for (const old of before.values()) if (!kept.has(old)) old.dispose();
      if (before.size + this.drawn.size > 0) changed();
    });
  }

  /** Called for each picture of the scene: pictures move with their links. */
  update(): void {
    for (const { sensor, group } of this.drawn.values()) {
      const view = this.robots.get(sensor.robot);
      const index = sensor.on === "" ? 0 : (view?.scene.links.findIndex(({ name }) => name === sensor.on) ?? -1);
      const [x, y, z, qx, qy, qz, qw] = view?.drawnPose(index) ?? [];
      group.visible = x !== undefined && view?.group.visible === true;
      if (x === undefined || y === undefined || z === undefined) continue;
      group.position.set(x, y, z);
      group.quaternion.set(qx ?? 0, qy ?? 0, qz ?? 0, qw ?? 1);
    }
  }

  /** Number of drawn pictures. */
  count(): number {
    return this.drawn.size;
  }

  dispose(): void {
    this.end();
    for (const drawn of this.drawn.values()) drawn.dispose();
    this.lines.dispose();
  }

  private made(sensor: Sensor, lens: Lens, picture: SensorPicture): Drawn {
    const corners = cornersOf(lens);
    const pixels = picture.pixels.slice();
    const texture = new DataTexture(pixels, picture.width, picture.height);
    texture.colorSpace = SRGBColorSpace;
    texture.needsUpdate = true;
    const face = new BufferGeometry();
    face.setAttribute("position", new BufferAttribute(new Float32Array(corners.flat()), 3));
    // The first row of the pixels is the upper one.
    face.setAttribute("uv", new BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2));
    face.setIndex([0, 3, 2, 0, 2, 1]);
    const material = new MeshBasicMaterial({ map: texture, side: DoubleSide, fog: false, toneMapped: false });
    const edges = new BufferGeometry();
    const pairs = corners.flatMap((corner, index) => [[0, 0, 0], corner, corner, corners[(index + 1) % corners.length] ?? corner]);
    edges.setAttribute("position", new BufferAttribute(new Float32Array(pairs.flat()), 3));
    const link = new Group();
    const own = new Group();
    const [x, y, z, qx, qy, qz, qw] = sensor.pose ?? [0, 0, 0, 0, 0, 0, 1];
    own.position.set(x, y, z);
    own.quaternion.set(qx, qy, qz, qw);
    own.add(new Mesh(face, material), new LineSegments(edges, this.lines));
    link.add(own);
    this.group.add(link);
    const dispose = () => {
      link.removeFromParent();
      texture.dispose();
      face.dispose();
      edges.dispose();
      material.dispose();
    };
    return { sensor, group: link, picture, texture, pixels, dispose };
  }
}

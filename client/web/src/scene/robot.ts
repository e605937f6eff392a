// One robot as it is drawn: a group for each link, with its visuals, its colliders and its axes.
import { Box3, BoxGeometry, Group, Matrix4, Mesh, Quaternion, Vector3, type BufferGeometry, type Material, type Object3D } from "three";
import type { RobotScene, Shape } from "../state/scene";
import { triangles } from "./geometries";
import { hullOf } from "./hull";
import { isUnpainted, type Meshes } from "./meshes";
import type { Paints } from "./paint";
import { Triad } from "./rods";

/** What of a robot is shown. */
export interface Shown {
  visuals: boolean;
  collisions: boolean;
  frames: boolean;
}

/** Where a mesh is missing, a box of this size marks it, metres. */
const MARKER = 0.04;
/** Metres and parts of a turn: links that move by less are drawn where they are. */
const STILL = 1e-6;

/** Draws one robot until it is disposed of. */
export class RobotView {
  readonly group = new Group();
  private readonly links: Group[];
  private readonly visuals: Group[];
  private readonly collisions: Group[];
  private readonly axes: Triad[] = [];
  private readonly geometries: BufferGeometry[] = [];
  private readonly acquired: string[] = [];
  private shown: Shown = { visuals: true, collisions: false, frames: false };
  private hasCollisions = false;
  private highlighted = -1;
  private gone = false;

  /** `changed` is called when a mesh has come. */
  constructor(
    readonly scene: RobotScene,
    private readonly meshes: Meshes,
    private readonly paints: Paints,
    private readonly changed: () => void,
  ) {
    this.group.name = scene.robot;
    this.links = scene.links.map(({ name }) => Object.assign(new Group(), { name }));
    this.visuals = this.links.map(() => new Group());
    this.collisions = this.links.map(() => new Group());
    this.links.forEach((link, index) => {
      link.userData["link"] = index;
      // Nothing is to be seen of it before its first pose.
      link.visible = false;
      for (const layer of [this.visuals[index], this.collisions[index]]) {
        if (layer) link.add(layer);
      }
      this.group.add(link);
    });
    // A robot that has only colliders is seen by them.
    const seen = scene.visuals.length > 0 ? scene.visuals : scene.collisions;
    for (const shape of seen) this.add(shape, this.visuals[shape.link], "solid");
  }

  /** Places the links. Answers whether any of them moved. */
  pose(poses: Float64Array): boolean {
    let moved = false;
    this.links.forEach((link, index) => {
      const [x, y, z, qx, qy, qz, qw] = poses.subarray(7 * index, 7 * index + 7) as unknown as Seven;
      const { position: p, quaternion: q } = link;
      const shift = Math.max(Math.abs(x - p.x), Math.abs(y - p.y), Math.abs(z - p.z));
      const turn = Math.max(Math.abs(qx - q.x), Math.abs(qy - q.y), Math.abs(qz - q.z), Math.abs(qw - q.w));
      if (shift < STILL && turn < STILL && link.visible) return;
      p.set(x, y, z);
      q.set(qx, qy, qz, qw);
      link.visible = true;
      moved = true;
    });
    return moved;
  }

  /** Whether it is known where it is. */
  isPosed(): boolean {
    return this.links.every((link) => link.visible);
  }

  /** Shows and hides; what was never shown is made now. */
  show(shown: Shown, axisLength: number): void {
    this.shown = shown;
    if (shown.collisions && !this.hasCollisions) {
      this.hasCollisions = true;
      for (const shape of this.scene.collisions) this.add(shape, this.collisions[shape.link], "collision");
    }
    if (shown.frames && this.axes.length === 0) {
      for (const link of this.links) {
        const axes = new Triad();
        this.axes.push(axes);
        link.add(axes.group);
      }
    }
    for (const layer of this.visuals) layer.visible = shown.visuals;
    for (const layer of this.collisions) layer.visible = shown.collisions;
    for (const axes of this.axes) {
      axes.group.visible = shown.frames;
      axes.group.scale.setScalar(axisLength);
    }
  }

  /** What can be pointed at. */
  targets(): Object3D[] {
    return this.shown.visuals ? this.visuals : this.shown.collisions ? this.collisions : [];
  }

  /** Lights a link up, and the one before no longer. Answers whether that changed anything. */
  highlight(index: number): boolean {
    if (index === this.highlighted) return false;
    this.swap(this.highlighted, (mesh) => {
      const plain = mesh.userData["plain"] as Material | undefined;
      if (plain) mesh.material = plain;
      delete mesh.userData["plain"];
    });
    this.highlighted = index;
    this.light(index);
    return true;
  }

  private light(index: number): void {
    this.swap(index, (mesh) => {
      if (mesh.userData["plain"]) return;
      const plain = mesh.material as Material;
      mesh.userData["plain"] = plain;
      mesh.material = this.paints.highlighted(plain);
    });
  }

  private swap(index: number, change: (mesh: Mesh) => void): void {
    this.visuals[index]?.traverse((object) => {
      if (object instanceof Mesh) change(object);
    });
  }

  /** world_from_link of a link. */
  worldFromLink(index: number): Matrix4 {
    const link = this.links[index];
    link?.updateWorldMatrix(true, false);
    return link?.matrixWorld ?? new Matrix4();
  }

  /** Around all that is drawn but planes, which end nowhere; empty where there is nothing else. */
  bounds(): Box3 {
    const box = new Box3();
    this.group.updateWorldMatrix(true, true);
    const links = this.scene.visuals.length + this.scene.collisions.length === 0 ? this.links : [];
    for (const link of links) box.expandByPoint(link.getWorldPosition(new Vector3()));
    for (const layer of this.visuals) {
      layer.traverse((object) => {
        if (object instanceof Mesh && object.userData["endless"] !== true) box.expandByObject(object);
      });
    }
    return box;
  }

  dispose(): void {
    this.gone = true;
    this.group.removeFromParent();
    for (const geometry of this.geometries) geometry.dispose();
    for (const sha256 of this.acquired) this.meshes.release(sha256);
  }

  private add(shape: Shape, layer: Group | undefined, look: "solid" | "collision"): void {
    // A plane is the ground, which a veil of its collider would tint as far as one sees.
    if (!layer || (look === "collision" && shape.geometry.kind === "plane")) return;
    const at = new Group();
    const [x, y, z, qx, qy, qz, qw] = shape.linkFromShape;
    at.position.set(x, y, z);
    at.quaternion.set(qx, qy, qz, qw);
    layer.add(at);
    const { geometry } = shape;
    if (geometry.kind === "mesh") {
      at.scale.set(...geometry.scale);
      void this.addMesh(geometry.sha256, shape, at, look);
      return;
    }
    if (geometry.kind === "plane") {
      at.quaternion.multiply(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...geometry.normal).normalize()));
    }
    const made = triangles(geometry);
    this.geometries.push(made);
    const material = geometry.kind === "plane" && !shape.color ? this.paints.ground : this.paints.solid(shape.color);
    const mesh = new Mesh(made, look === "solid" ? material : this.paints.collision);
    mesh.userData["endless"] = geometry.kind === "plane";
    this.finish(mesh, at, look);
  }

  private async addMesh(sha256: string, shape: Shape, at: Group, look: "solid" | "collision"): Promise<void> {
    if (sha256 !== "") this.acquired.push(sha256);
    const loaded = sha256 === "" ? undefined : await this.meshes.acquire(sha256);
    if (this.gone) return;
    if (loaded && look === "collision") {
      await this.addHull(loaded, at);
    } else if (loaded) {
      loaded.traverse((object) => {
        if (object instanceof Mesh && isUnpainted(object)) object.material = this.paints.solid(shape.color, true);
      });
      this.finish(loaded, at, look);
    } else {
      const box = new BoxGeometry(MARKER, MARKER, MARKER);
      this.geometries.push(box);
      at.scale.setScalar(1);
      at.add(new Mesh(box, this.paints.missing));
    }
    if (this.highlighted >= 0) this.light(this.highlighted);
    this.changed();
  }

  private async addHull(loaded: Object3D, at: Group): Promise<void> {
    const hull = await hullOf(loaded, at.scale);
    if (!hull) return;
    if (this.gone) {
      hull.dispose();
      return;
    }
    this.geometries.push(hull);
    // Its corners have the scale already.
    at.scale.setScalar(1);
    this.finish(new Mesh(hull, this.paints.collision), at, "collision");
  }

  private finish(object: Object3D, at: Group, look: "solid" | "collision"): void {
    const meshes: Mesh[] = [];
    object.traverse((each) => {
      if (each instanceof Mesh) meshes.push(each);
    });
    for (const mesh of meshes) {
      const endless = mesh.userData["endless"] === true;
      mesh.castShadow = look === "solid" && !endless;
      mesh.receiveShadow = look === "solid";
      if (look === "collision") mesh.add(new Mesh(mesh.geometry, this.paints.wire));
    }
    at.add(object);
  }
}

type Seven = [number, number, number, number, number, number, number];

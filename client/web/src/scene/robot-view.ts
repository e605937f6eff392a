// The drawing of one robot: a group for each link, with its visuals, its colliders and its axes.
import { Box3, BoxGeometry, Group, Matrix4, Mesh, MeshStandardMaterial, Quaternion, Vector3, type Material, type Object3D } from "three";
import type { Rgba } from "../state/markers";
import type { Geometry, RobotScene, Shape } from "../state/scene";
import { MIN_MOTION } from "../state/stillness";
import { addressOf, isUnpainted, type MeshCache } from "./mesh-cache";
import { colourable, highlighted, tint, type Materials } from "./materials";
import { Triad } from "./rods";

/** Layers of a robot that are shown. */
export interface Shown {
  visuals: boolean;
  collisions: boolean;
  frames: boolean;
}

/** Solid, or translucent with its triangles. */
type Look = "solid" | "collision";

/** Size of the box in place of a missing mesh, metres. */
const MARKER = 0.04;

/** Draws one robot until it is disposed of. */
export class RobotView {
  readonly group = new Group();
  private readonly links: Group[];
  private readonly visuals: Group[];
  private readonly collisions: Group[];
  private readonly axes: Triad[] = [];
  /** Frees what it shares with other robots. */
  private readonly releases: (() => void)[] = [];
  private shown: Shown = { visuals: true, collisions: false, frames: false };
  private hasCollisions = false;
  private highlighted = -1;
  private colors: ReadonlyMap<string, Rgba> = new Map();
  private disposed = false;
  /** The last result of `bounds`; undefined after a motion or a load. */
  private box: Box3 | undefined;

  /** `changed` is called when a mesh was loaded. All visuals are painted with `paint`, if it is given. */
  constructor(
    readonly scene: RobotScene,
    private readonly meshes: MeshCache,
    private readonly materials: Materials,
    private readonly changed: () => void,
    private readonly paint?: Material,
  ) {
    this.group.name = scene.robot;
    this.links = scene.links.map(({ name }) => Object.assign(new Group(), { name }));
    this.visuals = this.links.map(() => new Group());
    this.collisions = this.links.map(() => new Group());
    this.links.forEach((link, index) => {
      link.userData["link"] = index;
      // Hidden until its first pose.
      link.visible = false;
      still(link);
      for (const layer of [this.visuals[index], this.collisions[index]]) {
        if (layer) link.add(still(layer));
      }
      this.group.add(link);
    });
    still(this.group);
    // A robot without visuals is drawn by its collision shapes.
    const drawn = scene.visuals.length > 0 ? scene.visuals : scene.collisions;
    for (const shape of drawn) this.add(shape, this.visuals[shape.link], "solid");
  }

  /** Sets the poses of the links. Returns whether any of them moved. */
  pose(poses: Float64Array): boolean {
    let moved = false;
    this.links.forEach((link, index) => {
      const [x, y, z, qx, qy, qz, qw] = poses.subarray(7 * index, 7 * index + 7) as unknown as Seven;
      const { position: p, quaternion: q } = link;
      const shift = Math.max(Math.abs(x - p.x), Math.abs(y - p.y), Math.abs(z - p.z));
      const turn = Math.max(Math.abs(qx - q.x), Math.abs(qy - q.y), Math.abs(qz - q.z), Math.abs(qw - q.w));
      if (shift < MIN_MOTION && turn < MIN_MOTION && link.visible) return;
      p.set(x, y, z);
      q.set(qx, qy, qz, qw);
      link.updateMatrix();
      link.visible = true;
      moved = true;
    });
    if (moved) this.box = undefined;
    return moved;
  }

  /** Whether all links have a pose. */
  isPosed(): boolean {
    return this.links.every((link) => link.visible);
  }

  /** Shows and hides layers, which are created when they are first shown. */
  show(shown: Shown, axisLength: number): void {
    this.shown = shown;
    if (shown.collisions && !this.hasCollisions) {
      this.hasCollisions = true;
      for (const shape of this.scene.colliders) this.add(shape, this.collisions[shape.link], "collision");
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

  /** The objects that can be picked. */
  targets(): Object3D[] {
    return this.shown.visuals ? this.visuals : this.shown.collisions ? this.collisions : [];
  }

  /** Highlights a link in place of the former one. Returns whether that changed anything. */
  highlight(index: number): boolean {
    if (index === this.highlighted) return false;
    this.forEachMesh(this.highlighted, (mesh) => putBack(mesh, "plain"));
    this.highlighted = index;
    this.addHighlight(index);
    return true;
  }

  /** Gives links these colours, and the others the description's. */
  color(colors: ReadonlyMap<string, Rgba>): void {
    if (this.paint || (colors.size === 0 && this.colors.size === 0)) return;
    this.colors = colors;
    this.scene.links.forEach((_, index) => {
      this.addColor(index);
    });
  }

  private addColor(index: number): void {
    const color = this.colors.get(this.scene.links[index]?.name ?? "");
    this.forEachMesh(index, (mesh) => {
      if (!color && !mesh.userData["described"]) return;
      // A highlighted link is highlighted in its new colour.
      putBack(mesh, "plain");
      if (!color) return putBack(mesh, "described");
      if (!mesh.userData["described"]) putOn(mesh, "described", colourable(mesh.material as Material));
      tint(mesh.material as MeshStandardMaterial, color);
    });
    if (index === this.highlighted) this.addHighlight(index);
  }

  private addHighlight(index: number): void {
    this.forEachMesh(index, (mesh) => {
      if (!mesh.userData["plain"]) putOn(mesh, "plain", highlighted(mesh.material as Material));
    });
  }

  private forEachMesh(index: number, change: (mesh: Mesh) => void): void {
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

  /** Returns world_from_link of a link as drawn: x y z, then the quaternion x y z w. */
  drawnPose(index: number): number[] {
    const link = this.links[index];
    return link ? [...link.position.toArray(), ...link.quaternion.toArray()] : [];
  }

  /** Returns the bounding box of everything but planes, which are infinite; empty without other content. */
  bounds(): Box3 {
    this.box ??= this.measured();
    return this.box.clone();
  }

  /** Draws it as ground: it casts no shadow, not on itself either, and white is darkened to a plane's tone. */
  layFlat(): void {
    for (const layer of this.visuals) {
      layer.traverse((object) => {
        if (!(object instanceof Mesh)) return;
        object.castShadow = false;
        // A mesh with a program's colour or a highlight already has a separate material.
        if (object.userData["described"] || object.userData["plain"]) return;
        const material = object.material as Material | Material[];
        if (!Array.isArray(material) && material instanceof MeshStandardMaterial && isPale(material)) object.material = this.materials.ground;
      });
    }
  }

  private measured(): Box3 {
    const box = new Box3();
    this.group.updateWorldMatrix(true, true);
    const links = this.scene.visuals.length + this.scene.collisions.length === 0 ? this.links : [];
    for (const link of links) box.expandByPoint(link.getWorldPosition(new Vector3()));
    for (const layer of this.visuals) {
      layer.traverse((object) => {
        if (object instanceof Mesh && object.userData["infinite"] !== true) box.expandByObject(object);
      });
    }
    return box;
  }

  dispose(): void {
    this.disposed = true;
    this.highlight(-1);
    this.color(new Map());
    this.group.removeFromParent();
    for (const release of this.releases) release();
  }

  private add(shape: Shape, layer: Group | undefined, look: Look): void {
    // A plane is the ground, which a translucent collider would tint completely.
    if (!layer || (look === "collision" && shape.geometry.kind === "plane")) return;
    const at = new Group();
    const [x, y, z, qx, qy, qz, qw] = shape.linkFromShape;
    at.position.set(x, y, z);
    at.quaternion.set(qx, qy, qz, qw);
    layer.add(at);
    const { geometry } = shape;
    if (geometry.kind === "mesh" || geometry.kind === "convex") {
      if (geometry.kind === "mesh") at.scale.set(...geometry.scale);
      still(at);
      void this.addMesh(geometry, shape, at, look);
      return;
    }
    if (geometry.kind === "plane") {
      at.quaternion.multiply(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...geometry.normal).normalize()));
    }
    still(at);
    const { made, release } = this.meshes.primitives.acquire(geometry, shape.textureRepeat);
    this.releases.push(release);
    const plain = geometry.kind === "plane" && !shape.color && shape.texture === undefined ? this.materials.ground : this.materials.solid(shape.color, false, shape.texture);
    const material = this.paint ?? plain;
    const mesh = new Mesh(made, look === "solid" ? material : this.materials.collision);
    mesh.userData["infinite"] = geometry.kind === "plane";
    this.finish(mesh, at, look);
  }

  private async addMesh(geometry: Extract<Geometry, { sha256: string }>, shape: Shape, at: Group, look: Look): Promise<void> {
    const address = addressOf(geometry);
    if (address !== undefined) this.releases.push(() => this.meshes.release(address));
    const loaded = address === undefined ? undefined : await this.meshes.acquire(address);
    if (this.disposed) return;
    if (loaded) {
      loaded.traverse((object) => {
        if (!(object instanceof Mesh)) return;
        if (look === "collision") object.material = this.materials.collision;
        else if (this.paint) object.material = this.paint;
        else if (isUnpainted(object)) object.material = this.materials.solid(shape.color, true);
      });
      this.finish(loaded, at, look);
    } else {
      const box = new BoxGeometry(MARKER, MARKER, MARKER);
      this.releases.push(() => box.dispose());
      at.scale.setScalar(1);
      still(at);
      at.add(new Mesh(box, this.materials.missing));
    }
    if (this.colors.size > 0) this.addColor(shape.link);
    if (this.highlighted >= 0) this.addHighlight(this.highlighted);
    this.box = undefined;
    this.changed();
  }

  private finish(object: Object3D, at: Group, look: Look): void {
    const meshes: Mesh[] = [];
    object.traverse((each) => {
      if (each instanceof Mesh) meshes.push(each);
    });
    for (const mesh of meshes) {
      const infinite = mesh.userData["infinite"] === true;
      mesh.castShadow = look === "solid" && !infinite && !this.paint;
      mesh.receiveShadow = look === "solid";
      if (look === "collision") mesh.add(new Mesh(mesh.geometry, this.materials.wire));
    }
    at.add(object);
  }
}

/** Computes the place of an object in its parent once, and not for each picture. Returns it. */
function still<T extends Object3D>(object: T): T {
  object.updateMatrix();
  object.matrixAutoUpdate = false;
  return object;
}

/** Key of the material that a mesh had before it got a separate one: without the highlight, and as described. */
type Before = "plain" | "described";

function putOn(mesh: Mesh, before: Before, own: Material): void {
  mesh.userData[before] = mesh.material;
  mesh.material = own;
}

/** Removes the material that `putOn` set, and disposes of it. */
function putBack(mesh: Mesh, before: Before): void {
  const material = mesh.userData[before] as Material | undefined;
  if (!material) return;
  (mesh.material as Material).dispose();
  mesh.material = material;
  delete mesh.userData[before];
}

type Seven = [number, number, number, number, number, number, number];

/** Whether it is nearly white, without a texture. */
function isPale({ color: { r, g, b }, map }: MeshStandardMaterial): boolean {
  return map === null && Math.min(r, g, b) > PALE;
}

/** Linear, of each colour. */
const PALE = 0.7;

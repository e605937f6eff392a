// A robot is drawn from its scene; its colliders are the physics' shapes.
import { BoxGeometry, Group, Mesh, MeshStandardMaterial, type Material, type Object3D } from "three";
import { expect, test } from "vitest";
import type { RobotScene, Shape } from "../state/scene";
import { Primitives } from "./geometries";
import { addressOf, type MeshCache } from "./mesh-cache";
import { Materials } from "./materials";
import { RobotView } from "./robot-view";

const HASH = "ab".repeat(32);
const PART = "cd".repeat(32);

function shape(geometry: Shape["geometry"]): Shape {
  return { link: 0, linkFromShape: [0, 0, 0, 0, 0, 0, 1], geometry };
}

/** A link whose mesh is two convex parts and a box in the physics. */
const SCENE: RobotScene = {
  robot: "arm",
  layoutVersion: 1n,
  links: [{ name: "base", parent: -1, movable: false, mass: 1 }],
  visuals: [shape({ kind: "sphere", radius: 1 })],
  collisions: [shape({ kind: "mesh", sha256: HASH, uri: "a.stl", scale: [2, 2, 2] })],
  colliders: [shape({ kind: "convex", sha256: HASH }), shape({ kind: "convex", sha256: PART }), shape({ kind: "box", size: [1, 1, 1] })],
};

/** A stub that returns a cube for each address. */
class MeshStub {
  readonly primitives = new Primitives();
  readonly acquired: string[] = [];
  readonly released: string[] = [];

  acquire(address: string): Promise<Object3D> {
    this.acquired.push(address);
    return Promise.resolve(new Group().add(new Mesh(new BoxGeometry(), new MeshStandardMaterial())));
  }

  release(address: string): void {
    this.released.push(address);
  }
}

function meshesIn(object: Object3D): Mesh[] {
  const meshes: Mesh[] = [];
  object.traverse((each) => {
    if (each instanceof Mesh) meshes.push(each);
  });
  return meshes;
}

test("colliders are meshes when they are first shown, unscaled, and released with the robot", async () => {
  const meshes = new MeshStub();
  const materials = new Materials();
  const view = new RobotView(SCENE, meshes as unknown as MeshCache, materials, () => undefined);
  expect(meshes.acquired).toEqual([]);
  view.show({ visuals: true, collisions: true, frames: false }, 1);
  await Promise.resolve();
  await Promise.resolve();
  expect(meshes.acquired).toEqual([`/colliders/${HASH}.glb`, `/colliders/${PART}.glb`]);
  const drawn = meshesIn(view.group).filter((mesh) => mesh.material === materials.collision);
  expect(drawn.length).toBe(3);
  view.group.updateWorldMatrix(true, true);
  expect(drawn.map((mesh) => mesh.matrixWorld.getMaxScaleOnAxis())).toEqual([1, 1, 1]);
  view.dispose();
  expect(meshes.released).toEqual(meshes.acquired);
});

test("a mesh whose file is missing has no address", () => {
  expect(addressOf({ kind: "mesh", sha256: "", uri: "a.stl", scale: [1, 1, 1] })).toBeUndefined();
  expect(addressOf({ kind: "mesh", sha256: HASH, uri: "a.stl", scale: [1, 1, 1] })).toBe(`/meshes/${HASH}.glb`);
});

test("a link has the colour that a program gave it, also while it is highlighted and when its mesh comes later, and its own again", async () => {
  const materials = new Materials();
  const scene = { ...SCENE, visuals: [...SCENE.visuals, shape({ kind: "mesh", sha256: HASH, uri: "a.stl", scale: [1, 1, 1] })] };
  const view = new RobotView(scene, new MeshStub() as unknown as MeshCache, materials, () => undefined);
  const colors = () => meshesIn(view.group).map(({ material }) => (material as MeshStandardMaterial).color.getHexString());
  const [described] = colors();
  const red: [number, number, number, number] = [1, 0, 0, 0.5];
  view.color(new Map([["base", red]]));
  expect(colors()).toEqual(["ff0000"]);
  await Promise.resolve();
  await Promise.resolve();
  expect(colors()).toEqual(["ff0000", "ff0000"]);
  expect(meshesIn(view.group).every(({ material }) => (material as MeshStandardMaterial).opacity === 0.5)).toBe(true);
  view.highlight(0);
  expect(colors()).not.toContain("0000ff");
  view.color(new Map([["base", [0, 0, 1, 1] as const]]));
  view.highlight(-1);
  expect(colors()).toEqual(["0000ff", "0000ff"]);
  view.color(new Map());
  expect(colors()).toEqual([described, described]);
  materials.dispose();
});

test("a colour that changes with each state is one material, which ends with the colour, a highlight or the robot", () => {
  const view = new RobotView(SCENE, new MeshStub() as unknown as MeshCache, new Materials(), () => undefined);
  const made = new Set<Material>();
  const gone = new Set<Material>();
  const see = (): void => {
    for (const { material } of meshesIn(view.group) as { material: Material }[]) {
      if (!made.has(material)) material.addEventListener("dispose", () => gone.add(material));
      made.add(material);
    }
  };
  see();
  for (let state = 0; state < 100; state += 1) {
    view.color(new Map([["base", [state / 100, 0, 0, 1] as const]]));
    see();
  }
  // The description's material, and the material of the colours.
  expect([made.size, gone.size]).toEqual([2, 0]);
  view.color(new Map());
  expect(gone.size).toBe(1);
  view.highlight(0);
  see();
  view.color(new Map([["base", [0, 1, 0, 0.5] as const]]));
  see();
  view.dispose();
  // All but the description's material.
  expect([made.size - gone.size, made.size]).toEqual([1, 4]);
});

// Equal meshes are drawn at once, at the places of the meshes.
import { BoxGeometry, Group, InstancedMesh, Matrix4, Mesh, MeshBasicMaterial, PerspectiveCamera, type Object3D } from "three";
import { beforeEach, expect, test } from "vitest";
import { COPIED, Copies } from "./copies";

const box = new BoxGeometry(0.1, 0.1, 0.1);
const red = new MeshBasicMaterial({ color: 0xff0000 });
const camera = new PerspectiveCamera(50, 1, 0.1, 100);
camera.position.set(0, 0, 10);
camera.updateMatrixWorld();

let scene: Group;
let copies: Copies;

beforeEach(() => {
  scene = new Group();
  copies = new Copies();
});

/** Adds a mesh at x, y. */
function add(x: number, y = 0, material = red): Mesh {
  const mesh = new Mesh(box, material);
  mesh.position.set(x, y, 0);
  scene.add(mesh);
  return mesh;
}

/** Draws, and returns the drawn places by x. */
function drawn(hasShadows = false): number[] {
  scene.updateMatrixWorld();
  copies.gather(scene);
  copies.place(camera, 100, hasShadows);
  const places: number[] = [];
  for (const each of copies.group.children.filter((child): child is InstancedMesh => child instanceof InstancedMesh && child.visible)) {
    for (let index = 0; index < each.count; index += 1) {
      const matrix = new Matrix4();
      each.getMatrixAt(index, matrix);
      places.push(matrix.elements[12]);
    }
  }
  return places.sort((a, b) => a - b);
}

const isCopied = ({ layers }: Object3D): boolean => layers.mask === 1 << COPIED;

test("equal meshes are drawn by one call at their places, and few ones separately", () => {
  const all = [0, 1, 2].map((x) => add(x));
  expect(drawn()).toEqual([]);
  all.push(add(3));
  expect(drawn()).toEqual([0, 1, 2, 3]);
  expect(all.every(isCopied)).toBe(true);
  expect(copies.counts()).toEqual({ meshes: 4, calls: 1 });
  all[1]?.position.setX(1.5);
  expect(drawn()).toEqual([0, 1.5, 2, 3]);
});

test("a mesh that gets another material or is hidden is drawn no longer as a copy, and comes back", () => {
  const all = [0, 1, 2, 3, 4].map((x) => add(x));
  expect(drawn()).toEqual([0, 1, 2, 3, 4]);
  const [first, second] = all;
  if (!first || !second) throw new Error("no meshes");
  first.material = red.clone();
  expect(drawn()).toEqual([1, 2, 3, 4]);
  expect(isCopied(first)).toBe(false);
  second.visible = false;
  expect(drawn()).toEqual([]);
  expect(all.filter((mesh) => mesh !== second).some(isCopied)).toBe(false);
  first.material = red;
  second.visible = true;
  expect(drawn()).toEqual([0, 1, 2, 3, 4]);
});

test("transparent meshes are drawn separately: their order counts", () => {
  const glass = new MeshBasicMaterial({ transparent: true, opacity: 0.5 });
  const all = [0, 1, 2, 3].map((x) => add(x, 0, glass));
  expect(drawn()).toEqual([]);
  expect(all.some(isCopied)).toBe(false);
});

test("meshes outside of the view are left out, unless they may cast a shadow", () => {
  for (const x of [0, 1, 2, 3, 50, -50]) add(x);
  expect(drawn()).toEqual([0, 1, 2, 3]);
  expect(drawn(true)).toEqual([-50, 0, 1, 2, 3, 50]);
});

test("buffers of kinds that are gone are freed", () => {
  for (const x of [0, 1, 2, 3]) add(x);
  drawn();
  scene.clear();
  expect(drawn()).toEqual([]);
  expect(copies.group.children).toEqual([]);
});

test("copies that are small in the picture have triangles that look equal there", () => {
  const few = new BoxGeometry(0.1, 0.1, 0.1);
  const asked: number[] = [];
  copies = new Copies((geometry, pixels) => {
    asked.push(pixels);
    return pixels < 20 ? few : geometry;
  });
  for (const x of [0, 1, 2, 3]) add(x);
  drawn();
  // Ten metres away: half a picture of 100 pixels is as high as the tangent of 25 degrees.
  expect(asked.at(-1)).toBeCloseTo(50 / (10 * Math.tan((25 * Math.PI) / 180)), 0);
  const [made] = copies.group.children as InstancedMesh[];
  expect(made?.geometry).toBe(few);
  add(0).position.setZ(9);
  drawn();
  expect((copies.group.children as InstancedMesh[])[0]?.geometry).toBe(box);
});

// Parts of a URDF that are needed to draw a robot without the daemon: links, primitives, and which joints slide.
import type { Geometry, Pose, RobotScene, SceneLink, Shape, Vector } from "../state/scene";

/** Maximum number of drawn links of one robot. */
const MAX_LINKS = 10_000;

/** A robot from its description. */
export interface Described {
  scene: RobotScene;
  /** Names of joints whose position is a length. */
  sliding: ReadonlySet<string>;
}

/** Reads a description; undefined if it cannot be read. Meshes count as missing files. */
export function described(robot: string, text: string): Described | undefined {
  const root = new DOMParser().parseFromString(text, "application/xml").documentElement;
  if (root.nodeName !== "robot") return undefined;
  const elements = children(root, "link").slice(0, MAX_LINKS);
  const joints = children(root, "joint");
  const indices = new Map(elements.map((link, index) => [link.getAttribute("name") ?? "", index]));
  const end = (joint: Element, name: string): string => children(joint, name)[0]?.getAttribute("link") ?? "";
  const parents = new Map(joints.map((joint) => [end(joint, "child"), end(joint, "parent")]));
  const links = [...indices.keys()].map((name): SceneLink => ({ name, parent: indices.get(parents.get(name) ?? "") ?? -1, movable: true, mass: 0 }));
  const colors = new Map(children(root, "material").map((material) => [material.getAttribute("name") ?? "", colorOf(material)]));
  const shapes = (kind: string): Shape[] =>
    elements.flatMap((link, index) => children(link, kind).flatMap((element) => shapeOf(element, index, colors)));
  const scene = { robot, layoutVersion: 0n, links, visuals: shapes("visual"), collisions: shapes("collision"), colliders: [] };
  const sliding = joints.filter((joint) => joint.getAttribute("type") === "prismatic").map((joint) => joint.getAttribute("name") ?? "");
  return { scene, sliding: new Set(sliding) };
}

function children(element: Element, name: string): Element[] {
  return [...element.children].filter((child) => child.nodeName === name);
}

type Color = NonNullable<Shape["color"]>;

function shapeOf(element: Element, link: number, colors: ReadonlyMap<string, Color | undefined>): Shape[] {
  const geometry = geometryOf(children(element, "geometry")[0]?.children[0]);
  if (!geometry) return [];
  const material = children(element, "material")[0];
  const color = material && (colorOf(material) ?? colors.get(material.getAttribute("name") ?? ""));
  return [{ link, linkFromShape: originOf(children(element, "origin")[0]), geometry, ...(color && { color }) }];
}

function geometryOf(element: Element | undefined): Geometry | undefined {
  const number = (name: string): number => numbers(element, name, 1)?.[0] ?? 0;
  switch (element?.nodeName) {
    case "box": {
      const size = numbers(element, "size", 3);
      return size && { kind: "box", size: size as unknown as Vector };
    }
    case "sphere":
      return { kind: "sphere", radius: number("radius") };
    case "cylinder":
    case "capsule":
    case "cone":
      return { kind: element.nodeName, radius: number("radius"), length: number("length") };
    case "mesh":
      return { kind: "mesh", sha256: "", uri: element.getAttribute("filename") ?? "", scale: [1, 1, 1] };
    default:
      return undefined;
  }
}

function colorOf(material: Element): Color | undefined {
  return numbers(children(material, "color")[0], "rgba", 4) as unknown as Color | undefined;
}

/** Returns `count` finite numbers of an attribute. */
function numbers(element: Element | undefined, name: string, count: number): number[] | undefined {
  const values = (element?.getAttribute(name) ?? "").trim().split(/\s+/).map(Number);
  return values.length === count && values.every(Number.isFinite) ? values : undefined;
}

/** Fixed axes: about x, then y, then z. */
function originOf(element: Element | undefined): Pose {
  const [x = 0, y = 0, z = 0] = numbers(element, "xyz", 3) ?? [];
  const [roll = 0, pitch = 0, yaw = 0] = numbers(element, "rpy", 3) ?? [];
  const [cr, sr] = [Math.cos(roll / 2), Math.sin(roll / 2)];
  const [cp, sp] = [Math.cos(pitch / 2), Math.sin(pitch / 2)];
  const [cy, sy] = [Math.cos(yaw / 2), Math.sin(yaw / 2)];
  return [x, y, z, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy];
}

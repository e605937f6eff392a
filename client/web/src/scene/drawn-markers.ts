// Drawings of programs in addition to the world: lines, points and texts. One call of WebGL draws each batch of one link and one width.
import {
  BufferGeometry,
  CanvasTexture,
  Color,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  Points,
  PointsMaterial,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
  Vector3,
  type Object3D,
} from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import type { Marker } from "../state/markers";

/** Maximum number of drawn texts: each has a texture. */
const MAX_TEXTS = 512;
/** Minimum size of a marker that is drawn in a separate call, numbers of its points: others can change without it. */
const LARGE = 6000;
/** Height of the letters in a texture, and its maximum width, pixels. */
const FONT = 64;
const MAX_WIDTH = 4096;
/** Height of a line of text, as a multiple of its letters. */
const LINE = 1.3;

/** Returns world_from_link of a drawn link; undefined if it is not drawn. An empty name stands for the root link. */
export type LinkFinder = (robot: string, link: string) => Matrix4 | undefined;

/** Markers that are drawn together. */
interface Batch {
  readonly markers: readonly Marker[];
  /** Moves with the link. */
  readonly frame: Group;
  readonly dispose: () => void;
}

/** The drawings of all markers. */
export class DrawnMarkers {
  readonly group = new Group();
  private readonly batches = new Map<string, Batch>();
  private ink = 0;

  /** Draws these. `ink` is the default colour. */
  set(markers: Iterable<Marker>, ink: number): void {
    if (ink !== this.ink) this.clear();
    this.ink = ink;
    const wanted = grouped(markers);
    for (const [key, batch] of this.batches) {
      const next = wanted.get(key);
      if (next?.length === batch.markers.length && next.every((marker, index) => marker === batch.markers[index])) wanted.delete(key);
      else this.drop(key, batch);
    }
    for (const [key, list] of wanted) {
      const batch = make(list, ink);
      if (!batch) continue;
      this.batches.set(key, batch);
      this.group.add(batch.frame);
    }
  }

  /** Moves markers on links to these poses. */
  pose(find: LinkFinder): void {
    for (const { markers, frame } of this.batches.values()) {
      const { robot = "", link = "" } = markers[0] ?? {};
      const at = robot === "" ? IDENTITY : find(robot, link);
      frame.visible = at !== undefined;
      if (!at) continue;
      frame.matrix.copy(at);
      frame.matrixWorldNeedsUpdate = true;
    }
  }

  /**
   * Returns the drawn points of a marker, world axes, metres: points of lines and points, or the start of a text. Undefined if it is not
   * drawn.
   */
  points(id: bigint): number[][] | undefined {
    for (const { markers, frame } of this.batches.values()) {
      const marker = markers.find((each) => each.id === id);
      if (!marker || !frame.visible || !this.group.visible) continue;
      const flat = marker.shape.kind === "text" ? marker.shape.position : marker.shape.points;
      const points = [];
      for (let index = 0; index < flat.length; index += 3) {
        points.push(new Vector3(flat[index], flat[index + 1], flat[index + 2]).applyMatrix4(frame.matrix).toArray());
      }
      return points;
    }
    return undefined;
  }

  dispose(): void {
    this.clear();
  }

  private clear(): void {
    for (const [key, batch] of this.batches) this.drop(key, batch);
  }

  private drop(key: string, batch: Batch): void {
    this.batches.delete(key);
    this.group.remove(batch.frame);
    batch.dispose();
  }
}

const IDENTITY = new Matrix4();

/** Returns groups that can be drawn together, each by its shared properties. */
function grouped(markers: Iterable<Marker>): Map<string, Marker[]> {
  const groups = new Map<string, Marker[]>();
  let texts = 0;
  for (const marker of markers) {
    const { id, shape, robot, link, color } = marker;
    if (shape.kind === "text" && (texts += 1) > MAX_TEXTS) continue;
    const alpha = color?.[3] ?? 1;
    const width = shape.kind === "lines" ? shape.width : shape.size;
    const isAlone = shape.kind === "text" || shape.points.length > LARGE;
    const key = JSON.stringify([shape.kind, robot, link, alpha, width, isAlone ? String(id) : ""]);
    const group = groups.get(key);
    if (group) group.push(marker);
    else groups.set(key, [marker]);
  }
  return groups;
}

function make(markers: readonly Marker[], ink: number): Batch | undefined {
  const [first] = markers;
  if (!first) return undefined;
  const frame = new Group();
  frame.matrixAutoUpdate = false;
  const part = first.shape.kind === "text" ? textOf(first, ink) : first.shape.kind === "lines" ? linesOf(markers, first.shape.width, ink) : pointsOf(markers, first.shape.size, ink);
  if (!part) return undefined;
  part.object.frustumCulled = false;
  frame.add(part.object);
  return { markers, frame, dispose: part.dispose };
}

interface Part {
  object: Object3D;
  dispose: () => void;
}

function linesOf(markers: readonly Marker[], width: number, ink: number): Part {
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(new Float32Array(markers.flatMap(({ shape }) => (shape.kind === "lines" ? shape.points : []))));
  // Both ends of a line have its colour.
  geometry.setColors(new Float32Array(markers.flatMap((marker) => colorsOf(marker, 6, ink).flatMap((color) => [...color, ...color]))));
  const material = new LineMaterial({ linewidth: width, vertexColors: true, ...transparency(markers) });
  return { object: new LineSegments2(geometry, material), dispose: () => [geometry, material].forEach((it) => it.dispose()) };
}

function pointsOf(markers: readonly Marker[], size: number, ink: number): Part {
  const geometry = new BufferGeometry();
  const positions = markers.flatMap(({ shape }) => (shape.kind === "points" ? shape.points : []));
  geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
  geometry.setAttribute("color", new Float32BufferAttribute(markers.flatMap((marker) => colorsOf(marker, 3, ink).flat()), 3));
  const material = new PointsMaterial({ size, sizeAttenuation: false, vertexColors: true, ...transparency(markers) });
  return { object: new Points(geometry, material), dispose: () => [geometry, material].forEach((it) => it.dispose()) };
}

function transparency([first]: readonly Marker[]): { transparent: boolean; opacity: number } {
  const opacity = first?.color?.[3] ?? 1;
  return { transparent: opacity < 1, opacity };
}

/** Returns the linear colour of each line or point, as this many numbers. */
function colorsOf({ shape, color }: Marker, numbers: number, ink: number): number[][] {
  if (shape.kind === "text") return [];
  const count = shape.points.length / numbers;
  const common = inkOf(color, ink).toArray();
  const own = (index: number): number[] => {
    const [red = 0, green = 0, blue = 0] = shape.colors.slice(3 * index, 3 * index + 3);
    return new Color().setRGB(red, green, blue, SRGBColorSpace).toArray();
  };
  return Array.from({ length: count }, (_, index) => (shape.colors.length > 0 ? own(index) : common));
}

function inkOf(color: Marker["color"], ink: number): Color {
  return color ? new Color().setRGB(color[0], color[1], color[2], SRGBColorSpace) : new Color(ink);
}

function textOf({ shape, color }: Marker, ink: number): Part | undefined {
  if (shape.kind !== "text") return undefined;
  const written = write(shape.text);
  if (!written) return undefined;
  const { texture, aspect } = written;
  const height = LINE * shape.size;
  const width = aspect * height;
  const look = { map: texture, color: inkOf(color, ink), transparent: true, opacity: color?.[3] ?? 1, depthWrite: false };
  if (shape.orientation) {
    const geometry = new PlaneGeometry(width, height).translate(width / 2, height / 2, 0);
    const material = new MeshBasicMaterial({ ...look, side: DoubleSide });
    const mesh = new Mesh(geometry, material);
    mesh.position.set(...shape.position);
    mesh.quaternion.set(...shape.orientation);
    return { object: mesh, dispose: () => [geometry, material, texture].forEach((it) => it.dispose()) };
  }
  // Drawn over nearer things, since it is to be read.
  const material = new SpriteMaterial({ ...look, depthTest: false });
  const sprite = new Sprite(material);
  sprite.center.set(0, 0);
  sprite.position.set(...shape.position);
  sprite.scale.set(width, height, 1);
  sprite.renderOrder = 4;
  return { object: sprite, dispose: () => [material, texture].forEach((it) => it.dispose()) };
}

/** Returns a text in white, and its ratio of width to height; undefined if the browser cannot draw it. */
function write(text: string): { texture: CanvasTexture; aspect: number } | undefined {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d");
  if (!context) return undefined;
  const font = (pixels: number) => `500 ${pixels}px system-ui, sans-serif`;
  context.font = font(FONT);
  const { width } = context.measureText(text);
  const pixels = Math.max(4, Math.min(FONT, Math.floor((FONT * MAX_WIDTH) / Math.max(1, width))));
  canvas.width = Math.max(1, Math.min(MAX_WIDTH, Math.ceil((width * pixels) / FONT)));
  canvas.height = Math.ceil(LINE * pixels);
  // Setting the size resets the settings.
  context.font = font(pixels);
  context.fillStyle = "#ffffff";
  context.textBaseline = "alphabetic";
  context.fillText(text, 0, pixels);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return { texture, aspect: canvas.width / canvas.height };
}

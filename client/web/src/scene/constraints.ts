// Constraints: a line from one anchor to the other, a mark at each, and an arrow for the force on the child. A gear's line is dashed. Its
// arrow has two heads if its child's joint turns: it is the torque about the joint's axis.
import { Group, InstancedMesh, Matrix4, MeshBasicMaterial, OctahedronGeometry, Quaternion, Color, Vector3, ConeGeometry, CylinderGeometry } from "three";
import { MAX_DRAWN, type Constraint, type ConstraintEnd } from "../state/constraints";
import { along, marker } from "./markers";
import { CONSTRAINT, SATURATED } from "./palette";

/** Sizes, as fractions of the size of the scene. */
const MARK = 0.014;
const LINE = 0.003;
const ARROW = 0.005;
const LONGEST = 0.7;
/** Length of a dash in a gear's line; the gaps are as long. */
const DASHES = 7;
/** Distance of the two heads of an arrow, as a part of a head's length. */
const BETWEEN_HEADS = 0.7;
/** Scale of the constraint under the pointer. */
const HOVERED = 2;

/** Finds the frame of a link, and the link of a joint; undefined if either does not exist. */
export type Finder = (end: ConstraintEnd) => Matrix4 | undefined;

/** The markers of all constraints. */
export class ConstraintMarks {
  readonly group = new Group();
  /** Ends of the drawn constraints, by name. */
  readonly anchors = new Map<string, readonly [Vector3, Vector3]>();
  private readonly material = new MeshBasicMaterial({ depthTest: false, transparent: true });
  private readonly marks = new InstancedMesh(new OctahedronGeometry(1), this.material, 2 * MAX_DRAWN);
  private readonly lines = new InstancedMesh(along(new CylinderGeometry(1, 1, 1, 8)), this.material, DASHES * MAX_DRAWN);
  private readonly shafts = new InstancedMesh(along(new CylinderGeometry(1, 1, 1, 8)), this.material, MAX_DRAWN);
  private readonly heads = new InstancedMesh(along(new ConeGeometry(1, 1, 12)), this.material, 2 * MAX_DRAWN);

  constructor() {
    for (const each of this.all()) {
      each.frustumCulled = false;
      each.renderOrder = 3;
      each.count = 0;
      this.group.add(each);
    }
  }

  /**
   * Draws these. `size` is the scene's size in metres. The arrow of `weight`, in newtons, is half as long; so is the arrow of the torque of
   * `weight` at this distance.
   */
  set(constraints: readonly Constraint[], find: Finder, hovered: string, size: number, weight: number): void {
    this.anchors.clear();
    for (const each of this.all()) each.count = 0;
    const color = new Color();
    for (const constraint of constraints.slice(0, MAX_DRAWN)) {
      const parent = anchor(constraint.parent, find);
      const child = anchor(constraint.child, find);
      if (!parent || !child) continue;
      this.anchors.set(constraint.name, [parent, child]);
      const isGear = constraint.kind === "gear";
      const grown = constraint.name === hovered ? HOVERED : 1;
      color.set(constraint.saturated ? SATURATED : CONSTRAINT);
      for (const at of [parent, child]) {
        add(this.marks, marker(at, new Quaternion(), grown * MARK * size, grown * MARK * size), color);
      }
      const way = child.clone().sub(parent);
      if (way.length() > LINE * size) this.line(parent, way, grown * LINE * size, isGear ? DASHES : 1, color);
      const force = new Vector3(...constraint.force);
      const torque = new Vector3(...constraint.torque);
      // A gear acts at its child's joint.
      const from = isGear ? child : new Vector3(...constraint.point);
      if (isGear && torque.length() > 0) this.arrow(from, torque, 2, size, weight * size, color);
      else this.arrow(from, force, 1, size, weight, color);
    }
    for (const each of this.all()) {
      each.instanceMatrix.needsUpdate = true;
      if (each.instanceColor) each.instanceColor.needsUpdate = true;
    }
  }

  /** Numbers of drawn lines, or dashes of lines, and of shafts and heads of arrows. */
  drawn(): { lines: number; shafts: number; heads: number } {
    return { lines: this.lines.count, shafts: this.shafts.count, heads: this.heads.count };
  }

  dispose(): void {
    for (const each of this.all()) {
      each.geometry.dispose();
      each.dispose();
    }
    this.material.dispose();
  }

  /** Draws a line of this many dashes; the first begins at `from` and the last ends at the other end. */
  private line(from: Vector3, way: Vector3, width: number, dashes: number, color: Color): void {
    const parts = 2 * dashes - 1;
    for (let part = 0; part < parts; part += 2) {
      const begin = from.clone().addScaledVector(way, part / parts);
      add(this.lines, marker(begin, toward(way), width, way.length() / parts), color);
    }
  }

  /**
   * Draws an arrow with this many heads. An arrow as large as `whole` is half as long as the scene. Arrows too short for their heads are left
   * out.
   */
  private arrow(from: Vector3, what: Vector3, heads: number, size: number, whole: number, color: Color): void {
    const length = Math.min(LONGEST, (0.5 * what.length()) / Math.max(whole, 1e-9)) * size;
    const head = 4 * ARROW * size;
    if (!(length > head * (1 + BETWEEN_HEADS * (heads - 1)))) return;
    const [way, turn] = [what.clone().normalize(), toward(what)];
    add(this.shafts, marker(from, turn, ARROW * size, length - head), color);
    for (let index = 0; index < heads; index += 1) {
      const base = from.clone().addScaledVector(way, length - head * (1 + BETWEEN_HEADS * index));
      add(this.heads, marker(base, turn, 2.2 * ARROW * size, head), color);
    }
  }

  private all(): InstancedMesh[] {
    return [this.marks, this.lines, this.shafts, this.heads];
  }
}

/** Draws one more of these. */
function add(to: InstancedMesh, place: Matrix4, color: Color): void {
  to.setMatrixAt(to.count, place);
  to.setColorAt(to.count, color);
  to.count += 1;
}

/** Returns the anchor of an end, world axes. */
function anchor(end: ConstraintEnd, find: Finder): Vector3 | undefined {
  const [x, y, z] = end.pose;
  // The frame of a gear's end is the frame of the link that its joint moves.
  const at = end.joint === "" ? new Vector3(x, y, z) : new Vector3();
  return end.robot === "" ? at : find(end) && at.applyMatrix4(find(end) ?? new Matrix4());
}

function toward(way: Vector3): Quaternion {
  return new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), way.clone().normalize());
}

// Constraints: a line from one anchor to the other, a mark at each, and an arrow for the force on the child.
import { Group, InstancedMesh, Matrix4, MeshBasicMaterial, OctahedronGeometry, Quaternion, Color, Vector3, ConeGeometry, CylinderGeometry } from "three";
import type { Constraint, ConstraintEnd } from "../state/constraints";
import { along, marker } from "./markers";
import { CONSTRAINT, SATURATED } from "./palette";

/** Constraints that are drawn at most. */
const MAX_CONSTRAINTS = 400;
/** Sizes, as fractions of the size of the scene. */
const MARK = 0.014;
const LINE = 0.003;
const ARROW = 0.005;
const LONGEST = 0.7;
/** How much larger the one under the pointer is. */
const HOVERED = 2;

/** Finds the frame of a link, and the link of a joint; undefined where there is none. */
export type Finder = (end: ConstraintEnd) => Matrix4 | undefined;

/** The markers of all constraints. */
export class ConstraintMarks {
  readonly group = new Group();
  /** Where the ends of those that are drawn are, by name. */
  readonly anchors = new Map<string, readonly [Vector3, Vector3]>();
  private readonly material = new MeshBasicMaterial({ depthTest: false, transparent: true });
  private readonly marks = new InstancedMesh(new OctahedronGeometry(1), this.material, 2 * MAX_CONSTRAINTS);
  private readonly lines = new InstancedMesh(along(new CylinderGeometry(1, 1, 1, 8)), this.material, MAX_CONSTRAINTS);
  private readonly shafts = new InstancedMesh(along(new CylinderGeometry(1, 1, 1, 8)), this.material, MAX_CONSTRAINTS);
  private readonly heads = new InstancedMesh(along(new ConeGeometry(1, 1, 12)), this.material, MAX_CONSTRAINTS);

  constructor() {
    for (const each of this.all()) {
      each.frustumCulled = false;
      each.renderOrder = 3;
      each.count = 0;
      this.group.add(each);
    }
  }

  /** Draws these. `size` is that of the scene in metres; the arrow of `weight`, in newtons, is half as long. */
  set(constraints: readonly Constraint[], find: Finder, hovered: string, size: number, weight: number): void {
    this.anchors.clear();
    let [marks, lines, arrows] = [0, 0, 0];
    const color = new Color();
    for (const constraint of constraints.slice(0, MAX_CONSTRAINTS)) {
      const parent = anchor(constraint.parent, find);
      const child = anchor(constraint.child, find);
      if (!parent || !child) continue;
      this.anchors.set(constraint.name, [parent, child]);
      const grown = constraint.name === hovered ? HOVERED : 1;
      color.set(constraint.saturated ? SATURATED : CONSTRAINT);
      for (const at of [parent, child]) {
        this.marks.setMatrixAt(marks, marker(at, new Quaternion(), grown * MARK * size, grown * MARK * size));
        this.marks.setColorAt(marks, color);
        marks += 1;
      }
      const way = child.clone().sub(parent);
      if (way.length() > LINE * size) {
        this.lines.setMatrixAt(lines, marker(parent, toward(way), grown * LINE * size, way.length()));
        this.lines.setColorAt(lines, color);
        lines += 1;
      }
      const force = new Vector3(...constraint.force);
      const length = Math.min(LONGEST, (0.5 * force.length()) / Math.max(weight, 1e-9)) * size;
      const head = 4 * ARROW * size;
      if (!(length > head)) continue;
      const [from, turn] = [new Vector3(...constraint.point), toward(force)];
      this.shafts.setMatrixAt(arrows, marker(from, turn, ARROW * size, length - head));
      this.heads.setMatrixAt(arrows, marker(from.addScaledVector(force.normalize(), length - head), turn, 2.2 * ARROW * size, head));
      for (const part of [this.shafts, this.heads]) part.setColorAt(arrows, color);
      arrows += 1;
    }
    this.marks.count = marks;
    this.lines.count = lines;
    this.shafts.count = this.heads.count = arrows;
    for (const each of this.all()) {
      each.instanceMatrix.needsUpdate = true;
      if (each.instanceColor) each.instanceColor.needsUpdate = true;
    }
  }

  dispose(): void {
    for (const each of this.all()) {
      each.geometry.dispose();
      each.dispose();
    }
    this.material.dispose();
  }

  private all(): InstancedMesh[] {
    return [this.marks, this.lines, this.shafts, this.heads];
  }
}

/** Where an end is held, world axes. */
function anchor(end: ConstraintEnd, find: Finder): Vector3 | undefined {
  const [x, y, z] = end.pose;
  // The frame of a gear's end is that of the link that its joint moves.
  const at = end.joint === "" ? new Vector3(x, y, z) : new Vector3();
  return end.robot === "" ? at : find(end) && at.applyMatrix4(find(end) ?? new Matrix4());
}

function toward(way: Vector3): Quaternion {
  return new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), way.clone().normalize());
}

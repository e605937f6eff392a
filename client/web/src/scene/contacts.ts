// Contacts: a dot at each point, and an arrow whose length is proportional to the force.
import { ConeGeometry, CylinderGeometry, Group, InstancedMesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3 } from "three";
import { threeDigits } from "../panels/quantity";
import type { ContactPoint } from "../state/world";
import type { Label } from "./labels";
import { along, marker } from "./markers";
import { CONTACT } from "./palette";

/** Maximum number of drawn contacts. */
const MAX_CONTACTS = 400;
/** Sizes, as fractions of the size of the scene. */
const DOT = 0.012;
const LONGEST = 0.7;
const WIDTH = 0.006;
/** Maximum number of written forces, and their minimum as a share of the weight. */
const MAX_LABELS = 24;
const MIN_LABEL = 0.01;
/** Metres, and shares of the weight: smaller changes are invisible. */
const MIN_MOTION = 1e-5;
const MIN_FORCE = 2e-3;

/** The markers of all contacts. */
export class ContactMarks {
  readonly group = new Group();
  /** Drawn contacts and their scale. */
  private drawn: { contacts: ContactPoint[]; size: number; weight: number } = { contacts: [], size: 0, weight: 0 };
  private readonly material = new MeshBasicMaterial({ color: CONTACT, depthTest: false, transparent: true });
  private readonly dots = new InstancedMesh(new SphereGeometry(1, 12, 8), this.material, MAX_CONTACTS);
  private readonly shafts = new InstancedMesh(along(new CylinderGeometry(1, 1, 1, 10)), this.material, MAX_CONTACTS);
  private readonly heads = new InstancedMesh(along(new ConeGeometry(1, 1, 14)), this.material, MAX_CONTACTS);

  constructor() {
    for (const marks of this.all()) {
      marks.frustumCulled = false;
      marks.renderOrder = 3;
      marks.count = 0;
      this.group.add(marks);
    }
  }

  /**
   * Draws these contacts. `size` is the scene's size in metres; the arrow of `weight`, in newtons, is half as long.
   * Returns whether the picture has changed.
   */
  set(contacts: ContactPoint[], size: number, weight: number): boolean {
    const shown = contacts.slice(0, MAX_CONTACTS);
    const { drawn } = this;
    if (drawn.size === size && drawn.weight === weight && isSame(drawn.contacts, shown, MIN_FORCE * weight)) return false;
    this.drawn = { contacts: shown, size, weight };
    let arrows = 0;
    shown.forEach(({ point, normal, normalForce }, index) => {
      const at = new Vector3(...point);
      const turn = new Quaternion().setFromUnitVectors(Z, new Vector3(...normal).normalize());
      this.dots.setMatrixAt(index, marker(at, turn, DOT * size, DOT * size));
      const length = Math.min(LONGEST, (0.5 * normalForce) / Math.max(weight, 1e-9)) * size;
      const head = 4 * WIDTH * size;
      if (length < head) return;
      this.shafts.setMatrixAt(arrows, marker(at, turn, WIDTH * size, length - head));
      const tip = at.clone().addScaledVector(Z.clone().applyQuaternion(turn), length - head);
      this.heads.setMatrixAt(arrows, marker(tip, turn, 2.2 * WIDTH * size, head));
      arrows += 1;
    });
    this.dots.count = shown.length;
    this.shafts.count = this.heads.count = arrows;
    for (const marks of this.all()) marks.instanceMatrix.needsUpdate = true;
    return true;
  }

  /** Returns the arrow's length for a newton; 0 without a weight for the scale. */
  metresPerNewton(): number {
    const { contacts, size, weight } = this.drawn;
    return contacts.length === 0 ? 0 : (0.5 * size) / Math.max(weight, 1e-9);
  }

  /** Returns labels with the forces of the strongest drawn contacts. */
  labels(): Label[] {
    if (!this.group.visible) return [];
    const strongest = this.drawn.contacts.toSorted((a, b) => b.normalForce - a.normalForce).slice(0, MAX_LABELS);
    const least = MIN_LABEL * this.drawn.weight;
    return strongest.filter(({ normalForce }) => normalForce > least).map(({ point, normalForce }) => ({ text: `${threeDigits(normalForce)} N`, at: new Vector3(...point) }));
  }

  dispose(): void {
    for (const marks of this.all()) {
      marks.geometry.dispose();
      marks.dispose();
    }
    this.material.dispose();
  }

  private all(): InstancedMesh[] {
    return [this.dots, this.shafts, this.heads];
  }
}

const Z = new Vector3(0, 0, 1);

function isSame(a: ContactPoint[], b: ContactPoint[], force: number): boolean {
  const isNear = (one: ContactPoint, other: ContactPoint | undefined): boolean =>
    other !== undefined &&
    Math.abs(one.normalForce - other.normalForce) <= force &&
    one.point.every((value, index) => Math.abs(value - (other.point[index] ?? NaN)) <= MIN_MOTION) &&
    one.normal.every((value, index) => Math.abs(value - (other.normal[index] ?? NaN)) <= MIN_FORCE);
  return a.length === b.length && a.every((one, index) => isNear(one, b[index]));
}

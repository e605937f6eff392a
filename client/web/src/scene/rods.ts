// Rods, which lines cannot be: browsers draw those one pixel wide. They are seen through what is before them.
import { CylinderGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3 } from "three";

/** Of an axis, for a length of one. */
const THICKNESS = 0.03;
const AXES = [
  { colour: 0xe0453f, direction: new Vector3(1, 0, 0) },
  { colour: 0x3fa34d, direction: new Vector3(0, 1, 0) },
  { colour: 0x3b78e7, direction: new Vector3(0, 0, 1) },
] as const;
const Z = new Vector3(0, 0, 1);

/** From its foot along z, one long and one in radius. */
const ROD = new CylinderGeometry(1, 1, 1, 10).translate(0, 0.5, 0).rotateX(Math.PI / 2);
const BALL = new SphereGeometry(1, 16, 12);
const MATERIALS = AXES.map(({ colour }) => seenThrough(colour));

function seenThrough(color: number): MeshBasicMaterial {
  // Transparent things come last, and so do these.
  return new MeshBasicMaterial({ color, depthTest: false, transparent: true });
}

/** The axes of a frame: x red, y green, z blue, one long. All share what they are made of. */
export class Triad {
  readonly group = new Group();

  constructor() {
    AXES.forEach(({ direction }, index) => {
      const rod = new Mesh(ROD, MATERIALS[index]);
      rod.quaternion.setFromUnitVectors(Z, direction);
      rod.scale.set(THICKNESS, THICKNESS, 1);
      rod.renderOrder = 2;
      this.group.add(rod);
    });
  }
}

/** A rod between two points, with a ball at its end. */
export class Rod {
  readonly group = new Group();
  private readonly material: MeshBasicMaterial;
  private readonly rod: Mesh;
  private readonly ball: Mesh;

  constructor(color: number) {
    this.material = seenThrough(color);
    this.rod = new Mesh(ROD, this.material);
    this.ball = new Mesh(BALL, this.material);
    for (const mesh of [this.rod, this.ball]) {
      mesh.renderOrder = 4;
      this.group.add(mesh);
    }
    this.group.visible = false;
  }

  /** Metres. */
  show(from: Vector3, to: Vector3, width: number): void {
    const way = to.clone().sub(from);
    const length = Math.max(way.length(), 1e-6);
    this.rod.position.copy(from);
    this.rod.quaternion.copy(new Quaternion().setFromUnitVectors(Z, way.divideScalar(length)));
    this.rod.scale.set(width, width, length);
    this.ball.position.copy(to);
    this.ball.scale.setScalar(2.6 * width);
    this.group.visible = true;
  }

  hide(): void {
    this.group.visible = false;
  }

  dispose(): void {
    this.material.dispose();
  }
}

// Axes and rods as cylinders, since WebGL draws lines one pixel wide. They are drawn over everything else.
import { CylinderGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3 } from "three";

/** Radius of an axis of unit length. */
const THICKNESS = 0.03;
const AXES = [
  { colour: 0xe0453f, direction: new Vector3(1, 0, 0) },
  { colour: 0x3fa34d, direction: new Vector3(0, 1, 0) },
  { colour: 0x3b78e7, direction: new Vector3(0, 0, 1) },
] as const;
const Z = new Vector3(0, 0, 1);

/** From the origin along z, of unit length and radius. */
const ROD = new CylinderGeometry(1, 1, 1, 10).translate(0, 0.5, 0).rotateX(Math.PI / 2);
const BALL = new SphereGeometry(1, 16, 12);
const MATERIALS = AXES.map(({ colour }) => overlay(colour));

function overlay(color: number): MeshBasicMaterial {
  // Transparent objects are drawn last.
  return new MeshBasicMaterial({ color, depthTest: false, transparent: true });
}

/** The axes of a frame, of unit length: x red, y green, z blue. All share geometry and materials. */
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
    this.material = overlay(color);
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

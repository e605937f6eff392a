// Axes of joints, and centres of mass of links and of robots.
import { Color, CylinderGeometry, Group, InstancedMesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3 } from "three";
import { ellipsoidOf } from "./inertia";
import { along, marker } from "./markers";
import { MASS, SLIDES, TURNS, WHOLE_MASS } from "./palette";
import type { RobotView } from "./robot-view";

/** Maximum number of marked joints and links. */
const MAX = 4000;
/** Sizes, as fractions of the size of the robot. */
const AXIS_LENGTH = 0.3;
const AXIS_WIDTH = 0.008;
/** Radius of the ball of a link that has the whole mass. */
const BALL = 0.07;
const LEAST_BALL = 0.012;

/** Marks to draw. */
export interface Marked {
  axes: boolean;
  masses: boolean;
  /** Ellipsoids of the inertia of each link. */
  inertias?: boolean;
}

/** The marks of all robots, drawn over everything else. */
export class StructureMarks {
  readonly group = new Group();
  /** Centre of mass of each marked robot, world axes, by name. */
  readonly centres = new Map<string, Vector3>();
  private readonly material = new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.85 });
  private readonly axes = new InstancedMesh(along(new CylinderGeometry(1, 1, 1, 8)), this.material, MAX);
  private readonly balls = new InstancedMesh(new SphereGeometry(1, 14, 10), this.material, MAX);
  private readonly soft = new MeshBasicMaterial({ color: MASS, depthTest: false, transparent: true, opacity: 0.3 });
  private readonly ellipsoids = new InstancedMesh(new SphereGeometry(1, 20, 14), this.soft, MAX);
  private count = { axes: 0, balls: 0, ellipsoids: 0 };

  constructor() {
    for (const each of this.all()) {
      each.frustumCulled = false;
      each.renderOrder = 3;
      each.count = 0;
      this.group.add(each);
    }
  }

  /** Marks these robots. `sizeOf` is the radius of a robot, metres. */
  set(views: Iterable<RobotView>, sizeOf: (view: RobotView) => number, { axes, masses, inertias = false }: Marked): void {
    // Without marks to draw or to remove, this costs nothing.
    if (!axes && !masses && !inertias && this.count.axes + this.count.balls + this.count.ellipsoids === 0) return;
    this.count = { axes: 0, balls: 0, ellipsoids: 0 };
    this.centres.clear();
    for (const view of views) {
      const size = sizeOf(view);
      if (axes) this.markAxes(view, size);
      if (masses) this.markMasses(view, size);
      if (inertias) this.markInertias(view);
    }
    this.axes.count = this.count.axes;
    this.balls.count = this.count.balls;
    this.ellipsoids.count = this.count.ellipsoids;
    for (const each of this.all()) {
      each.instanceMatrix.needsUpdate = true;
      if (each.instanceColor) each.instanceColor.needsUpdate = true;
    }
  }

  /** Numbers of drawn axes, balls and ellipsoids. */
  drawn(): { axes: number; balls: number; ellipsoids: number } {
    return { ...this.count };
  }

  dispose(): void {
    for (const each of this.all()) {
      each.geometry.dispose();
      each.dispose();
    }
    this.material.dispose();
    this.soft.dispose();
  }

  private all(): InstancedMesh[] {
    return [this.axes, this.balls, this.ellipsoids];
  }

  private markInertias(view: RobotView): void {
    view.scene.links.forEach(({ mass, centreOfMass, inertia }, index) => {
      const ellipsoid = centreOfMass && inertia && ellipsoidOf(mass, [...centreOfMass], inertia);
      if (!ellipsoid || this.count.ellipsoids >= MAX) return;
      this.ellipsoids.setMatrixAt(this.count.ellipsoids, ellipsoid.premultiply(view.worldFromLink(index)));
      this.count.ellipsoids += 1;
    });
  }

  private markAxes(view: RobotView, size: number): void {
    const { scene } = view;
    const indices = new Map(scene.links.map(({ name }, index) => [name, index]));
    for (const { type, child, axis } of scene.joints ?? []) {
      const index = indices.get(child);
      if (!axis || index === undefined || type === "fixed" || this.count.axes >= MAX) continue;
      const link = view.worldFromLink(index);
      const way = new Vector3(...axis).transformDirection(link);
      const from = new Vector3().setFromMatrixPosition(link).addScaledVector(way, -0.5 * AXIS_LENGTH * size);
      const turn = new Quaternion().setFromUnitVectors(Z, way);
      this.axes.setMatrixAt(this.count.axes, marker(from, turn, AXIS_WIDTH * size, AXIS_LENGTH * size));
      this.axes.setColorAt(this.count.axes, new Color(type === "prismatic" ? SLIDES : TURNS));
      this.count.axes += 1;
    }
  }

  private markMasses(view: RobotView, size: number): void {
    const { scene } = view;
    const total = scene.links.reduce((sum, { mass }) => sum + mass, 0);
    if (!(total > 0)) return;
    const centre = new Vector3();
    scene.links.forEach(({ mass, centreOfMass }, index) => {
      if (!centreOfMass || !(mass > 0)) return;
      const at = new Vector3(...centreOfMass).applyMatrix4(view.worldFromLink(index));
      centre.addScaledVector(at, mass / total);
      // The ball's volume is proportional to the mass.
      this.ball(at, Math.max(LEAST_BALL, BALL * Math.cbrt(mass / total)) * size, MASS);
    });
    this.centres.set(scene.robot, centre);
    if (scene.links.length > 1) this.ball(centre, 0.6 * BALL * size, WHOLE_MASS);
  }

  private ball(at: Vector3, radius: number, color: number): void {
    if (this.count.balls >= MAX) return;
    this.balls.setMatrixAt(this.count.balls, marker(at, UNTURNED, radius, radius));
    this.balls.setColorAt(this.count.balls, new Color(color));
    this.count.balls += 1;
  }
}

const Z = new Vector3(0, 0, 1);
const UNTURNED = new Quaternion();

// Positions of marked axes and centres of mass.
import { BoxGeometry, Group, Mesh, MeshStandardMaterial } from "three";
import { expect, test } from "vitest";
import type { RobotScene } from "../state/scene";
import type { MeshCache } from "./mesh-cache";
import { Materials } from "./materials";
import { RobotView } from "./robot-view";
import { StructureMarks } from "./structure-marks";

const SCENE: RobotScene = {
  robot: "arm",
  layoutVersion: 1n,
  links: [
    { name: "base", parent: -1, movable: false, mass: 3, centreOfMass: [0, 0, 0.5], inertia: [1, 0, 0, 1, 0, 1] },
    { name: "link", parent: 0, movable: true, mass: 1, centreOfMass: [1, 0, 0], inertia: [1, 0, 0, 1, 0, 1] },
    { name: "tool", parent: 1, movable: true, mass: 0, centreOfMass: [0, 0, 0] },
  ],
  joints: [
    { name: "elbow", type: "revolute", child: "link", axis: [0, 0, 1], damping: 0, friction: 0 },
    { name: "flange", type: "fixed", child: "tool", damping: 0, friction: 0 },
  ],
  visuals: [],
  collisions: [],
  colliders: [],
};

const meshes = { acquire: () => Promise.resolve(new Group().add(new Mesh(new BoxGeometry(), new MeshStandardMaterial()))), release: () => undefined };

test("a robot's centre of mass is the mean of its links' by mass, and fixed joints have no axis", () => {
  const view = new RobotView(SCENE, meshes as unknown as MeshCache, new Materials(), () => undefined);
  // The second link a metre up, a quarter turn about z.
  view.pose(Float64Array.of(0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, Math.SQRT1_2, Math.SQRT1_2, 0, 0, 1, 0, 0, 0, 1));
  const marks = new StructureMarks();
  marks.set([view], () => 1, { axes: true, masses: true });
  const [x, y, z] = marks.centres.get("arm")?.toArray() ?? [];
  expect(x).toBeCloseTo(0, 9);
  expect(y).toBeCloseTo(0.25, 9);
  expect(z).toBeCloseTo(0.625, 9);
  // One axis; two links with mass, and the whole robot.
  expect(marks.drawn()).toEqual({ axes: 1, balls: 3, ellipsoids: 0 });
  marks.set([view], () => 1, { axes: false, masses: false });
  expect(marks.drawn()).toEqual({ axes: 0, balls: 0, ellipsoids: 0 });
});

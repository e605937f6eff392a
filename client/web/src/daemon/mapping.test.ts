// Conversion of messages from the wire into the page's types.
import { create } from "@bufbuild/protobuf";
import { describe, expect, test } from "vitest";
import { ListClientsResponseSchema } from "../gen/simd/v1/client_pb";
import { Base, EntityInfoSchema, RobotSceneSchema } from "../gen/simd/v1/entity_pb";
import { JointInfoSchema, JointLayoutSchema, JointMode, JointType, NextJointStatesResponseSchema } from "../gen/simd/v1/joint_pb";
import { JointBindingSchema, ParameterSchema } from "../gen/simd/v1/parameter_pb";
import { PaceMode, PhysicsSchema } from "../gen/simd/v1/simulation_pb";
import { axesOf, frameOf, parameterOf, physicsOf, sceneOf, sourcesOf } from "./mapping";

describe("axes", () => {
  test("a revolute joint is one row with its limits", () => {
    const joint = create(JointInfoSchema, {
      name: "elbow",
      type: JointType.REVOLUTE,
      childLink: "forearm",
      limits: { lower: -1, upper: 2, velocity: 3 },
      mode: JointMode.HOLD,
      positionIndex: 4,
      velocityIndex: 3,
    });
    expect(axesOf("arm", joint)).toEqual([
      {
        key: "arm/elbow",
        robot: "arm",
        joint: "elbow",
        axis: 0,
        label: "elbow",
        kind: "angle",
        lower: -1,
        upper: 2,
        velocityLimit: 3,
        positionIndex: 4,
        velocityIndex: 3,
        childLink: "forearm",
        actuated: true,
        claimedBy: "",
      },
    ]);
  });

  test("a joint without limits has none, and a prismatic one is a length", () => {
    const [axis] = axesOf("arm", create(JointInfoSchema, { name: "lift", type: JointType.PRISMATIC }));
    expect(axis).not.toHaveProperty("lower");
    expect(axis).not.toHaveProperty("effortLimit");
    expect(axis?.kind).toBe("length");
  });

  test("a planar joint is three rows, of which the first has the joint's own key", () => {
    const joint = create(JointInfoSchema, { name: "base", type: JointType.PLANAR, positionIndex: 7, velocityIndex: 6 });
    const axes = axesOf("cart", joint);
    expect(axes.map(({ key, label, kind }) => [key, label, kind])).toEqual([
      ["cart/base", "base x", "length"],
      ["cart/base/1", "base y", "length"],
      ["cart/base/2", "base angle", "angle"],
    ]);
    expect(axes.map(({ positionIndex, velocityIndex }) => [positionIndex, velocityIndex])).toEqual([[7, 6], [8, 7], [9, 8]]);
  });

  test("a joint that follows another takes no targets, and says whom it follows", () => {
    const joint = create(JointInfoSchema, { name: "finger", type: JointType.REVOLUTE, mode: JointMode.NONE, mimic: { joint: "thumb" } });
    expect(axesOf("hand", joint)[0]).toMatchObject({ actuated: false, mimics: "thumb" });
  });

  test("a spherical joint is three rows of one quaternion", () => {
    const joint = create(JointInfoSchema, { name: "hip", type: JointType.SPHERICAL, positionIndex: 7, velocityIndex: 6, limits: { effort: 3 } });
    const axes = axesOf("dog", joint);
    expect(axes.map(({ key, label, positionIndex, velocityIndex }) => [key, label, positionIndex, velocityIndex])).toEqual([
      ["dog/hip", "hip roll", 7, 6],
      ["dog/hip/1", "hip pitch", 7, 7],
      ["dog/hip/2", "hip yaw", 7, 8],
    ]);
    expect(axes.every(({ isBall, effortLimit }) => isBall === true && effortLimit === 3)).toBe(true);
  });

  test("fixed and floating joints are not rows", () => {
    for (const type of [JointType.FIXED, JointType.FLOATING]) {
      expect(axesOf("arm", create(JointInfoSchema, { name: "x", type }))).toEqual([]);
    }
  });
});

describe("scenes", () => {
  const layout = create(JointLayoutSchema, {
    joints: [
      { name: "bolt", type: JointType.FIXED, childLink: "plate", velocityCount: 0 },
      { name: "turn", type: JointType.REVOLUTE, childLink: "arm", velocityCount: 1 },
      { name: "weld", type: JointType.FIXED, childLink: "tool", velocityCount: 0 },
    ],
  });
  const links = [{ name: "base" }, { name: "plate", parent: "base" }, { name: "arm", parent: "plate" }, { name: "tool", parent: "arm" }];

  test("links below a moving joint of a fixed robot can move", () => {
    const entity = create(EntityInfoSchema, { name: "r", base: Base.FIXED, links });
    const scene = sceneOf(entity, layout, create(RobotSceneSchema));
    expect(scene.links.map((link) => link.movable)).toEqual([false, false, true, true]);
    expect(scene.links.map((link) => link.parent)).toEqual([-1, 0, 1, 2]);
  });

  test("all links of a free robot can move", () => {
    const entity = create(EntityInfoSchema, { name: "r", base: Base.FREE, links });
    expect(sceneOf(entity, layout, create(RobotSceneSchema)).links.every((link) => link.movable)).toBe(true);
  });

  test("links have their masses, and joints their axes and limits", () => {
    const entity = create(EntityInfoSchema, {
      name: "r",
      links: [{ name: "base", mass: 2 }, { name: "arm", parent: "base", mass: 1, centerOfMass: { x: 0.1, y: 0, z: 0 }, inertia: [1, 0, 0, 2, 0, 3] }],
    });
    const joints = [{ name: "elbow", type: JointType.REVOLUTE, childLink: "arm", axis: { x: 0, y: 1, z: 0 }, limits: { lower: -1, effort: 5 }, damping: 0.1 }];
    const scene = sceneOf(entity, create(JointLayoutSchema, { robot: "r", joints }), create(RobotSceneSchema));
    expect(scene.links[1]).toMatchObject({ name: "arm", mass: 1, centreOfMass: [0.1, 0, 0], inertia: [1, 0, 0, 2, 0, 3] });
    expect(scene.joints).toEqual([{ name: "elbow", type: "revolute", child: "arm", axis: [0, 1, 0], lower: -1, effort: 5, damping: 0.1, friction: 0 }]);
  });

  test("absent fields have the defaults of the schema", () => {
    const entity = create(EntityInfoSchema, { name: "r", links });
    const wire = create(RobotSceneSchema, {
      visuals: [
        { link: 1, geometry: { case: "mesh", value: { sha256: "ab" } } },
        { geometry: { case: "plane", value: {} }, pose: { orientation: { x: 0, y: 0, z: 0, w: 0 } } },
        { link: 2 },
      ],
    });
    expect(sceneOf(entity, layout, wire).visuals).toEqual([
      { link: 1, linkFromShape: [0, 0, 0, 0, 0, 0, 1], geometry: { kind: "mesh", sha256: "ab", uri: "", scale: [1, 1, 1] } },
      { link: 0, linkFromShape: [0, 0, 0, 0, 0, 0, 1], geometry: { kind: "plane", normal: [0, 0, 1] } },
    ]);
  });
});

describe("frames", () => {
  const response = create(NextJointStatesResponseSchema, {
    states: {
      stamp: { sequence: 9n, epoch: 1n, step: 5n, simTime: 0.005 },
      robots: [
        { robot: "arm", layoutVersion: 2n, position: [1], velocity: [2], effort: [3], target: [4], mode: [JointMode.POSITION], flags: [1] },
        { robot: "leg", layoutVersion: 3n, position: [1] },
      ],
    },
    linkPoses: [
      { robot: "arm", layoutVersion: 2n, poses: [0, 0, 1, 0, 0, 0, 1] },
      { robot: "leg", layoutVersion: 3n, poses: [0, 0, 2, 0, 0, 0, 1] },
    ],
    contacts: [{ robotA: "arm", point: { x: 1, y: 2, z: 3 }, normalForce: 7 }],
  });

  test("a state of a known layout is taken as it is", () => {
    const frame = frameOf(response, new Map([["arm", 2n], ["leg", 3n]]), 12);
    expect(frame).toMatchObject({ sequence: 9n, epoch: 1n, step: 5n, simTime: 0.005, receivedAt: 12 });
    expect(frame?.joints.get("arm")).toEqual({ position: [1], velocity: [2], effort: [3], target: [4], mode: ["position"], flags: [1] });
    expect([...(frame?.poses.get("leg") ?? [])]).toEqual([0, 0, 2, 0, 0, 0, 1]);
    expect(frame?.contacts).toMatchObject([{ robotA: "arm", point: [1, 2, 3], normal: [0, 0, 1], normalForce: 7 }]);
  });

  test("a robot whose layout is another than the known one is left out", () => {
    const frame = frameOf(response, new Map([["arm", 1n], ["leg", 3n]]), 0);
    expect([...(frame?.joints.keys() ?? [])]).toEqual(["leg"]);
    expect([...(frame?.poses.keys() ?? [])]).toEqual(["leg"]);
  });

  test("an answer without a state is not a frame", () => {
    expect(frameOf(create(NextJointStatesResponseSchema), new Map(), 0)).toBeUndefined();
  });
});

test("sliders have a range, and buttons count", () => {
  const slider = create(ParameterSchema, { name: "speed", kind: { case: "slider", value: { minimum: 1, maximum: 5, value: 3 } } });
  const button = create(ParameterSchema, { name: "go", kind: { case: "button", value: { presses: 2n } } });
  expect(parameterOf(slider)).toEqual({ name: "speed", kind: "slider", minimum: 1, maximum: 5, value: 3, presses: 0n, joint: "" });
  const joint = create(JointBindingSchema, { robot: "arm", joint: "elbow" });
  const bound = create(ParameterSchema, { ...slider, joint });
  expect(parameterOf(bound).joint).toBe("arm/elbow");
  expect(parameterOf(button)).toMatchObject({ kind: "button", presses: 2n });
});

test("the pace mode is mapped apart from the factor", () => {
  const physics = create(PhysicsSchema, { timeStep: 1e-3, substeps: 2, realTimeFactor: 1, pace: PaceMode.AS_FAST_AS_POSSIBLE });
  expect(physicsOf(physics)).toMatchObject({ asFastAsPossible: true, timeStep: 1e-3, substeps: 2, gravity: [0, 0, 0] });
});

test("targets of clients without a name have no source", () => {
  const { targets } = create(ListClientsResponseSchema, {
    targets: [{ robot: "arm", joint: "elbow", client: "demo" }, { robot: "arm", joint: "wrist" }],
  });
  expect([...sourcesOf(targets)]).toEqual([["arm/elbow", "demo"]]);
});

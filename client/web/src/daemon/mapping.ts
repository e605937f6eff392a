// Conversion from messages to the state of the page: pure functions.
import type { ClientInfo, TargetSource } from "../gen/simd/v1/client_pb";
import type { Contact } from "../gen/simd/v1/contact_pb";
import { Base, Disposition, LoadPhase, Severity, type EntityInfo, type LoadProgress } from "../gen/simd/v1/entity_pb";
import type { LoadReport as WireReport, RobotScene as WireScene, Shape as WireShape } from "../gen/simd/v1/entity_pb";
import type { Pose as WirePose, Vector3 } from "../gen/simd/v1/geometry_pb";
import { JointMode, JointType, type JointInfo, type JointLayout } from "../gen/simd/v1/joint_pb";
import type { NextJointStatesResponse, RobotJointStates } from "../gen/simd/v1/joint_pb";
import type { Parameter as WireParameter } from "../gen/simd/v1/parameter_pb";
import { PaceMode, SimulationState, type Physics as WirePhysics, type RequestLimits } from "../gen/simd/v1/simulation_pb";
import type { WorldStatistics } from "../gen/simd/v1/simulation_pb";
import type { Finding, LoadReport, Loading } from "../state/report";
import type { Geometry, Pose, RobotScene, SceneJoint, SceneLink, Shape, Vector } from "../state/scene";
import type { Axis, Client, ContactPoint, Frame, JointValues, RequestBytes, Mode, Parameter, Physics, Robot } from "../state/world";
import type { Simulation } from "../state/world";

const MODES: Record<JointMode, Mode> = {
  [JointMode.UNSPECIFIED]: "none",
  [JointMode.PASSIVE]: "passive",
  [JointMode.POSITION]: "position",
  [JointMode.VELOCITY]: "velocity",
  [JointMode.EFFORT]: "effort",
  [JointMode.HOLD]: "hold",
  [JointMode.NONE]: "none",
};

const PLANAR = [
  { suffix: "x", kind: "length" },
  { suffix: "y", kind: "length" },
  { suffix: "angle", kind: "angle" },
] as const;

/** A robot, from its entity and its joint layout. */
export function robotOf(entity: EntityInfo, layout: JointLayout): Robot {
  return {
    name: entity.name,
    model: entity.model,
    layoutVersion: entity.layoutVersion,
    axes: layout.joints.flatMap((joint) => axesOf(entity.name, joint)),
    links: entity.links.map((link) => link.name),
    disabledReason: entity.disabledReason,
    claimedBy: entity.claimedBy,
    mass: entity.mass,
  };
}

const BALL = ["roll", "pitch", "yaw"] as const;

/** The axes of a joint: three for planar and spherical ones, none for fixed and floating ones, else one. */
export function axesOf(robot: string, joint: JointInfo): Axis[] {
  const base = {
    robot,
    joint: joint.name,
    childLink: joint.childLink,
    actuated: joint.mode !== JointMode.NONE,
    claimedBy: joint.claimedBy,
    ...(joint.mimic && { mimics: joint.mimic.joint }),
  };
  switch (joint.type) {
    case JointType.REVOLUTE:
    case JointType.CONTINUOUS:
    case JointType.PRISMATIC: {
      const limits = joint.limits;
      return [
        {
          ...base,
          key: `${robot}/${joint.name}`,
          axis: 0,
          label: joint.name,
          kind: joint.type === JointType.PRISMATIC ? "length" : "angle",
          positionIndex: joint.positionIndex,
          velocityIndex: joint.velocityIndex,
          ...(limits?.lower !== undefined && { lower: limits.lower }),
          ...(limits?.upper !== undefined && { upper: limits.upper }),
          ...(limits?.velocity !== undefined && { velocityLimit: limits.velocity }),
          ...(limits?.effort !== undefined && { effortLimit: limits.effort }),
        },
      ];
    }
    case JointType.PLANAR:
      return PLANAR.map(({ suffix, kind }, axis) => ({
        ...base,
        key: axis === 0 ? `${robot}/${joint.name}` : `${robot}/${joint.name}/${axis}`,
        axis,
        label: `${joint.name} ${suffix}`,
        kind,
        positionIndex: joint.positionIndex + axis,
        velocityIndex: joint.velocityIndex + axis,
      }));
    case JointType.SPHERICAL: {
      const limits = joint.limits;
      return BALL.map((suffix, axis) => ({
        ...base,
        key: axis === 0 ? `${robot}/${joint.name}` : `${robot}/${joint.name}/${axis}`,
        axis,
        label: `${joint.name} ${suffix}`,
        kind: "angle" as const,
        isBall: true as const,
        positionIndex: joint.positionIndex,
        velocityIndex: joint.velocityIndex + axis,
        ...(limits?.velocity !== undefined && { velocityLimit: limits.velocity }),
        ...(limits?.effort !== undefined && { effortLimit: limits.effort }),
      }));
    }
    default:
      return [];
  }
}

/** The shapes of a robot. */
export function sceneOf(entity: EntityInfo, layout: JointLayout, scene: WireScene): RobotScene {
  return {
    robot: entity.name,
    layoutVersion: entity.layoutVersion,
    links: linksOf(entity, layout),
    joints: layout.joints.map(jointOf),
    visuals: scene.visuals.flatMap(shapeOf),
    collisions: scene.collisions.flatMap(shapeOf),
    colliders: scene.colliders.flatMap(shapeOf),
  };
}

function linksOf(entity: EntityInfo, layout: JointLayout): SceneLink[] {
  const moving = new Set(layout.joints.filter((joint) => joint.velocityCount > 0).map((joint) => joint.childLink));
  const indices = new Map(entity.links.map((link, index) => [link.name, index]));
  const links: SceneLink[] = [];
  // Parents come before their children.
  for (const { name, parent, mass, centerOfMass, inertia } of entity.links) {
    const index = indices.get(parent) ?? -1;
    const carried = links[index]?.movable ?? (index < 0 && entity.base !== Base.FIXED);
    links.push({ name, parent: index, movable: carried || moving.has(name), mass, centreOfMass: vectorOf(centerOfMass), inertia });
  }
  return links;
}

const TYPES: Record<JointType, SceneJoint["type"]> = {
  [JointType.UNSPECIFIED]: "joint",
  [JointType.FIXED]: "fixed",
  [JointType.REVOLUTE]: "revolute",
  [JointType.CONTINUOUS]: "continuous",
  [JointType.PRISMATIC]: "prismatic",
  [JointType.PLANAR]: "planar",
  [JointType.SPHERICAL]: "spherical",
  [JointType.FLOATING]: "floating",
};

function jointOf({ name, type, childLink, axis, limits, damping, friction, mimic, tendon }: JointInfo): SceneJoint {
  return {
    name,
    type: TYPES[type] ?? "joint",
    child: childLink,
    damping,
    friction,
    ...(axis && { axis: vectorOf(axis) }),
    ...(limits?.lower !== undefined && { lower: limits.lower }),
    ...(limits?.upper !== undefined && { upper: limits.upper }),
    ...(limits?.effort !== undefined && { effort: limits.effort }),
    ...(limits?.velocity !== undefined && { velocity: limits.velocity }),
    ...(mimic && { mimics: mimic.joint }),
    ...(tendon && { pulls: tendon.terms.map(({ joint }) => joint) }),
  };
}

function shapeOf(shape: WireShape): Shape[] {
  const geometry = geometryOf(shape);
  if (!geometry) return [];
  const { color, texture, textureRepeat: repeat } = shape;
  return [
    {
      link: shape.link,
      linkFromShape: poseOf(shape.pose),
      geometry,
      ...(color && { color: [color.red, color.green, color.blue, color.alpha] as const }),
      ...(texture !== "" && { texture }),
      ...(texture !== "" && repeat && { textureRepeat: { x: repeat.x, y: repeat.y, perMetre: repeat.perMetre } }),
    },
  ];
}

function geometryOf({ geometry }: WireShape): Geometry | undefined {
  switch (geometry.case) {
    case "box":
      return { kind: "box", size: vectorOf(geometry.value.size) };
    case "sphere":
      return { kind: "sphere", radius: geometry.value.radius };
    case "cylinder":
    case "capsule":
    case "cone":
      return { kind: geometry.case, radius: geometry.value.radius, length: geometry.value.length };
    case "plane":
      return { kind: "plane", normal: vectorOf(geometry.value.normal, [0, 0, 1]) };
    case "mesh": {
      const { sha256, look, uri, scale } = geometry.value;
      // Markers have only the file.
      return { kind: "mesh", sha256: look === "" ? sha256 : look, uri, scale: vectorOf(scale, [1, 1, 1]) };
    }
    case "convex":
      return { kind: "convex", sha256: geometry.value.sha256 };
    default:
      // A shape from a newer version of the schema.
      return undefined;
  }
}

export function vectorOf(vector: Vector3 | undefined, absent: Vector = [0, 0, 0]): [number, number, number] {
  return vector ? [vector.x, vector.y, vector.z] : [...absent];
}

export function poseOf(pose: WirePose | undefined): Pose {
  const [x, y, z] = vectorOf(pose?.position);
  const q = pose?.orientation;
  const given = q && (q.x !== 0 || q.y !== 0 || q.z !== 0 || q.w !== 0);
  return given ? [x, y, z, q.x, q.y, q.z, q.w] : [x, y, z, 0, 0, 0, 1];
}

/** The layout versions in a response, by robot. */
export function layoutsOf(response: NextJointStatesResponse): Map<string, bigint> {
  return new Map(response.states?.robots.map((robot) => [robot.robot, robot.layoutVersion]));
}

/**
 * Returns the state of all robots; unchanged ones keep their values from the state `before`. Robots with an unknown layout version are left
 * out: their arrays do not fit the drawing until the layout is fetched again.
 */
export function frameOf(
  response: NextJointStatesResponse,
  known: ReadonlyMap<string, bigint>,
  receivedAt: number,
  before: Frame | null = null,
): Frame | undefined {
  const states = response.states;
  const stamp = states?.stamp;
  if (!states || !stamp) return undefined;
  const fits = (of: { robot: string; layoutVersion: bigint }) => known.get(of.robot) === of.layoutVersion;
  const joints = new Map<string, JointValues>();
  for (const robot of states.robots.filter(fits)) {
    const values = robot.unchanged ? before?.joints.get(robot.robot) : valuesOf(robot);
    if (values) joints.set(robot.robot, values);
  }
  const poses = new Map<string, Float64Array>();
  for (const robot of response.linkPoses.filter(fits)) {
    const values = robot.unchanged ? before?.poses.get(robot.robot) : Float64Array.from(robot.poses);
    if (values) poses.set(robot.robot, values);
  }
  return {
    sequence: stamp.sequence,
    epoch: stamp.epoch,
    step: stamp.step,
    simTime: stamp.simTime,
    receivedAt,
    joints,
    poses,
    contacts: response.contacts.map(contactOf),
  };
}

/** Values of a robot's joints. */
export function valuesOf({ position, velocity, effort, target, mode, flags, obstructions }: RobotJointStates): JointValues {
  const blocks = new Map(obstructions.map(({ joint, byRobot, byLink }) => [joint, byLink === "" ? byRobot : `${byRobot}/${byLink}`]));
  return { position, velocity, effort, target, mode: mode.map(modeOf), flags, ...(blocks.size > 0 && { blocks }) };
}

function modeOf(mode: JointMode): Mode {
  return MODES[mode] ?? "none";
}

function contactOf(contact: Contact): ContactPoint {
  const { robotA, linkA, robotB, linkB, depth, normalForce } = contact;
  const point = vectorOf(contact.point);
  const normal = vectorOf(contact.normal, [0, 0, 1]);
  return { robotA, linkA, robotB, linkB, point, normal, depth, normalForce };
}

export const STATES: Readonly<Record<SimulationState, Simulation["state"]>> = {
  [SimulationState.UNSPECIFIED]: "paused",
  [SimulationState.STOPPED]: "stopped",
  [SimulationState.PLAYING]: "playing",
  [SimulationState.PAUSED]: "paused",
};

/** The statistics, without `behind`, which `LagDetector` derives. */
export function simulationOf(statistics: WorldStatistics): Omit<Simulation, "behind"> {
  return {
    state: STATES[statistics.state] ?? "paused",
    target: statistics.targetRealTimeFactor,
    actual: statistics.realTimeFactor,
    overruns: statistics.overruns,
    stepDuration: statistics.stepDuration,
    claimedBy: statistics.claimedBy,
  };
}

export function physicsOf(physics: WirePhysics): Physics {
  return {
    timeStep: physics.timeStep,
    substeps: physics.substeps,
    realTimeFactor: physics.realTimeFactor,
    asFastAsPossible: physics.pace === PaceMode.AS_FAST_AS_POSSIBLE,
    gravity: vectorOf(physics.gravity),
  };
}

export function parameterOf(parameter: WireParameter): Parameter {
  const joint = parameter.joint === undefined ? "" : `${parameter.joint.robot}/${parameter.joint.joint}`;
  const none = { name: parameter.name, minimum: 0, maximum: 0, value: 0, presses: 0n, joint };
  if (parameter.kind.case !== "slider") {
    return { ...none, kind: "button", presses: parameter.kind.value?.presses ?? 0n };
  }
  const { minimum, maximum, value } = parameter.kind.value;
  return { ...none, kind: "slider", minimum, maximum, value };
}

export function clientOf({ name, idle, isCaller, transport }: ClientInfo): Client {
  return { name, idle, isCaller, transport };
}

/** The client that set the last target of each joint, by "robot/joint"; clients without a name are left out. */
export function sourcesOf(targets: TargetSource[]): Map<string, string> {
  const named = targets.filter((target) => target.client !== "");
  return new Map(named.map((target) => [`${target.robot}/${target.joint}`, target.client]));
}

const SEVERITIES: Record<Severity, Finding["severity"]> = {
  [Severity.UNSPECIFIED]: "info",
  [Severity.INFO]: "info",
  [Severity.WARNING]: "warning",
  [Severity.ERROR]: "error",
};

const DISPOSITIONS: Record<Disposition, Finding["disposition"]> = {
  [Disposition.UNSPECIFIED]: "used",
  [Disposition.USED]: "used",
  [Disposition.DEFAULTED]: "defaulted",
  [Disposition.REPAIRED]: "repaired",
  [Disposition.IGNORED]: "ignored",
  [Disposition.REFUSED]: "refused",
};

export function reportOf(robot: string, report: WireReport | undefined): LoadReport {
  const findings = report?.findings.map(({ severity, disposition, element, line, message, file }) => ({
    severity: SEVERITIES[severity] ?? "info",
    disposition: DISPOSITIONS[disposition] ?? "used",
    element,
    line,
    message,
    file,
  }));
  return { robot, summary: report?.summary ?? "", findings: findings ?? [] };
}

const PHASES: Record<LoadPhase, string> = {
  [LoadPhase.UNSPECIFIED]: "loading",
  [LoadPhase.WAITING]: "waiting for others",
  [LoadPhase.READING]: "reading",
  [LoadPhase.HULLS]: "making hulls",
  [LoadPhase.SPAWNING]: "spawning",
};

export function loadingOf(what: string, progress: LoadProgress): Loading {
  const { phase, done, total, uri } = progress;
  return { what, phase: PHASES[phase] ?? "loading", done, total, item: uri };
}

export function limitsOf({ maxDescriptionBytes, maxAssetBytes, maxMessageBytes }: RequestLimits): RequestBytes {
  return { description: Number(maxDescriptionBytes), asset: Number(maxAssetBytes), message: Number(maxMessageBytes) };
}

// Effects of dragging the handles: moves a robot, brings the end of an arm to a pose by inverse kinematics, or turns a joint.
import { createClient, type Client } from "@connectrpc/connect";
import { Quaternion, Vector3 } from "three";
import { linkPoseOf, moveTo, noteMove, poseOf, wirePose } from "../daemon/building";
import { messageOf, worded } from "../daemon/error-message";
import { valuesOf } from "../daemon/mapping";
import { daemonConnection } from "../daemon/page";
import { services, transport } from "../daemon/services";
import { KinematicsService } from "../gen/simd/v1/kinematics_pb";
import { SimulationState } from "../gen/simd/v1/simulation_pb";
import { axisValues, quaternionOf, rollPitchYaw } from "../state/joint-values";
import type { Pose } from "../state/scene";
import { toast } from "../state/toasts";
import type { Placing } from "../state/tools";
import { changed } from "../state/undo";
import { robots, type Axis, type Robot } from "../state/world";

/**
 * One drag. Both calls resolve to the sequence of the first state with the result; undefined after a refusal, which a message
 * reports.
 */
export interface Placement {
  /** The handles are at `to`; the drag began at `from`. world_from_link. */
  to(to: Pose, from: Pose): Promise<bigint | undefined>;
  /** The drag has ended. */
  end(from: Pose, to: Pose): Promise<bigint | undefined>;
}

/** Numbers of a pose by their index: x, y, z, roll, pitch, yaw. */
export type Coordinates = ReadonlyMap<number, number>;

/** Returns x, y, z, roll, pitch and yaw of a pose. */
export function coordinatesOf([x, y, z, ...turn]: Pose): number[] {
  return [x, y, z, ...rollPitchYaw(turn)];
}

/**
 * Sets some numbers of the pose of a robot, or of a link by its joints. The others stay as the daemon has them: the page's last state may be older
 * than its last change. Resolves as a placement does.
 */
export function setCoordinates({ name: robot, links }: Robot, link: string | undefined, to: Coordinates): Promise<bigint | undefined> {
  return said(async () => {
    const from = link === undefined ? await poseOf(robot) : await linkPoseOf(robot, links.indexOf(link));
    const [x = 0, y = 0, z = 0, ...angles] = coordinatesOf(from).map((value, index) => to.get(index) ?? value);
    const [roll = 0, pitch = 0, yaw = 0] = angles;
    const isTurned = [3, 4, 5].some((index) => to.has(index));
    const [, , , ...turn] = from;
    return placed({ robot, ...(link !== undefined && { link }) }).end(from, [x, y, z, ...(isTurned ? quaternionOf([roll, pitch, yaw]) : turn)]);
  });
}

/** Returns the placement that a drag changes. */
export function placed({ robot, link, joint }: Placing): Placement {
  if (joint !== undefined) return new JointPlacement(robot, joint);
  if (link !== undefined) return new LinkPlacement(robot, link);
  return new RobotPlacement(robot);
}

/** Moves a robot. The daemon says where it was: the page's last state may be older than the last move. */
class RobotPlacement implements Placement {
  private before: Promise<Pose> | undefined;

  constructor(private readonly robot: string) {}

  to(to: Pose): Promise<bigint | undefined> {
    return said(() => this.move(to));
  }

  end(_: Pose, to: Pose): Promise<bigint | undefined> {
    return said(async () => {
      const sequence = await this.move(to);
      if (this.before) noteMove(this.robot, await this.before, to);
      return sequence;
    });
  }

  private async move(to: Pose): Promise<bigint> {
    this.before ??= poseOf(this.robot);
    await this.before;
    return moveTo(this.robot, to);
  }
}

/** The axes of a robot that can be driven and are alone in their joints. */
function drivenAxes(robot: string): Axis[] {
  const axes = robots.peek().find(({ name }) => name === robot)?.axes ?? [];
  const planar = new Set(axes.filter(({ axis }) => axis > 0).map(({ joint }) => joint));
  return axes.filter(({ joint, actuated, mimics }) => actuated && mimics === undefined && !planar.has(joint));
}

/** Minimum number of joints that can hold both the position and the orientation of their end. */
const ENOUGH = 6;

let solver: Client<typeof KinematicsService> | undefined;

/** Moves a link to a pose: sets targets of the joints in a world that plays, and their positions in a paused one. */
class LinkPlacement implements Placement {
  private readonly axes: Axis[];
  private before: Promise<Sent> | undefined;
  private sent: Sent = new Map();
  private unreachable = false;

  constructor(
    private readonly robot: string,
    private readonly link: string,
  ) {
    this.axes = drivenAxes(robot);
  }

  to(to: Pose, from: Pose): Promise<bigint | undefined> {
    return said(async () => {
      this.before ??= positionsOf(this.axes);
      await this.before;
      solver ??= createClient(KinematicsService, transport());
      const { position, orientation } = wirePose(to);
      const turned = to.slice(3).some((value, index) => Math.abs(value - (from[index + 3] ?? 0)) > 1e-9);
      const target = turned || this.axes.length >= ENOUGH ? { position, orientation } : { position };
      const { positions, converged, positionError } = await solver.computeInverseKinematics({ robot: this.robot, link: this.link, target, joints: this.axes.map(({ joint }) => joint), tolerance: 1e-3, maxIterations: 100 });
      this.unreachable = !converged && positionError > 1e-2;
      this.sent = sentOf(this.axes, (axis) => positions[axis.positionIndex]);
      return setJoints(this.axes, this.sent);
    });
  }

  async end(from: Pose, to: Pose): Promise<bigint | undefined> {
    const sequence = await this.to(to, from);
    if (sequence === undefined || !this.before) return sequence;
    if (this.unreachable) toast("info", `${this.link} cannot reach that place; its joints are as near as they can be.`);
    noteJoints(`the joints of ${this.robot}`, this.axes, await this.before, this.sent);
    return sequence;
  }
}

/** Turns or slides one joint by the motion of the handles about or along their z. */
class JointPlacement implements Placement {
  private readonly axes: Axis[];
  private before: Promise<Sent> | undefined;
  private sent: Sent = new Map();

  constructor(robot: string, joint: string) {
    this.axes = drivenAxes(robot).filter((axis) => axis.joint === joint);
  }

  to(to: Pose, from: Pose): Promise<bigint | undefined> {
    return said(async () => {
      const [axis] = this.axes;
      if (!axis) throw new Error("That joint takes no targets.");
      this.before ??= positionsOf(this.axes);
      const began = (await this.before).get(axis.key) ?? 0;
      const moved = began + (axis.kind === "angle" ? turnAbout(from, to) : slideAlong(from, to));
      const value = Math.min(axis.upper ?? Infinity, Math.max(axis.lower ?? -Infinity, moved));
      this.sent = sentOf(this.axes, () => value);
      return setJoints(this.axes, this.sent);
    });
  }

  async end(from: Pose, to: Pose): Promise<bigint | undefined> {
    const sequence = await this.to(to, from);
    if (sequence === undefined || !this.before) return sequence;
    for (const axis of this.axes) noteJoints(`the joint ${axis.label}`, [axis], await this.before, this.sent);
    return sequence;
  }
}

/** Returns the angle in radians by which `to` is turned about the z of `from`, at most half a turn. */
export function turnAbout(from: Pose, to: Pose): number {
  const [a, b] = [quaternion(from), quaternion(to)];
  const turn = a.invert().multiply(b);
  const angle = 2 * Math.atan2(turn.z, turn.w);
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** Returns the metres by which `to` is moved along the z of `from`. */
export function slideAlong(from: Pose, to: Pose): number {
  const way = new Vector3(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  return way.dot(new Vector3(0, 0, 1).applyQuaternion(quaternion(from)));
}

function quaternion([, , , x, y, z, w]: Pose): Quaternion {
  return new Quaternion(x, y, z, w);
}

/** Asks the daemon for the positions of axes of one robot. */
async function positionsOf(axes: readonly Axis[]): Promise<Sent> {
  const [first] = axes;
  const { states } = first ? await services().joints.getJointStates({ selections: [{ robot: first.robot }] }) : {};
  const state = states?.robots[0];
  const joints = state && valuesOf(state);
  const found = new Map<string, number>();
  for (const axis of joints ? axes : []) {
    const values = joints && axisValues(axis, joints);
    if (values) found.set(axis.key, values.position);
  }
  return found;
}

/** Requested positions, by the keys of axes. */
type Sent = ReadonlyMap<string, number>;

function sentOf(axes: readonly Axis[], valueOf: (axis: Axis) => number | undefined): Sent {
  const sent = new Map<string, number>();
  for (const axis of axes) {
    const value = valueOf(axis);
    if (value !== undefined) sent.set(axis.key, value);
  }
  return sent;
}

/**
 * Sets targets while the world plays. In a paused world it sets the joint positions, with targets that hold them there. The daemon says which it
 * is, since another client may have just changed it. Resolves to the sequence of the first state with the result.
 */
async function setJoints(axes: readonly Axis[], values: Sent): Promise<bigint> {
  const set = axes.flatMap((axis) => {
    const value = values.get(axis.key);
    return value === undefined ? [] : [{ axis, value }];
  });
  const [first] = set;
  if (!first) return 0n;
  const { joints, simulation } = services();
  const { robot } = first.axis;
  const targets = set.map(({ axis, value }) => ({ joint: axis.joint, target: { case: "position", value: { position: value } } as const }));
  const { state } = await simulation.getSimulationState({});
  if (state !== SimulationState.PLAYING) {
    await joints.resetJoints({ robots: [{ robot, joints: set.map(({ axis, value }) => ({ joint: axis.joint, position: value })) }] });
  }
  const { stamp } = await joints.setJointTargets({ robots: [{ robot, joints: targets }] });
  daemonConnection().pollNow();
  return stamp?.sequence ?? 0n;
}

/** Notes the sent positions as a change from the former ones: the page receives the result only with a later state. */
function noteJoints(what: string, axes: readonly Axis[], before: Sent, after: Sent): void {
  if (after.size === 0) return;
  const set = (values: Sent) => () => worded(() => setJoints(axes, values));
  changed({ what: `moving ${what}`, of: `place ${axes.map(({ key }) => key).join()}`, undo: set(before), redo: set(after) });
}

async function said(act: () => Promise<bigint | undefined>): Promise<bigint | undefined> {
  try {
    return await act();
  } catch (error) {
    toast("error", messageOf(error));
    return undefined;
  }
}

// Effects of dragging the handles: moves a robot, brings the end of an arm to a pose by inverse kinematics, or turns a joint.
import { createClient, type Client } from "@connectrpc/connect";
import { Quaternion, Vector3 } from "three";
import { moveTo, noteMove, wirePose } from "../daemon/building";
import { messageOf, worded } from "../daemon/error-message";
import { daemonConnection } from "../daemon/page";
import { services, transport } from "../daemon/services";
import { KinematicsService } from "../gen/simd/v1/kinematics_pb";
import { axisValues } from "../state/joint-values";
import type { Pose } from "../state/scene";
import { toast } from "../state/toasts";
import type { Placing } from "../state/tools";
import { changed } from "../state/undo";
import { frame, robots, simulation, type Axis } from "../state/world";

/** One drag. Neither call rejects: messages report refusals. */
export interface Placement {
  /** The handles are at `to`; the drag began at `from`. world_from_link. */
  to(to: Pose, from: Pose): Promise<void>;
  /** The drag has ended. */
  end(from: Pose, to: Pose): Promise<void>;
}

/** Returns the placement that a drag changes. */
export function placed({ robot, link, joint }: Placing): Placement {
  if (joint !== undefined) return new JointPlacement(robot, joint);
  if (link !== undefined) return new LinkPlacement(robot, link);
  return {
    to: (to) => said(() => moveTo(robot, to)),
    end: (from, to) =>
      said(async () => {
        await moveTo(robot, to);
        noteMove(robot, from, to);
      }),
  };
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
export class LinkPlacement implements Placement {
  private readonly axes: Axis[];
  private readonly before: Map<string, number>;
  private sent: Sent = new Map();
  private unreachable = false;

  constructor(
    private readonly robot: string,
    private readonly link: string,
  ) {
    this.axes = drivenAxes(robot);
    this.before = positionsOf(this.axes);
  }

  to(to: Pose, from: Pose): Promise<void> {
    return said(async () => {
      solver ??= createClient(KinematicsService, transport());
      const { position, orientation } = wirePose(to);
      const turned = to.slice(3).some((value, index) => Math.abs(value - (from[index + 3] ?? 0)) > 1e-9);
      const target = turned || this.axes.length >= ENOUGH ? { position, orientation } : { position };
      const { positions, converged, positionError } = await solver.computeInverseKinematics({ robot: this.robot, link: this.link, target, joints: this.axes.map(({ joint }) => joint), tolerance: 1e-3, maxIterations: 100 });
      this.unreachable = !converged && positionError > 1e-2;
      this.sent = await setJoints(this.axes, (axis) => positions[axis.positionIndex]);
    });
  }

  async end(from: Pose, to: Pose): Promise<void> {
    await this.to(to, from);
    if (this.unreachable) toast("info", `${this.link} cannot reach that place; its joints are as near as they can be.`);
    noteJoints(`the joints of ${this.robot}`, this.axes, this.before, this.sent);
  }
}

/** Turns or slides one joint by the motion of the handles about or along their z. */
export class JointPlacement implements Placement {
  private readonly axes: Axis[];
  private readonly before: Map<string, number>;
  private sent: Sent = new Map();

  constructor(robot: string, joint: string) {
    this.axes = drivenAxes(robot).filter((axis) => axis.joint === joint);
    this.before = positionsOf(this.axes);
  }

  to(to: Pose, from: Pose): Promise<void> {
    return said(async () => {
      const [axis] = this.axes;
      if (!axis) throw new Error("That joint takes no targets.");
      const began = this.before.get(axis.key) ?? 0;
      const moved = began + (axis.kind === "angle" ? turnAbout(from, to) : slideAlong(from, to));
      const value = Math.min(axis.upper ?? Infinity, Math.max(axis.lower ?? -Infinity, moved));
      this.sent = await setJoints(this.axes, () => value);
    });
  }

  async end(from: Pose, to: Pose): Promise<void> {
    await this.to(to, from);
    for (const axis of this.axes) noteJoints(`the joint ${axis.label}`, [axis], this.before, this.sent);
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

function positionsOf(axes: readonly Axis[]): Map<string, number> {
  const found = new Map<string, number>();
  for (const axis of axes) {
    const joints = frame.peek()?.joints.get(axis.robot);
    const values = joints && axisValues(axis, joints);
    if (values) found.set(axis.key, values.position);
  }
  return found;
}

/** Requested positions, by the keys of axes. */
type Sent = ReadonlyMap<string, number>;

/**
 * Sets targets while the world plays. In a paused world it sets the joint positions, with targets that hold them there. Resolves to the sent
 * positions.
 */
async function setJoints(axes: readonly Axis[], valueOf: (axis: Axis) => number | undefined): Promise<Sent> {
  const values = axes.flatMap((axis) => {
    const value = valueOf(axis);
    return value === undefined ? [] : [{ axis, value }];
  });
  const sent = new Map(values.map(({ axis, value }) => [axis.key, value]));
  const [first] = values;
  if (!first) return sent;
  const { joints } = services();
  const { robot } = first.axis;
  const targets = values.map(({ axis, value }) => ({ joint: axis.joint, target: { case: "position", value: { position: value } } as const }));
  if (simulation.peek().state === "paused") {
    await joints.resetJoints({ robots: [{ robot, joints: values.map(({ axis, value }) => ({ joint: axis.joint, position: value })) }] });
  }
  await joints.setJointTargets({ robots: [{ robot, joints: targets }] });
  daemonConnection().pollNow();
  return sent;
}

/** Notes the sent positions as a change from the former ones: the page receives the result only with a later state. */
function noteJoints(what: string, axes: readonly Axis[], before: Sent, after: Sent): void {
  if (after.size === 0) return;
  const set = (values: Sent) => () => worded(() => setJoints(axes, (axis) => values.get(axis.key)));
  changed({ what: `moving ${what}`, of: `place ${axes.map(({ key }) => key).join()}`, undo: set(before), redo: set(after) });
}

async function said(act: () => Promise<unknown>): Promise<void> {
  try {
    await act();
  } catch (error) {
    toast("error", messageOf(error));
  }
}

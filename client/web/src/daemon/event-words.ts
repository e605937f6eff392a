// Events in words.
import { ConstraintDeletionCause, LockstepCause, RecordingEndCause, ReleaseCause, TrajectoryOutcome, type Event } from "../gen/simd/v1/event_pb";
import { SimulationState } from "../gen/simd/v1/simulation_pb";

/** An event in words. */
export interface Words {
  text: string;
  /** Whether a person should look at it. */
  isWarning: boolean;
}

/** Returns a sentence about an event. An event of a newer release is only mentioned. */
export function wordsOf({ kind }: Event): Words {
  const plain = (text: string): Words => ({ text, isWarning: false });
  const warning = (text: string): Words => ({ text, isWarning: true });
  switch (kind.case) {
    case "entitySpawned":
      return plain(`${kind.value.robot} came`);
    case "entityDeleted":
      return plain(`${kind.value.robot} was removed`);
    case "entityReloaded":
      return plain(`${kind.value.robot} was reloaded`);
    case "entityDisabled":
      return warning(`${kind.value.robot} was disabled: ${kind.value.reason}`);
    case "simulationStateChanged":
      return plain(`The world ${STATES[kind.value.state] ?? "changed its state"}`);
    case "simulationReset": {
      const { time, state, spawned } = kind.value;
      const what = [time && "time", state && "robots", spawned && "what was spawned"].filter((part) => part !== false);
      return plain(what.length > 0 ? `Reset: ${what.join(", ")}` : "Reset");
    }
    case "physicsChanged":
      return plain("Physics settings were changed");
    case "overrun":
      return plain(`The world could not keep up and dropped ${seconds(kind.value.droppedLag)}`);
    case "jointBlocked": {
      const { robot, joint, byRobot, byLink } = kind.value;
      return warning(`${byRobot} blocks joint ${joint} of ${robot}${byLink === "" ? "" : ` with ${byLink}`}`);
    }
    case "jointsClaimed":
      return plain(`${name(kind.value.holder)} claimed ${claimed(kind.value)}`);
    case "jointsReleased": {
      const { holder, cause, takenOverBy } = kind.value;
      if (cause === ReleaseCause.TAKEN_OVER) return plain(`${name(takenOverBy)} took over ${claimed(kind.value)} from ${name(holder)}`);
      return plain(`${name(holder)} ${RELEASES[cause] ?? "released"} ${claimed(kind.value)}`);
    }
    case "stateRestored":
      return plain(`The state ${kind.value.name} was restored`);
    case "constraintCreated":
      return plain(`The constraint ${kind.value.constraint} was made`);
    case "constraintDeleted": {
      const { constraint, cause } = kind.value;
      const text = `The constraint ${constraint} ${DELETIONS[cause] ?? "went"}`;
      return cause === ConstraintDeletionCause.BROKE ? warning(text) : plain(text);
    }
    case "sensorCreated":
      return plain(`The sensor ${kind.value.sensor} of ${kind.value.robot} was made`);
    case "sensorDeleted":
      return plain(`The sensor ${kind.value.sensor} of ${kind.value.robot} was removed`);
    case "lockstepChanged": {
      const { client, cause, members } = kind.value;
      const text = `${name(client)} ${LOCKSTEPS[cause] ?? "changed"} the lockstep, which has ${count(members, "member")} now`;
      return cause === LockstepCause.TIMED_OUT || cause === LockstepCause.DISCONNECTED ? warning(text) : plain(text);
    }
    case "recordingStarted":
      return plain(`The recording ${kind.value.recording} began`);
    case "recordingEnded": {
      const { recording, cause, message } = kind.value;
      if (cause === RecordingEndCause.STOPPED) return plain(`The recording ${recording} ended`);
      return warning(`The recording ${recording} ended${message === "" ? "" : `: ${message}`}`);
    }
    case "trajectoryEnded": {
      const { robot, id, outcome, message } = kind.value;
      const text = `Trajectory ${id} of ${robot} ${OUTCOMES[outcome] ?? "ended"}${message === "" ? "" : `: ${message}`}`;
      const failed = outcome === TrajectoryOutcome.PATH_TOLERANCE_VIOLATED || outcome === TrajectoryOutcome.GOAL_TOLERANCE_VIOLATED;
      return failed ? warning(text) : plain(text);
    }
    case "auditedCall": {
      const { token, client, method, robots, code } = kind.value;
      const who = client === "" ? token : `${token} (${client})`;
      const of = robots.length === 0 ? "" : ` of ${robots.join(", ")}`;
      return plain(`${who} asked to ${deed(method)}${of}${code === 0 ? "" : ", and was refused"}`);
    }
    default:
      return plain("An event of a kind that this page does not know");
  }
}

const STATES: Partial<Record<SimulationState, string>> = {
  [SimulationState.PLAYING]: "plays",
  [SimulationState.PAUSED]: "is paused",
  [SimulationState.STOPPED]: "is stopped",
};

const RELEASES: Partial<Record<ReleaseCause, string>> = {
  [ReleaseCause.RELEASED]: "released",
  [ReleaseCause.LAPSED]: "did not use, and lost,",
  [ReleaseCause.DISCONNECTED]: "disconnected and released",
};

const DELETIONS: Partial<Record<ConstraintDeletionCause, string>> = {
  [ConstraintDeletionCause.DELETED]: "was removed",
  [ConstraintDeletionCause.BROKE]: "broke at its maximal force",
  [ConstraintDeletionCause.ROBOT_DELETED]: "was removed with its robot",
  [ConstraintDeletionCause.LINK_GONE]: "was removed: the reloaded robot has no such link",
};

const LOCKSTEPS: Partial<Record<LockstepCause, string>> = {
  [LockstepCause.JOINED]: "joined",
  [LockstepCause.LEFT]: "left",
  [LockstepCause.TIMED_OUT]: "did not answer in time and left",
  [LockstepCause.DISCONNECTED]: "disconnected and left",
};

const OUTCOMES: Partial<Record<TrajectoryOutcome, string>> = {
  [TrajectoryOutcome.SUCCEEDED]: "reached its goal",
  [TrajectoryOutcome.PATH_TOLERANCE_VIOLATED]: "left its path",
  [TrajectoryOutcome.GOAL_TOLERANCE_VIOLATED]: "did not reach its goal",
  [TrajectoryOutcome.CANCELLED]: "was cancelled",
  [TrajectoryOutcome.SUPERSEDED]: "was replaced by another target",
};

function claimed({ robots, joints, world }: { robots: string[]; joints: string[]; world: boolean }): string {
  const whole = new Set(robots);
  // Joints of whole robots are listed too.
  const single = joints.filter((joint) => !whole.has(joint.slice(0, Math.max(0, joint.indexOf("/")))));
  const parts = [world ? "the world" : "", robots.join(", "), single.length > 3 ? count(single.length, "joint") : single.join(", ")];
  return parts.filter((part) => part !== "").join(" and ") || "nothing";
}

/** "set joint targets" of "/simd.v1.JointService/SetJointTargets". */
function deed(method: string): string {
  const words = (method.split("/").at(-1) ?? "").replace(/([a-z])([A-Z])/g, "$1 $2").toLowerCase();
  return words === "" ? "do something" : words;
}

function name(client: string): string {
  return client === "" ? "A client without a name" : client;
}

function count(number: number, what: string): string {
  return `${number} ${what}${number === 1 ? "" : "s"}`;
}

function seconds(value: number): string {
  return value < 1 ? `${Number((value * 1e3).toPrecision(3))} ms` : `${Number(value.toPrecision(3))} s`;
}

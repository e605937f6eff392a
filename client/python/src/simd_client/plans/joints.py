"""Calls of `JointService`: layouts, states, targets, claims."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Union, cast

import numpy.typing as npt

from simd_client import proto
from simd_client.errors import AnswerError, LayoutChanged, RobotNotFound, refusal
from simd_client.geometry import vector
from simd_client.layout import Gains, Layout, Limits, layout_from_proto, limits_to_proto
from simd_client.memory import Held, Memory
from simd_client.plan import Plan, ask, read
from simd_client.proto import methods
from simd_client.state import (
    Applied,
    Clamped,
    Named,
    RobotState,
    States,
    clamped_from_proto,
    name_of,
    robot_state,
    stamp_of,
)
from simd_client.target import (
    BeyondLimit,
    RobotTargets,
    Targets,
    beyond_limit_to_proto,
    needs_layout,
    targets_to_proto,
)
from simd_client.world import Stamp, stamp_from_proto

Selection = Union[str, Named, Collection[Union[str, Named]], Mapping[str, Sequence[str]], None]
"""Which joints: a robot, several robots, or joints by robot; `None` is all of all robots."""


def selections(selection: Selection) -> list[proto.JointSelection]:
    """As messages."""
    if selection is None:
        return []
    if isinstance(selection, str):
        return [proto.JointSelection(robot=selection)]
    if isinstance(selection, Mapping):
        by_robot = cast("Mapping[str, Sequence[str]]", selection)
        return [proto.JointSelection(robot=robot, joints=joints) for robot, joints in by_robot.items()]
    if isinstance(selection, Collection):
        return [proto.JointSelection(robot=name_of(robot)) for robot in selection]
    return [proto.JointSelection(robot=name_of(selection))]


def layout(memory: Memory, robot: str) -> Plan[Layout]:
    """The layout, fetched where it is not known."""
    known = memory.fresh_layout(robot)
    return known if known is not None else (yield from fetch_layout(memory, robot))


def fetch_layout(memory: Memory, robot: str) -> Plan[Layout]:
    """The layout as it is now."""
    answer = yield from ask(methods.GetJointLayout, proto.GetJointLayoutRequest(robot=robot))
    fetched = layout_from_proto(answer.layout)
    memory.keep_layout(fetched)
    return fetched


def states_from(
    memory: Memory,
    message: proto.JointStates,
    selected: Sequence[proto.JointSelection] = (),
    clamped: tuple[Clamped, ...] = (),
) -> Plan[States]:
    """States with the names of their joints; fetches layouts that are not known."""
    stamp = stamp_of(message)
    robots: dict[str, RobotState] = {}
    for index, each in enumerate(message.robots):
        names = tuple(selected[index].joints) if index < len(selected) else ()
        known = memory.fresh_layout(each.robot)
        if known is None or known.version != each.layout_version:
            try:
                known = yield from fetch_layout(memory, each.robot)
            except RobotNotFound:
                # Deleted since: its arrays are still worth something.
                known = Layout(each.robot, 0, (), 0, 0)
        robots[each.robot] = robot_state(each, stamp, known, names)
    return States(stamp, robots, clamped)


def states(memory: Memory, selection: Selection) -> Plan[States]:
    """The newest state, at once."""
    selected = selections(selection)
    answer = yield from ask(methods.GetJointStates, proto.GetJointStatesRequest(selections=selected))
    return (yield from states_from(memory, answer.states, selected))


def next_states(memory: Memory, after: int, wait: float, selection: Selection) -> Plan[States]:
    """The newest state once it is newer, or the one there is after `wait` seconds."""
    selected = selections(selection)
    request = proto.NextJointStatesRequest(after_sequence=after, timeout=wait, selections=selected)
    answer = yield from ask(methods.NextJointStates, request, wait or 1.0)
    return (yield from states_from(memory, answer.states, selected))


def robot_state_now(memory: Memory, robot: str) -> Plan[RobotState]:
    """The newest state of one robot."""
    found = yield from states(memory, robot)
    state = found.robots.get(robot)
    if state is None:
        raise AnswerError(f"the daemon's answer cannot be understood: it lacks robot `{robot}`")
    return state


def published_state(memory: Memory, robot: str, payload: bytes) -> Plan[RobotState | None]:
    """A state as it is published; `None` where it is of no use."""
    found = yield from states_from(memory, read(proto.JointStates, payload))
    return found.robots.get(robot)


@dataclass(frozen=True)
class Wire:
    """Targets as they travel."""

    robots: list[proto.RobotTargets] = field(default_factory=list[proto.RobotTargets])
    claim: str = ""


def wire(memory: Memory, targets: Targets) -> Plan[Wire]:
    """Targets as messages, with the claim that they must carry."""
    robots: list[proto.RobotTargets] = []
    joints: list[tuple[str, str]] = []
    for robot, wanted in targets.items():
        name = name_of(robot)
        known = (yield from layout(memory, name)) if needs_layout(wanted) else None
        robots.append(targets_to_proto(name, wanted, known))
        joints.extend((name, joint) for joint in (wanted if isinstance(wanted, Mapping) else ("",)))
    return Wire(robots, memory.claim_for(joints))


def set_targets(memory: Memory, targets: Targets, beyond_limit: BeyondLimit) -> Plan[Applied]:
    """All of them at one step, or none."""
    sent = yield from wire(memory, targets)
    request = proto.SetJointTargetsRequest(
        robots=sent.robots, limit_policy=beyond_limit_to_proto(beyond_limit), claim=sent.claim
    )
    with forgetting_layouts(memory):
        answer = yield from ask(methods.SetJointTargets, request)
    return Applied(stamp_from_proto(answer.stamp), clamped_from_proto(answer.clamped))


def exchange(
    memory: Memory, targets: Targets, selection: Selection, wait: float, beyond_limit: BeyondLimit
) -> Plan[States]:
    """Targets there, and the first state that they are in back; or the state there is after `wait` seconds."""
    sent = yield from wire(memory, targets)
    selected = selections(selection)
    newer = proto.ControlWait.CONTROL_WAIT_NEWER_STATE if wait > 0 else proto.ControlWait.CONTROL_WAIT_NONE
    request = proto.ControlRequest(
        selections=selected,
        robots=sent.robots,
        limit_policy=beyond_limit_to_proto(beyond_limit),
        claim=sent.claim,
        wait=newer,
        timeout=wait,
    )
    with forgetting_layouts(memory):
        answer = yield from ask(methods.Control, request, wait)
        if answer.HasField("refusal"):
            said = answer.refusal
            reason = proto.ErrorReason.Name(said.reason).removeprefix("ERROR_REASON_")
            raise refusal(said.code, said.message, reason, said.metadata)
    return (yield from states_from(memory, answer.states, selected, clamped_from_proto(answer.clamped)))


def streamed(memory: Memory, targets: Targets) -> Plan[bytes]:
    """The bytes of targets that are published instead of asked for."""
    sent = yield from wire(memory, targets)
    return proto.SetJointTargetsRequest(robots=sent.robots, claim=sent.claim).SerializeToString()


def one_robot(robot: str, targets: RobotTargets) -> Targets:
    """Targets for one robot."""
    return {robot: targets}


class forgetting_layouts:
    """Where the daemon says that a layout is old, it is fetched again before it is used again."""

    def __init__(self, memory: Memory) -> None:
        self._memory = memory

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, LayoutChanged) and "robot" in error.metadata:
            self._memory.doubt_layout(error.metadata["robot"])


def reset_joints(
    memory: Memory, robot: str, positions: Mapping[str, float] | None, velocities: Mapping[str, float] | None
) -> Plan[Stamp]:
    """Joints to a position and a rate; all of them back to where they were spawned where none is named."""
    where, rates = positions or {}, velocities or {}
    unplaced = [name for name in rates if name not in where]
    if unplaced:
        raise ValueError(f"joint `{unplaced[0]}` is given a velocity and no position to start from")
    joints = [
        proto.JointReset(joint=name, position=float(position), velocity=float(rates.get(name, 0.0)))
        for name, position in where.items()
    ]
    request = proto.ResetJointsRequest(robots=[proto.RobotReset(robot=robot, joints=joints)])
    return stamp_from_proto((yield from ask(methods.ResetJoints, request)).stamp)


def reset_to(
    memory: Memory, robot: str, positions: npt.ArrayLike, velocities: npt.ArrayLike | None
) -> Plan[Stamp]:
    """The same with arrays in joint order."""
    known = yield from layout(memory, robot)
    where = vector(positions, known.position_count, f"a position of robot `{robot}`")
    rates = (
        None
        if velocities is None
        else vector(velocities, known.velocity_count, f"a velocity of robot `{robot}`")
    )
    joints: list[proto.JointReset] = []
    for joint in known.joints:
        own = where[joint.positions]
        if joint.mimic is not None or len(own) != joint.freedom:
            continue
        for axis, position in enumerate(own.tolist()):
            rate = 0.0 if rates is None else float(rates[joint.velocities][axis])
            joints.append(proto.JointReset(joint=joint.name, position=position, velocity=rate, axis=axis))
    request = proto.ResetJointsRequest(robots=[proto.RobotReset(robot=robot, joints=joints)])
    return stamp_from_proto((yield from ask(methods.ResetJoints, request)).stamp)


def set_properties(
    memory: Memory,
    robot: str,
    joint: str,
    damping: float | None,
    friction: float | None,
    armature: float | None,
    limits: Limits | None,
    default_gains: Gains | None,
) -> Plan[Stamp]:
    """What is left out stays as it is."""
    properties = proto.JointProperties(
        joint=joint,
        damping=damping,
        friction=friction,
        armature=armature,
        limits=None if limits is None else limits_to_proto(limits),
        default_gains=None
        if default_gains is None
        else proto.JointGains(stiffness=default_gains.stiffness, damping=default_gains.damping),
    )
    request = proto.SetJointPropertiesRequest(robot=robot, joints=[properties])
    answer = yield from ask(methods.SetJointProperties, request)
    memory.doubt_layout(robot)
    return stamp_from_proto(answer.stamp)


def claim(memory: Memory, selection: Selection, holder: str, lease: float) -> Plan[Held]:
    """Takes joints for this client."""
    selected = selections(selection)
    request = proto.ClaimJointsRequest(selections=selected, holder=holder, lease=lease)
    answer = yield from ask(methods.ClaimJoints, request)
    joints = ((each.robot, joint) for each in selected for joint in (tuple(each.joints) or ("",)))
    held = Held(answer.claim, frozenset(joints))
    memory.keep_claim(held)
    return held


def release(memory: Memory, held: Held) -> Plan[Stamp]:
    """Gives joints back."""
    memory.drop_claim(held.secret)
    answer = yield from ask(methods.ReleaseJoints, proto.ReleaseJointsRequest(claim=held.secret))
    return stamp_from_proto(answer.stamp)

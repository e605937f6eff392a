"""Targets of joints and robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Union

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import FloatArray
from simd_client.layout import JointMode, Layout
from simd_client.quantity import Quantity, number

BeyondLimit = Literal["clamp", "refuse"]
"""What to do with a target beyond a limit: clamp it and report it, or refuse it with `TargetBeyondLimit`."""


@dataclass(frozen=True)
class Target:
    """A target for one joint's actuator. Radians, newton metres and seconds for joints that turn;
    metres, newtons and seconds for joints that slide."""

    mode: JointMode
    value: float = 0.0
    """Position, velocity or effort."""
    target_velocity: float = 0.0
    """Of a position target: the velocity that the damper pulls towards."""
    stiffness: float | None = None
    damping_gain: float | None = None
    feed_forward: float = 0.0
    max_effort: float | None = None
    max_velocity: float | None = None

    @staticmethod
    def position(
        position: Quantity,
        *,
        velocity: Quantity = 0.0,
        stiffness: float | None = None,
        damping: float | None = None,
        feed_forward: float = 0.0,
        max_effort: float | None = None,
        max_velocity: float | None = None,
    ) -> Target:
        """Go to a position (rad or m, or text such as "90deg") and stay there.

        `velocity` is the velocity that the damper pulls towards. `stiffness` (N m/rad or N/m) is the joint's default
        unless it is given; `damping` (N m s/rad or N s/m) is critical for a given stiffness, else the default.
        `feed_forward` (N m or N) is added to the effort. `max_effort` and `max_velocity` limit this target, in
        addition to the joint's own limits.
        """
        return Target(
            JointMode.POSITION,
            number(position, "position"),
            number(velocity, "velocity"),
            stiffness,
            damping,
            feed_forward,
            max_effort,
            max_velocity,
        )

    @staticmethod
    def velocity(
        velocity: Quantity,
        *,
        damping: float | None = None,
        feed_forward: float = 0.0,
        max_effort: float | None = None,
    ) -> Target:
        """Move at a velocity (rad/s or m/s, or text such as "30rpm"). The default `damping` reaches it to 0.1 %."""
        return Target(
            JointMode.VELOCITY,
            number(velocity, "velocity"),
            damping_gain=damping,
            feed_forward=feed_forward,
            max_effort=max_effort,
        )

    @staticmethod
    def effort(effort: Quantity) -> Target:
        """Apply an effort (N m or N) until the next target."""
        return Target(JointMode.EFFORT, number(effort, "effort"))

    @staticmethod
    def passive() -> Target:
        """No actuator: only the joint's own damping and friction."""
        return Target(JointMode.PASSIVE)

    @staticmethod
    def hold() -> Target:
        """Stay where the joint is when the target takes effect."""
        return Target(JointMode.HOLD)

    def to_proto(self, joint: str, axis: int = 0) -> proto.JointTarget:
        """As a message, for the joint of that name."""
        if self.mode is JointMode.POSITION:
            wire = proto.PositionTarget(
                position=self.value,
                velocity=self.target_velocity,
                stiffness=self.stiffness,
                damping=self.damping_gain,
                feed_forward_effort=self.feed_forward,
                max_effort=self.max_effort,
                max_velocity=self.max_velocity,
            )
            return proto.JointTarget(joint=joint, axis=axis, position=wire)
        if self.mode is JointMode.VELOCITY:
            wire = proto.VelocityTarget(
                velocity=self.value,
                damping=self.damping_gain,
                feed_forward_effort=self.feed_forward,
                max_effort=self.max_effort,
            )
            return proto.JointTarget(joint=joint, axis=axis, velocity=wire)
        if self.mode is JointMode.EFFORT:
            return proto.JointTarget(joint=joint, axis=axis, effort=proto.EffortTarget(effort=self.value))
        if self.mode is JointMode.PASSIVE:
            return proto.JointTarget(joint=joint, axis=axis, passive=proto.PassiveTarget())
        if self.mode is JointMode.HOLD:
            return proto.JointTarget(joint=joint, axis=axis, hold=proto.HoldTarget())
        raise ValueError(f"a target cannot have the mode {self.mode.name}")


@dataclass(frozen=True, eq=False)
class Whole:
    """One mode for all actuated joints of a robot, with an array in joint order."""

    mode: JointMode
    values: FloatArray | None = None
    """Aligned with the robot's `velocity`, or for positions with its `position`."""

    @staticmethod
    def positions(values: npt.ArrayLike) -> Whole:
        """Go to these positions (rad or m) and stay there."""
        return Whole(JointMode.POSITION, np.asarray(values, dtype=np.float64))

    @staticmethod
    def velocities(values: npt.ArrayLike) -> Whole:
        """Move at these velocities (rad/s or m/s)."""
        return Whole(JointMode.VELOCITY, np.asarray(values, dtype=np.float64))

    @staticmethod
    def efforts(values: npt.ArrayLike) -> Whole:
        """Apply these efforts (N m or N)."""
        return Whole(JointMode.EFFORT, np.asarray(values, dtype=np.float64))

    @staticmethod
    def hold() -> Whole:
        """Stay where the joints are."""
        return Whole(JointMode.HOLD)

    @staticmethod
    def passive() -> Whole:
        """No actuators."""
        return Whole(JointMode.PASSIVE)


OneTarget = Union[float, str, Target, Sequence[Union[float, Target]]]
"""For one joint: a position, a position with a unit ("90deg"), a `Target`, or for a planar joint three of them
(x, y, angle)."""

Numbers = npt.NDArray[Union[np.floating[Any], np.integer[Any]]]
"""An array of any kind of number."""

RobotTargets = Union[Whole, Mapping[str, OneTarget], Sequence[float], Numbers]
"""For one robot: an array of positions in joint order, a `Whole`, or targets by joint name."""

Targets = Mapping[Any, RobotTargets]
"""For several robots: by robot (`Robot` or `aio.Robot`), or by its name."""


def needs_layout(targets: RobotTargets) -> bool:
    """Whether the targets are an array, which means nothing without a layout, or have units, which must fit."""
    if isinstance(targets, Mapping):
        return any(isinstance(target, str) for target in targets.values())
    return not (isinstance(targets, Whole) and targets.values is None)


def targets_to_proto(robot: str, targets: RobotTargets, layout: Layout | None) -> proto.RobotTargets:
    """As a message. Raises `ValueError` if the length of an array is not the layout's."""
    if isinstance(targets, Mapping):
        joints = [wire for joint, target in targets.items() for wire in _one(joint, target, layout)]
        return proto.RobotTargets(robot=robot, joints=joints)
    whole = targets if isinstance(targets, Whole) else Whole.positions(targets)
    mode = f"JOINT_MODE_{whole.mode.name}"
    if whole.values is None:
        return proto.RobotTargets(robot=robot, whole=proto.WholeRobotTarget(mode=mode))
    if layout is None:
        raise ValueError(f"an array of targets needs the layout of `{robot}`")
    values = _aligned(whole, whole.values, layout)
    return proto.RobotTargets(
        robot=robot,
        layout_version=layout.version,
        whole=proto.WholeRobotTarget(mode=mode, values=values.tolist()),
    )


def _one(joint: str, target: OneTarget, layout: Layout | None) -> list[proto.JointTarget]:
    if isinstance(target, Target):
        return [target.to_proto(joint)]
    if isinstance(target, str):
        known = layout.by_name.get(joint) if layout else None
        return [Target.position(number(target, "position", known)).to_proto(joint)]
    if isinstance(target, (Sequence, np.ndarray)):
        each = [one if isinstance(one, Target) else Target.position(float(one)) for one in target]
        return [one.to_proto(joint, axis) for axis, one in enumerate(each)]
    return [Target.position(float(target)).to_proto(joint)]


def _aligned(whole: Whole, values: FloatArray, layout: Layout) -> FloatArray:
    """Positions may be given as they are read; the message has one for each velocity."""
    if values.shape == (layout.velocity_count,):
        return values
    if whole.mode is JointMode.POSITION and values.shape == (layout.position_count,):
        aligned = np.zeros(layout.velocity_count)
        for joint in layout.joints:
            if joint.positions.stop - joint.positions.start == joint.dof:
                aligned[joint.velocities] = values[joint.positions]
        return aligned
    names = ", ".join(joint.name for joint in layout.moving)
    raise ValueError(
        f"robot `{layout.robot}` takes {layout.velocity_count} values ({names}), not the shape {values.shape}"
    )


def beyond_limit_to_proto(beyond_limit: BeyondLimit) -> proto.LimitPolicy:
    """As its number. Raises `ValueError` for another word."""
    if beyond_limit == "clamp":
        return proto.LimitPolicy.LIMIT_POLICY_CLAMP
    if beyond_limit == "refuse":
        return proto.LimitPolicy.LIMIT_POLICY_REFUSE
    raise ValueError(f"beyond_limit is 'clamp' or 'refuse', not {beyond_limit!r}")

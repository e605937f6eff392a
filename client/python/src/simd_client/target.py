"""Targets of joints and robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Union

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.errors import InvalidValue, refused_here
from simd_client.geometry import FloatArray, rotation_vector, vector
from simd_client.layout import JointInfo, JointMode, JointType, Layout
from simd_client.quantity import Quantity, number

BeyondLimit = Literal["clamp", "refuse"]
"""Behaviour of a target beyond a limit: clamp and report it, or refuse it with `TargetBeyondLimit`."""


@dataclass(frozen=True)
class Target:
    """A target for one joint's actuator. Units are radians, newton metres and seconds for rotating joints;
    metres, newtons and seconds for sliding joints."""

    mode: JointMode
    value: float = 0.0
    """Position, velocity or effort."""
    target_velocity: float = 0.0
    """Velocity that a position target's damper pulls towards."""
    stiffness: float | None = None
    damping_gain: float | None = None
    feed_forward: float = 0.0
    max_effort: float | None = None
    max_velocity: float | None = None
    vector: tuple[float, ...] = ()
    """Target of a spherical joint, instead of `value`: a quaternion x y z w, or three numbers in the child's
    axes."""
    vector_velocity: tuple[float, ...] = ()
    """Velocity that an orientation target's damper pulls towards."""
    vector_feed_forward: tuple[float, ...] = ()
    """Feed-forward torque of a spherical joint, instead of `feed_forward`."""

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
        """Moves to a position (rad or m, or text such as "90deg") and stays there.

        `velocity` is the velocity that the damper pulls towards. `stiffness` (N m/rad or N/m) defaults to the
        joint's. `damping` (N m s/rad or N s/m) defaults to critical damping of a given stiffness, else to the
        joint's. `feed_forward` (N m or N) is added to the effort. `max_effort` and `max_velocity` limit this
        target, in addition to the joint's own limits.
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
        """Moves at a velocity (rad/s or m/s, or text such as "30rpm"). The default `damping` reaches it to
        0.1 %."""
        return Target(
            JointMode.VELOCITY,
            number(velocity, "velocity"),
            damping_gain=damping,
            feed_forward=feed_forward,
            max_effort=max_effort,
        )

    @staticmethod
    def effort(effort: Quantity) -> Target:
        """Applies an effort (N m or N) until the next target."""
        return Target(JointMode.EFFORT, number(effort, "effort"))

    @staticmethod
    def orientation(
        orientation: npt.ArrayLike,
        *,
        angular_velocity: npt.ArrayLike = (0.0, 0.0, 0.0),
        stiffness: float | None = None,
        damping: float | None = None,
        feed_forward: npt.ArrayLike = (0.0, 0.0, 0.0),
        max_effort: float | None = None,
        max_velocity: float | None = None,
    ) -> Target:
        """Rotates a spherical joint to an orientation, a quaternion x y z w in the joint's frame, and stays
        there.

        `angular_velocity` (rad/s) and `feed_forward` (N m) are in the child's axes. Gains and limits apply
        about each of them, otherwise as in `Target.position`. The spring pulls the short way round.
        """
        return Target(
            JointMode.POSITION,
            stiffness=stiffness,
            damping_gain=damping,
            max_effort=max_effort,
            max_velocity=max_velocity,
            vector=_numbers(orientation, 4, "an orientation (x y z w)"),
            vector_velocity=_numbers(angular_velocity, 3, "an angular velocity"),
            vector_feed_forward=_numbers(feed_forward, 3, "a torque"),
        )

    @staticmethod
    def angular_velocity(
        angular_velocity: npt.ArrayLike,
        *,
        damping: float | None = None,
        feed_forward: npt.ArrayLike = (0.0, 0.0, 0.0),
        max_effort: float | None = None,
    ) -> Target:
        """Rotates a spherical joint at a velocity, rad/s in the child's axes."""
        return Target(
            JointMode.VELOCITY,
            damping_gain=damping,
            max_effort=max_effort,
            vector=_numbers(angular_velocity, 3, "an angular velocity"),
            vector_feed_forward=_numbers(feed_forward, 3, "a torque"),
        )

    @staticmethod
    def torque(torque: npt.ArrayLike) -> Target:
        """Applies a torque to a spherical joint, N m in the child's axes, until the next target."""
        return Target(JointMode.EFFORT, vector=_numbers(torque, 3, "a torque"))

    @staticmethod
    def passive() -> Target:
        """Switches the actuator off: only the joint's damping and friction remain."""
        return Target(JointMode.PASSIVE)

    @staticmethod
    def hold() -> Target:
        """Holds the joint's position at the moment when the target takes effect."""
        return Target(JointMode.HOLD)

    def to_proto(self, joint: str, axis: int = 0) -> proto.JointTarget:
        """Converts to a message, for the joint with this name."""
        if self.vector:
            return self._spherical(joint, axis)
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

    def _spherical(self, joint: str, axis: int) -> proto.JointTarget:
        if self.mode is JointMode.POSITION:
            x, y, z, w = self.vector
            position = proto.SphericalPositionTarget(
                orientation=proto.Quaternion(x=x, y=y, z=z, w=w),
                angular_velocity=_vector3(self.vector_velocity),
                stiffness=self.stiffness,
                damping=self.damping_gain,
                feed_forward_torque=_vector3(self.vector_feed_forward),
                max_effort=self.max_effort,
                max_velocity=self.max_velocity,
            )
            return proto.JointTarget(joint=joint, axis=axis, spherical_position=position)
        if self.mode is JointMode.VELOCITY:
            velocity = proto.SphericalVelocityTarget(
                angular_velocity=_vector3(self.vector),
                damping=self.damping_gain,
                feed_forward_torque=_vector3(self.vector_feed_forward),
                max_effort=self.max_effort,
            )
            return proto.JointTarget(joint=joint, axis=axis, spherical_velocity=velocity)
        if self.mode is JointMode.EFFORT:
            effort = proto.SphericalEffortTarget(torque=_vector3(self.vector))
            return proto.JointTarget(joint=joint, axis=axis, spherical_effort=effort)
        raise ValueError(f"a target of a spherical joint cannot have the mode {self.mode.name}")


def _numbers(values: npt.ArrayLike, length: int, what: str) -> tuple[float, ...]:
    return tuple(vector(values, length, what).tolist())


def _vector3(values: tuple[float, ...]) -> proto.Vector3:
    x, y, z = values or (0.0, 0.0, 0.0)
    return proto.Vector3(x=x, y=y, z=z)


@dataclass(frozen=True, eq=False)
class Whole:
    """One mode for all actuated joints of a robot, with an array in joint order."""

    mode: JointMode
    values: FloatArray | None = None
    """Aligned with the robot's `velocity`, or for positions with its `position`. A spherical joint has a
    rotation vector in the former, a quaternion in the latter."""

    @staticmethod
    def positions(values: npt.ArrayLike) -> Whole:
        """Moves to these positions (rad or m) and stays there."""
        return Whole(JointMode.POSITION, np.asarray(values, dtype=np.float64))

    @staticmethod
    def velocities(values: npt.ArrayLike) -> Whole:
        """Moves at these velocities (rad/s or m/s)."""
        return Whole(JointMode.VELOCITY, np.asarray(values, dtype=np.float64))

    @staticmethod
    def efforts(values: npt.ArrayLike) -> Whole:
        """Applies these efforts (N m or N)."""
        return Whole(JointMode.EFFORT, np.asarray(values, dtype=np.float64))

    @staticmethod
    def hold() -> Whole:
        """Holds the joints' positions."""
        return Whole(JointMode.HOLD)

    @staticmethod
    def passive() -> Whole:
        """Switches all actuators off."""
        return Whole(JointMode.PASSIVE)


def whole_or_by_name(mode: JointMode, values: npt.ArrayLike | Mapping[str, Quantity], layout: Layout) -> RobotTargets:
    """Targets of one mode, as an array in joint order or by joint name, optionally with units. Raises
    `ValueError` for a unit that does not fit the joint."""
    if not isinstance(values, Mapping):
        texts: list[Any] = np.asarray(values).ravel().tolist()
        if any(isinstance(value, str) for value in texts):
            raise ValueError(f"units need names of joints, as in {{{_first(layout)!r}: {texts[0]!r}}}; an array has numbers")
        return Whole(mode, np.asarray(values, dtype=np.float64))
    if mode is JointMode.POSITION:
        return values
    return {name: _of_mode(mode, value, layout.by_name.get(name)) for name, value in values.items()}


def _first(layout: Layout) -> str:
    return layout.moving[0].name if layout.moving else "joint"


def _of_mode(mode: JointMode, value: OneTarget, joint: JointInfo | None) -> OneTarget:
    if isinstance(value, Target):
        return value
    is_velocity = mode is JointMode.VELOCITY
    if isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, str):
        if joint is not None and joint.type is JointType.SPHERICAL:
            each = np.asarray(value, dtype=np.float64)
            return Target.angular_velocity(each) if is_velocity else Target.torque(each)
        return [_alone(is_velocity, one, joint) for one in value]
    return _alone(is_velocity, value, joint)


def _alone(is_velocity: bool, value: Quantity | Target, joint: JointInfo | None) -> Target:
    if isinstance(value, Target):
        return value
    si = number(value, "velocity" if is_velocity else "effort", joint)
    return Target.velocity(si) if is_velocity else Target.effort(si)


OneTarget = Union[float, str, Target, Sequence[Union[float, Target]]]
"""Target of one joint: a position, a position with a unit ("90deg") or a `Target`. A planar joint takes three
of them (x, y, angle), and a spherical joint a quaternion of four numbers (x, y, z, w)."""

Numbers = npt.NDArray[Union[np.floating[Any], np.integer[Any]]]
"""An array of any kind of number."""

RobotTargets = Union[Whole, Mapping[str, OneTarget], Sequence[float], Numbers]
"""Targets of one robot: an array of positions in joint order, a `Whole`, or targets by joint name."""

Targets = Mapping[Any, RobotTargets]
"""Targets of several robots: by robot (`Robot` or `aio.Robot`), or by its name."""


def needs_layout(targets: RobotTargets) -> bool:
    """Whether the targets need a layout: an array, or units, which must fit."""
    if isinstance(targets, Mapping):
        return any(isinstance(target, str) for target in targets.values())
    return not (isinstance(targets, Whole) and targets.values is None)


def targets_to_proto(robot: str, targets: RobotTargets, layout: Layout | None) -> proto.RobotTargets:
    """Converts to a message. Raises `ValueError` if the length of an array is not the layout's."""
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
    if not np.isfinite(values).all():
        raise _not_finite(whole.mode, values, layout)
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
        if len(target) == 4 and not any(isinstance(one, Target) for one in target):
            return [Target.orientation(np.asarray(target, dtype=np.float64)).to_proto(joint)]
        each = [one if isinstance(one, Target) else Target.position(float(one)) for one in target]
        return [one.to_proto(joint, axis) for axis, one in enumerate(each)]
    return [Target.position(float(target)).to_proto(joint)]


def _aligned(whole: Whole, values: FloatArray, layout: Layout) -> FloatArray:
    """Callers may pass positions as read; the message has one for each velocity."""
    if values.shape == (layout.velocity_count,):
        return values
    if whole.mode is JointMode.POSITION and values.shape == (layout.position_count,):
        aligned = np.zeros(layout.velocity_count)
        for joint in layout.joints:
            if joint.positions.stop - joint.positions.start == joint.dof:
                aligned[joint.velocities] = values[joint.positions]
            elif joint.type is JointType.SPHERICAL:
                aligned[joint.velocities] = rotation_vector(values[joint.positions])
        return aligned
    names = ", ".join(joint.name for joint in layout.moving)
    raise ValueError(
        f"robot `{layout.robot}` takes {layout.velocity_count} values ({names}), not the shape {values.shape}"
    )


def _not_finite(mode: JointMode, values: FloatArray, layout: Layout) -> InvalidValue:
    index = int(np.flatnonzero(~np.isfinite(values))[0])
    joint = next(each for each in layout.joints if each.velocities.start <= index < each.velocities.stop)
    what = f"{mode.name.lower()} {values[index]} of joint `{joint.name}` of robot `{layout.robot}` (value {index} of the array)"
    return refused_here(InvalidValue, "INVALID_ARGUMENT", f"{what} is not finite")


def beyond_limit_to_proto(beyond_limit: BeyondLimit, *more: str) -> proto.LimitPolicy:
    """Converts to its number. Raises `ValueError` for another word; `more` are additional words that the
    caller accepts."""
    if beyond_limit == "clamp":
        return proto.LimitPolicy.LIMIT_POLICY_CLAMP
    if beyond_limit == "refuse":
        return proto.LimitPolicy.LIMIT_POLICY_REFUSE
    words = " or ".join(map(repr, ("clamp", "refuse", *more)))
    raise ValueError(f"beyond_limit is {words}, not {beyond_limit!r}")

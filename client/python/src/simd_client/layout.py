"""Joints of a robot, and their indices in the robot's arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from functools import cached_property

from simd_client import proto
from simd_client.geometry import FloatArray, Pose, pose_from_proto, vector_from_proto


class JointType(IntEnum):
    """Kind of joint."""

    UNKNOWN = 0
    REVOLUTE = 1
    CONTINUOUS = 2
    PRISMATIC = 3
    FIXED = 4
    FLOATING = 5
    PLANAR = 6
    SPHERICAL = 7
    """A ball joint."""

    @classmethod
    def _missing_(cls, value: object) -> JointType:
        return cls.UNKNOWN

    def __str__(self) -> str:
        return self.name.lower()


ONE_AXIS = (JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC)
"""Joints that have one axis."""


class JointMode(IntEnum):
    """Mode of a joint's actuator."""

    UNKNOWN = 0
    PASSIVE = 1
    """No actuator: only the joint's damping and friction."""
    POSITION = 2
    VELOCITY = 3
    EFFORT = 4
    HOLD = 5
    """Position mode at the joint's position when the command arrived."""
    NONE = 6
    """A fixed, floating or mimic joint: it has no actuator."""

    @classmethod
    def _missing_(cls, value: object) -> JointMode:
        return cls.UNKNOWN

    def __str__(self) -> str:
        return self.name.lower()


class JointFlag(IntFlag):
    """Bits of a joint's `flags`."""

    SATURATED = 1
    """The effort limit bounds the actuator: the actuator applies the limit, or in rare steps slightly less or
    more."""
    AT_LOWER_LIMIT = 2
    """The joint is within 1e-6 rad or m of its lower limit, or below it."""
    AT_UPPER_LIMIT = 4
    """The joint is within 1e-6 rad or m of its upper limit, or above it."""


@dataclass(frozen=True)
class JointLimits:
    """A joint's limits; `None` means no limit."""

    lower: float | None = None
    """rad or m."""
    upper: float | None = None
    """rad or m."""
    effort: float | None = None
    """N m or N: clamps the actuator."""
    velocity: float | None = None
    """rad/s or m/s: clamps velocity targets, and the velocity on the way to a position target."""

    @staticmethod
    def of(
        lower: float | str | None = None,
        upper: float | str | None = None,
        effort: float | str | None = None,
        velocity: float | str | None = None,
    ) -> JointLimits:
        """Parses limits with units: `JointLimits.of("-90deg", "90deg", "12Nm", "30rpm")`."""
        return JointLimits(lower, upper, effort, velocity)  # pyright: ignore[reportArgumentType]

    def __post_init__(self) -> None:
        from simd_client.quantity import number

        for name, what in (("lower", "position"), ("upper", "position"), ("effort", "effort"), ("velocity", "velocity")):
            value: float | str | None = getattr(self, name)
            if isinstance(value, str):
                object.__setattr__(self, name, number(value, what))


@dataclass(frozen=True)
class Gains:
    """Gains of position mode, SI units, independent of the time step."""

    stiffness: float
    """N m/rad or N/m."""
    damping: float
    """N m s/rad or N s/m."""


@dataclass(frozen=True)
class JointSpring:
    """A spring in addition to the actuator of a joint of one axis: effort = stiffness (rest - position)."""

    stiffness: float
    """N m/rad or N/m; 0 means no spring."""
    rest: float = 0.0
    """Rest position, rad or m."""


@dataclass(frozen=True)
class Mimic:
    """The joint follows another: position = multiplier * other + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Tendon:
    """The joint is the length of a tendon: position = sum of factor * other + offset. A unit of its effort is
    the factor's effort at each of the other joints."""

    factors: Mapping[str, float]
    """By joint."""
    offset: float


@dataclass(frozen=True)
class JointInfo:
    """Properties of a joint at the time its layout was fetched."""

    index: int
    """Depth-first, fixed joints included."""
    name: str
    type: JointType
    axis: FloatArray | None
    """Unit vector in the joint's frame; `None` for fixed, floating and spherical joints."""
    parent_link: str
    child_link: str
    parent_from_joint: Pose
    """At position zero."""
    limits: JointLimits
    damping: float
    """N m s/rad or N s/m."""
    friction: float
    """Dry friction effort, N m or N."""
    armature: float
    """Rotor inertia seen at the joint, kg m^2 or kg."""
    spring: JointSpring | None
    """A spring in addition to the actuator; `None` without one."""
    mimic: Mimic | None
    tendon: Tendon | None
    mode: JointMode
    gains: Gains
    """Gains in use: the target's, or the default."""
    default_gains: Gains
    """Gains of targets that have none."""
    claimed_by: str
    """Holder of a claim on it; empty for none."""
    gravity_compensation: bool
    """Whether its actuator holds the weight of the links below it."""
    profile: bool
    """Whether its setpoint follows a velocity profile on its way to a position target."""
    positions: slice
    """Indices of its values in `position`; a spherical joint has a quaternion x y z w, the child's in the
    joint's frame."""
    velocities: slice
    """Indices of its values in `velocity`, `effort`, `target`, `mode` and `flags`."""

    @property
    def is_actuated(self) -> bool:
        """Whether it takes targets."""
        return self.mode is not JointMode.NONE

    @property
    def dof(self) -> int:
        """Degrees of freedom: 0 for fixed, 1, 3 for planar and spherical, 6 for floating."""
        return self.velocities.stop - self.velocities.start


@dataclass(frozen=True)
class Layout:
    """Joints of a robot, and the layout of its arrays."""

    robot: str
    version: int
    """Changes with each reload or respawn under the same name."""
    joints: tuple[JointInfo, ...]
    """Depth-first, fixed joints included."""
    position_count: int
    """Length of `position`."""
    velocity_count: int
    """Length of `velocity`, `effort`, `target`, `mode` and `flags`."""

    @cached_property
    def by_name(self) -> Mapping[str, JointInfo]:
        """The joints by their names, in order."""
        return {joint.name: joint for joint in self.joints}

    @cached_property
    def moving(self) -> tuple[JointInfo, ...]:
        """Joints that can move."""
        return tuple(joint for joint in self.joints if joint.dof > 0)


def layout_from_proto(message: proto.JointLayout) -> Layout:
    """Converts a layout from its message."""
    return Layout(
        robot=message.robot,
        version=message.layout_version,
        joints=tuple(_joint(joint) for joint in message.joints),
        position_count=message.position_count,
        velocity_count=message.velocity_count,
    )


def limits_from_proto(message: proto.JointLimits) -> JointLimits:
    """Converts limits from their message."""
    return JointLimits(
        lower=message.lower if message.HasField("lower") else None,
        upper=message.upper if message.HasField("upper") else None,
        effort=message.effort if message.HasField("effort") else None,
        velocity=message.velocity if message.HasField("velocity") else None,
    )


def limits_to_proto(limits: JointLimits) -> proto.JointLimits:
    """Converts limits to a message."""
    return proto.JointLimits(
        lower=limits.lower, upper=limits.upper, effort=limits.effort, velocity=limits.velocity
    )


def _joint(message: proto.JointInfo) -> JointInfo:
    mimic, tendon = message.mimic, message.tendon
    return JointInfo(
        index=message.index,
        name=message.name,
        type=JointType(message.type),
        axis=vector_from_proto(message.axis) if message.HasField("axis") else None,
        parent_link=message.parent_link,
        child_link=message.child_link,
        parent_from_joint=pose_from_proto(message.parent_from_joint),
        limits=limits_from_proto(message.limits),
        damping=message.damping,
        friction=message.friction,
        armature=message.armature,
        spring=JointSpring(message.spring.stiffness, message.spring.rest) if message.HasField("spring") else None,
        mimic=Mimic(mimic.joint, mimic.multiplier, mimic.offset) if message.HasField("mimic") else None,
        tendon=Tendon({term.joint: term.factor for term in tendon.terms}, tendon.offset) if message.HasField("tendon") else None,
        mode=JointMode(message.mode),
        gains=Gains(message.gains.stiffness, message.gains.damping),
        default_gains=Gains(message.default_gains.stiffness, message.default_gains.damping),
        claimed_by=message.claimed_by,
        gravity_compensation=message.gravity_compensation,
        profile=message.profile,
        positions=slice(message.position_index, message.position_index + message.position_count),
        velocities=slice(message.velocity_index, message.velocity_index + message.velocity_count),
    )


def joint_properties(
    joint: str,
    damping: float | None,
    friction: float | None,
    armature: float | None,
    spring: JointSpring | None,
    limits: JointLimits | None,
    gains: Gains | None,
    gravity_compensation: bool | None = None,
    profile: bool | None = None,
) -> proto.JointProperties:
    """Builds a message with only the given changes of a joint."""
    properties = proto.JointProperties(
        joint=joint,
        damping=damping,
        friction=friction,
        armature=armature,
        spring=spring and proto.JointSpring(stiffness=spring.stiffness, rest=spring.rest),
        limits=None if limits is None else limits_to_proto(limits),
        default_gains=gains and proto.JointGains(stiffness=gains.stiffness, damping=gains.damping),
    )
    if gravity_compensation is not None:
        properties.gravity_compensation = gravity_compensation
    if profile is not None:
        properties.profile = profile
    return properties

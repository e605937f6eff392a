"""Constraints between links: what they ask for, what they do, and how well they hold."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from simd_client import proto
from simd_client.enum_word import enum_name
from simd_client.geometry import FloatArray, Pose, pose_from_proto, pose_to_proto, vector_from_proto

ConstraintKind = Literal["weld", "point_to_point", "hinge", "slide", "gear", "distance"]
"""What a constraint asks for; see `Constraints.create`."""


@dataclass(frozen=True)
class ConstraintEnd:
    """One end of a constraint. `ConstraintEnd()` is the world's origin."""

    robot: str = ""
    """Empty: the world."""
    link: str = ""
    """Empty: the root link. Not for gears."""
    joint: str = ""
    """For gears: a joint that turns or slides."""
    pose: Pose | None = None
    """link_from_frame, or world_from_frame. `None`: of the parent the link's frame, of the child where that of the
    parent is now."""


@dataclass(frozen=True)
class Constraint:
    """A constraint, and what it did over the last step."""

    name: str
    kind: ConstraintKind
    parent: ConstraintEnd
    child: ConstraintEnd
    axis: FloatArray | None
    """Of a hinge or slide: of unit length, in the frames of both ends."""
    ratio: float | None
    """Of a gear: child = ratio * parent + offset."""
    offset: float | None
    """Of a gear, rad or m."""
    length: float | None
    """Of a distance, metres."""
    rope: bool
    """Of a distance: it pulls and does not push."""
    max_force: float
    """N; of a gear the effort on the child's joint, N m or N. Infinite: no limit."""
    max_torque: float
    """N m. Infinite: no limit."""
    breaks: bool
    """It goes where it would need more than that."""
    disable_collisions: bool
    """The two links do not touch each other."""
    force: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Mean force on the child over the last step, world axes, N; of a gear of a sliding joint along its axis."""
    torque: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Mean torque on the child about `point`, world axes, N m; of a gear of a turning joint about its axis."""
    point: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Where the force acts on both, world axes."""
    position_error: float = 0.0
    """How far the last step found the ends from where they are to be, metres; of a gear the unit of the child's joint."""
    angle_error: float = 0.0
    """The same of their orientations, rad."""
    velocity_residual: float = 0.0
    """How fast the ends leave where they are to be, because other constraints or the limits are in the way: m/s or
    rad/s."""
    angular_residual: float = 0.0
    """The same of their orientations, rad/s."""
    saturated: bool = False
    """It did what it may do at the most."""


def kind_to_proto(kind: ConstraintKind) -> proto.ConstraintKind:
    """As the enum's value. Raises `ValueError` for another word."""
    return proto.ConstraintKind.Value(enum_name("CONSTRAINT_KIND", kind, ConstraintKind, "kind of constraint"))  # type: ignore[return-value]


def end_to_proto(end: ConstraintEnd) -> proto.ConstraintEnd:
    """As a message."""
    pose = None if end.pose is None else pose_to_proto(end.pose)
    return proto.ConstraintEnd(robot=end.robot, link=end.link, joint=end.joint, pose=pose)


def constraint_from_proto(message: proto.Constraint) -> Constraint:
    """From its message."""
    name = proto.ConstraintKind.Name(message.kind).removeprefix("CONSTRAINT_KIND_").lower()

    def given(name: str) -> float | None:
        return getattr(message, name) if message.HasField(name) else None  # type: ignore[arg-type]

    def end(end: proto.ConstraintEnd) -> ConstraintEnd:
        return ConstraintEnd(end.robot, end.link, end.joint, pose_from_proto(end.pose))

    return Constraint(
        name=message.name,
        kind=name,  # type: ignore[arg-type]
        parent=end(message.parent),
        child=end(message.child),
        axis=vector_from_proto(message.axis) if message.HasField("axis") else None,
        ratio=given("ratio"),
        offset=given("offset"),
        length=given("length"),
        rope=message.rope,
        max_force=message.max_force if message.HasField("max_force") else float("inf"),
        max_torque=message.max_torque if message.HasField("max_torque") else float("inf"),
        breaks=message.breaks,
        disable_collisions=message.disable_collisions,
        force=vector_from_proto(message.force),
        torque=vector_from_proto(message.torque),
        point=vector_from_proto(message.point),
        position_error=message.position_error,
        angle_error=message.angle_error,
        velocity_residual=message.velocity_residual,
        angular_residual=message.angular_residual,
        saturated=message.saturated,
    )

"""Constraints between links: their settings, forces and errors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from simd_client import proto
from simd_client.enum_word import enum_name
from simd_client.geometry import FloatArray, Pose, pose_from_proto, pose_to_proto, vector_from_proto

ConstraintKind = Literal["weld", "point_to_point", "hinge", "slide", "gear", "distance"]
"""Kind of constraint; see `Constraints.create`."""


@dataclass(frozen=True)
class ConstraintEnd:
    """One end of a constraint. `ConstraintEnd()` is the world's origin."""

    robot: str = ""
    """Empty: the world."""
    link: str = ""
    """Empty: the root link. Not used by gears."""
    joint: str = ""
    """For gears: a joint that turns or slides."""
    pose: Pose | None = None
    """link_from_frame, or world_from_frame. `None`: the parent uses the link's frame, and the child the
    parent's current frame."""


@dataclass(frozen=True)
class Constraint:
    """A constraint, and its result over the last step."""

    name: str
    kind: ConstraintKind
    parent: ConstraintEnd
    child: ConstraintEnd
    axis: FloatArray | None
    """Axis of a hinge or slide: of unit length, in the frames of both ends."""
    ratio: float | None
    """Ratio of a gear: child = ratio * parent + offset."""
    offset: float | None
    """Offset of a gear, rad or m."""
    length: float | None
    """Length of a distance, metres."""
    rope: bool
    """Whether a distance only pulls and never pushes."""
    max_force: float
    """Force limit, N; for a gear the effort on the child's joint, N m or N. Infinite: no limit."""
    max_torque: float
    """Torque limit, N m. Infinite: no limit."""
    breaks: bool
    """Whether it is deleted when it would need more than its limits."""
    disable_collisions: bool
    """Whether the two links do not touch each other."""
    force: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Mean force on the child over the last step, world axes, N. For a gear of a sliding joint it is along
    its axis."""
    torque: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Mean torque on the child about `point`, world axes, N m. For a gear of a turning joint it is about its
    axis."""
    point: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Point where the force acts on both, world axes."""
    position_error: float = 0.0
    """Position error at the last step, metres; for a gear in the unit of the child's joint."""
    angle_error: float = 0.0
    """Orientation error at the last step, rad."""
    velocity_residual: float = 0.0
    """Velocity of the position error that other constraints or the limits cause, m/s or rad/s."""
    angular_residual: float = 0.0
    """Velocity of the orientation error, rad/s."""
    saturated: bool = False
    """Whether it reached its limit."""


def kind_to_proto(kind: ConstraintKind) -> proto.ConstraintKind:
    """Converts a word to the enum's value. Raises `ValueError` for another word."""
    return proto.ConstraintKind.Value(enum_name("CONSTRAINT_KIND", kind, ConstraintKind, "kind of constraint"))  # type: ignore[return-value]


def end_to_proto(end: ConstraintEnd) -> proto.ConstraintEnd:
    """Converts an end to its message."""
    pose = None if end.pose is None else pose_to_proto(end.pose)
    return proto.ConstraintEnd(robot=end.robot, link=end.link, joint=end.joint, pose=pose)


def constraint_from_proto(message: proto.Constraint) -> Constraint:
    """Converts an end from its message."""
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

"""Distances, overlaps, bounds and casts of shapes: requests and answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Union

import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import FloatArray, Pose, pose_to_proto, vector_from_proto, vector_to_proto
from simd_client.kinematics import Configuration, configuration_to_proto
from simd_client.state import Named, name_of


@dataclass(frozen=True)
class QueryRobot:
    """A robot, or a link of it, at its current pose or another one."""

    robot: Union[str, Named]
    link: str = ""
    """Empty: all of its links."""
    configuration: Configuration | None = None
    """`None`: the current pose."""


@dataclass(frozen=True, eq=False)
class ClosestPoints:
    """Nearest points of two links. World axes, metres."""

    robot_a: str
    """Robot's name; empty for a shape of no robot, like its link."""
    link_a: str
    robot_b: str
    link_b: str
    point_a: FloatArray
    """On the surface of a."""
    point_b: FloatArray
    """On the surface of b."""
    normal: FloatArray
    """Unit vector from a to b."""
    distance: float
    """Distance of the surfaces. If they overlap: minus the length of the shortest separating move."""


@dataclass(frozen=True, eq=False)
class LinkBounds:
    """The box around a link's shapes, along the world's axes. Metres."""

    robot: str
    link: str
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True)
class Shape:
    """A shape of no robot, or a part of a body (`add_compound`). Metres; cylinders, capsules and cones are
    about z."""

    message: proto.QueryShape

    @staticmethod
    def box(size: npt.ArrayLike) -> Shape:
        """Returns a box with these full lengths."""
        return Shape(proto.QueryShape(box=proto.BoxGeometry(size=vector_to_proto(size, "a size"))))

    @staticmethod
    def sphere(radius: float) -> Shape:
        """Returns a ball."""
        return Shape(proto.QueryShape(sphere=proto.SphereGeometry(radius=radius)))

    @staticmethod
    def cylinder(radius: float, length: float) -> Shape:
        """Returns a cylinder."""
        return Shape(proto.QueryShape(cylinder=proto.CylinderGeometry(radius=radius, length=length)))

    @staticmethod
    def capsule(radius: float, length: float) -> Shape:
        """`length` is without the caps."""
        return Shape(proto.QueryShape(capsule=proto.CapsuleGeometry(radius=radius, length=length)))

    @staticmethod
    def cone(radius: float, length: float) -> Shape:
        """The base at `-length / 2`, the apex at `length / 2`."""
        return Shape(proto.QueryShape(cone=proto.ConeGeometry(radius=radius, length=length)))


@dataclass(frozen=True)
class PlacedShape:
    """A shape of no robot, or a part of a body, with its pose."""

    shape: Shape
    pose: Pose | None = None
    """world_from_shape; for a part link_from_shape; `None` is the origin."""


Side = Union[str, Named, QueryRobot, Shape, PlacedShape]
"""A robot at its current pose, a `QueryRobot`, or a shape of no robot, which has no names in results."""


def side_to_proto(side: Side) -> proto.QueryBody:
    """Converts to a message."""
    if isinstance(side, Shape):
        return proto.QueryBody(shape=side.message)
    if isinstance(side, PlacedShape):
        pose = None if side.pose is None else pose_to_proto(side.pose)
        return proto.QueryBody(shape=side.shape.message, pose=pose)
    if isinstance(side, QueryRobot):
        configuration = configuration_to_proto(side.configuration)
        return proto.QueryBody(robot=name_of(side.robot), link=side.link, configuration=configuration)
    return proto.QueryBody(robot=name_of(side))


def part_to_proto(part: Shape | PlacedShape) -> proto.CompoundPart:
    """Converts a part of a body to a message."""
    shape, pose = (part, None) if isinstance(part, Shape) else (part.shape, part.pose)
    given = shape.message
    return proto.CompoundPart(
        pose=None if pose is None else pose_to_proto(pose),
        box=given.box if given.HasField("box") else None,
        sphere=given.sphere if given.HasField("sphere") else None,
        cylinder=given.cylinder if given.HasField("cylinder") else None,
        capsule=given.capsule if given.HasField("capsule") else None,
        cone=given.cone if given.HasField("cone") else None,
    )


def closest_from_proto(pairs: Sequence[proto.ClosestPoints]) -> tuple[ClosestPoints, ...]:
    """Converts from messages."""
    return tuple(
        ClosestPoints(
            robot_a=each.robot_a,
            link_a=each.link_a,
            robot_b=each.robot_b,
            link_b=each.link_b,
            point_a=vector_from_proto(each.point_a),
            point_b=vector_from_proto(each.point_b),
            normal=vector_from_proto(each.normal),
            distance=each.distance,
        )
        for each in pairs
    )


def bounds_from_proto(links: Sequence[proto.LinkBounds]) -> tuple[LinkBounds, ...]:
    """Converts from messages."""
    return tuple(
        LinkBounds(each.robot, each.link, vector_from_proto(each.lower), vector_from_proto(each.upper))
        for each in links
    )

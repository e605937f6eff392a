# Generated from simd_client/aio/constraints.py by tools/make_blocking.py; do not edit.
"""Constraints that hold links together, in addition to the joints of robots."""

from __future__ import annotations

import numpy.typing as npt

from simd_client import proto
from simd_client.blocking.connection import Connection
from simd_client.attributes import FixedAttributes
from simd_client.constraint import (
    Constraint,
    ConstraintEnd,
    ConstraintKind,
    constraint_from_proto,
    end_to_proto,
    kind_to_proto,
)
from simd_client.geometry import Pose, pose_to_proto, vector_to_proto
from simd_client.proto import methods
from simd_client.state import Named, name_of
from simd_client.world import Stamp, stamp_from_proto


class Constraints(FixedAttributes):
    """The constraints of a world. They persist across resets, are part of saved states, and are deleted with
    their robots."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def create(
        self,
        kind: ConstraintKind,
        parent: ConstraintEnd,
        child: ConstraintEnd,
        *,
        name: str = "",
        axis: npt.ArrayLike | None = None,
        ratio: float | None = None,
        offset: float | None = None,
        length: float | None = None,
        rope: bool = False,
        max_force: float | None = None,
        max_torque: float | None = None,
        breaks: bool = False,
        disable_collisions: bool = False,
    ) -> str:
        """Holds two links together from the next step on. Returns the constraint's name.

        `weld`: the frames of both ends coincide. `point_to_point`: their origins coincide. `hinge`: only
        rotation about `axis` remains; `slide`: only translation along it. `gear`: child joint = `ratio` *
        parent joint + `offset`. `distance`: the origins are `length` apart, or less for a `rope`. Offset and
        length default to their current values. Without limits a constraint applies any force that it needs.
        Raises `RobotNotFound`, `InvalidValue`, `ConstraintExists`.
        """
        request = proto.CreateConstraintRequest(
            name=name,
            kind=kind_to_proto(kind),
            parent=end_to_proto(parent),
            child=end_to_proto(child),
            axis=None if axis is None else vector_to_proto(axis, "an axis"),
            ratio=ratio,
            offset=offset,
            length=length,
            rope=rope,
            max_force=max_force,
            max_torque=max_torque,
            breaks=breaks,
            disable_collisions=disable_collisions,
        )
        return self._connection.call(methods.CreateConstraint, request).name

    def change(
        self,
        name: str,
        *,
        parent_pose: Pose | None = None,
        child_pose: Pose | None = None,
        max_force: float | None = None,
        max_torque: float | None = None,
        breaks: bool | None = None,
        ratio: float | None = None,
        offset: float | None = None,
        length: float | None = None,
    ) -> Stamp:
        """Changes the given properties. An infinite limit means no limit. Raises `ConstraintNotFound`,
        `InvalidValue`."""
        request = proto.ChangeConstraintRequest(
            name=name,
            parent_pose=None if parent_pose is None else pose_to_proto(parent_pose),
            child_pose=None if child_pose is None else pose_to_proto(child_pose),
            max_force=max_force,
            max_torque=max_torque,
            ratio=ratio,
            offset=offset,
            length=length,
        )
        if breaks is not None:
            request.breaks = breaks
        return stamp_from_proto(self._connection.call(methods.ChangeConstraint, request).stamp)

    def delete(self, name: str) -> Stamp:
        """Releases two links. Raises `ConstraintNotFound`."""
        request = proto.DeleteConstraintRequest(name=name)
        return stamp_from_proto(self._connection.call(methods.DeleteConstraint, request).stamp)

    def list(self, robot: str | Named | None = None) -> tuple[Constraint, ...]:
        """Returns the constraints of the world or of one robot, in order of creation, with their forces over
        the last step."""
        request = proto.ListConstraintsRequest(robot="" if robot is None else name_of(robot))
        answer = self._connection.call(methods.ListConstraints, request)
        return tuple(constraint_from_proto(each) for each in answer.constraints)

"""Poses, velocities and vectors as numpy arrays, and as messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from simd_client import proto

FloatArray = npt.NDArray[np.float64]
"""An array of float64."""


def vector(values: npt.ArrayLike, length: int, what: str) -> FloatArray:
    """Returns a float64 vector of this length. Raises `ValueError` for another length."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (length,):
        raise ValueError(f"{what} has {length} numbers, not the shape {array.shape}")
    return array


def rotation_vector(orientation: npt.ArrayLike) -> FloatArray:
    """Returns axis times angle of a quaternion x y z w of any nonzero length, rad, the short way round."""
    quaternion = vector(orientation, 4, "an orientation (x y z w)")
    part, w = (quaternion[:3], quaternion[3]) if quaternion[3] >= 0.0 else (-quaternion[:3], -quaternion[3])
    sine = float(np.linalg.norm(part))
    return part * (2.0 * np.arctan2(sine, w) / sine) if sine > 0.0 else np.zeros(3)


def rows(values: Sequence[float], columns: int) -> FloatArray:
    """Returns packed numbers as a float64 matrix with `columns` columns."""
    return np.reshape(np.array(values, dtype=np.float64), (-1, columns) if columns else (0, 0))


def _origin() -> FloatArray:
    return np.zeros(3)


def _no_rotation() -> FloatArray:
    return np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Pose:
    """A rigid transform `a_from_b`: rotate, then translate."""

    position: FloatArray = field(default_factory=_origin)
    """x y z, metres."""
    orientation: FloatArray = field(default_factory=_no_rotation)
    """Quaternion x y z w, of unit length."""

    @staticmethod
    def of(position: npt.ArrayLike = (0, 0, 0), orientation: npt.ArrayLike = (0, 0, 0, 1)) -> Pose:
        """Builds a pose from any sequences of three and of four numbers."""
        return Pose(vector(position, 3, "a position"), vector(orientation, 4, "an orientation (x y z w)"))

    def matrix(self) -> FloatArray:
        """Returns the homogeneous transform, 4 by 4."""
        x, y, z, w = self.orientation / np.linalg.norm(self.orientation)
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, 3] = self.position
        return matrix

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Pose)
            and np.array_equal(self.position, other.position)
            and np.array_equal(self.orientation, other.orientation)
        )

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True)
class Twist:
    """A velocity in world axes, at the origin of the moving frame."""

    linear: FloatArray = field(default_factory=_origin)
    """Metres per second."""
    angular: FloatArray = field(default_factory=_origin)
    """Radians per second."""

    @staticmethod
    def of(linear: npt.ArrayLike = (0, 0, 0), angular: npt.ArrayLike = (0, 0, 0)) -> Twist:
        """Builds a twist from any sequences of three numbers."""
        return Twist(vector(linear, 3, "a linear velocity"), vector(angular, 3, "an angular velocity"))

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Twist)
            and np.array_equal(self.linear, other.linear)
            and np.array_equal(self.angular, other.angular)
        )

    __hash__ = None  # type: ignore[assignment]


def vector_to_proto(values: npt.ArrayLike, what: str) -> proto.Vector3:
    """Converts three numbers to a message."""
    x, y, z = vector(values, 3, what).tolist()
    return proto.Vector3(x=x, y=y, z=z)


def vector_from_proto(message: proto.Vector3) -> FloatArray:
    """Converts three numbers from a message."""
    return np.array([message.x, message.y, message.z])


def pose_to_proto(pose: Pose) -> proto.Pose:
    """Converts a pose to a message."""
    x, y, z, w = vector(pose.orientation, 4, "an orientation (x y z w)").tolist()
    position = vector_to_proto(pose.position, "a position")
    return proto.Pose(position=position, orientation=proto.Quaternion(x=x, y=y, z=z, w=w))


def pose_from_proto(message: proto.Pose) -> Pose:
    """Converts a pose from a message; an absent orientation means no rotation."""
    turn = message.orientation
    orientation = np.array([turn.x, turn.y, turn.z, turn.w])
    if not orientation.any():
        orientation = _no_rotation()
    return Pose(vector_from_proto(message.position), orientation)


def twist_to_proto(twist: Twist) -> proto.Twist:
    """Converts a velocity to a message."""
    return proto.Twist(
        linear=vector_to_proto(twist.linear, "a linear velocity"),
        angular=vector_to_proto(twist.angular, "an angular velocity"),
    )


def twist_from_proto(message: proto.Twist) -> Twist:
    """Converts a velocity from a message."""
    return Twist(vector_from_proto(message.linear), vector_from_proto(message.angular))

"""Jacobians, inverse kinematics and joint reactions: their results, and the configurations that they use."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.errors import JointNotFound, listed, not_found
from simd_client.geometry import FloatArray, Pose, Twist, pose_to_proto, twist_to_proto
from simd_client.world import Stamp


@dataclass(frozen=True)
class Wrench:
    """A force and a torque."""

    force: FloatArray
    """Newtons."""
    torque: FloatArray
    """Newton metres."""


@dataclass(frozen=True, eq=False)
class JointReactions(Mapping[str, Wrench]):
    """The force and torque in each joint over the last step, as a force-torque sensor in it would measure.

    Each acts from the parent link on the child, in the child link's frame and about its origin.
    """

    stamp: Stamp
    joints: tuple[str, ...]
    """Fixed ones included."""
    wrenches: FloatArray
    """One row per joint: force x y z, N, then torque x y z, N m."""

    def __getitem__(self, joint: str) -> Wrench:
        if joint not in self.joints:
            message = f"there is no joint `{joint}`; there are {listed(self.joints, joint)}"
            raise not_found(JointNotFound, message, joint=joint)
        row = self.wrenches[self.joints.index(joint)]
        return Wrench(row[:3], row[3:])

    def __iter__(self) -> Iterator[str]:
        return iter(self.joints)

    def __len__(self) -> int:
        return len(self.joints)


@dataclass(frozen=True, eq=False)
class Jacobian:
    """Maps joint velocities to the velocity of a point of a link. Columns are in joint order; a free root
    adds six in front."""

    linear: FloatArray
    """The point's velocity in world axes: 3 rows."""
    angular: FloatArray
    """The link's angular velocity in world axes: 3 rows."""


@dataclass(frozen=True, eq=False)
class InverseKinematics:
    """Joint positions that bring a link to a pose, or as close as the solver came."""

    positions: FloatArray
    """In joint order."""
    converged: bool
    position_error: float
    """Metres from the target."""
    orientation_error: float
    """Radians from the target; 0 if the target had no orientation."""
    iterations: int


@dataclass(frozen=True, eq=False)
class Configuration:
    """A configuration to compute with instead of the current one."""

    positions: npt.ArrayLike | None = None
    """In joint order. Default: the newest state supplies everything."""
    velocities: npt.ArrayLike | None = None
    """In joint order. Default: at rest."""
    root: Pose | None = None
    """`world_from_root`. Default: the current pose."""
    root_twist: Twist | None = None
    """Twist of a free root. Default: at rest."""


def configuration_to_proto(given: Configuration | None) -> proto.Configuration | None:
    """Converts to a message; `None` means the newest state."""
    if given is None or given.positions is None:
        if given is not None and (
            given.velocities is not None or given.root is not None or given.root_twist is not None
        ):
            raise ValueError("a configuration begins with its positions")
        return None
    return proto.Configuration(
        positions=joint_array(given.positions),
        velocities=None if given.velocities is None else joint_array(given.velocities),
        root=None if given.root is None else pose_to_proto(given.root),
        root_twist=None if given.root_twist is None else twist_to_proto(given.root_twist),
    )


def joint_array(values: npt.ArrayLike) -> list[float]:
    """Returns numbers in joint order. Raises `ValueError` for more than one dimension."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise ValueError(f"an array in joint order has one dimension, not the shape {array.shape}")
    return array.tolist()

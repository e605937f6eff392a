"""Calls of `KinematicsService`: what follows from where a robot's joints are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import (
    FloatArray,
    Pose,
    Twist,
    pose_to_proto,
    rows,
    twist_to_proto,
    vector,
    vector_to_proto,
)
from simd_client.link_states import LinkStates, link_states_from_proto
from simd_client.memory import Memory
from simd_client.plan import Plan, ask
from simd_client.plans import joints
from simd_client.proto import methods
from simd_client.state import layout_changed
from simd_client.world import Stamp, stamp_from_proto


@dataclass(frozen=True)
class Wrench:
    """A force and a torque."""

    force: FloatArray
    """Newtons."""
    torque: FloatArray
    """Newton metres."""


@dataclass(frozen=True, eq=False)
class JointReactions(Mapping[str, Wrench]):
    """What joints carried over the last step, by joint: what force-torque sensors in them show.

    Each is what the parent link does to the child, in the child link's frame and about its origin.
    """

    stamp: Stamp
    joints: tuple[str, ...]
    """Fixed ones included."""
    wrenches: FloatArray
    """One row a joint: force x y z, N, then torque x y z, N m."""

    def __getitem__(self, joint: str) -> Wrench:
        if joint not in self.joints:
            raise KeyError(joint)
        row = self.wrenches[self.joints.index(joint)]
        return Wrench(row[:3], row[3:])

    def __iter__(self) -> Iterator[str]:
        return iter(self.joints)

    def __len__(self) -> int:
        return len(self.joints)


@dataclass(frozen=True, eq=False)
class Jacobian:
    """How rates move a point of a link. Columns are rates in joint order; a free root has six more in front."""

    linear: FloatArray
    """Of the point's velocity in world axes: 3 rows."""
    angular: FloatArray
    """Of the link's angular velocity in world axes: 3 rows."""


@dataclass(frozen=True, eq=False)
class InverseKinematics:
    """Joint positions at which a link is at a pose, or as near as was found."""

    positions: FloatArray
    """In joint order."""
    converged: bool
    position_error: float
    """Metres from the target."""
    orientation_error: float
    """Radians from the target; 0 where no orientation was asked for."""
    iterations: int


@dataclass(frozen=True, eq=False)
class Configuration:
    """A configuration other than the present one; what is left out is taken as said."""

    positions: npt.ArrayLike | None = None
    """In joint order; left out, everything is the newest state's."""
    velocities: npt.ArrayLike | None = None
    """In joint order; left out, at rest."""
    root: Pose | None = None
    """`world_from_root`; left out, where the root is."""
    root_twist: Twist | None = None
    """Of a free root; left out, at rest."""


def configuration(given: Configuration | None) -> proto.Configuration | None:
    """As a message; absent is the newest state's."""
    if given is None or given.positions is None:
        if given is not None and (
            given.velocities is not None or given.root is not None or given.root_twist is not None
        ):
            raise ValueError("a configuration begins with its positions")
        return None
    return proto.Configuration(
        positions=_numbers(given.positions),
        velocities=None if given.velocities is None else _numbers(given.velocities),
        root=None if given.root is None else pose_to_proto(given.root),
        root_twist=None if given.root_twist is None else twist_to_proto(given.root_twist),
    )


def link_states(robot: str) -> Plan[LinkStates]:
    """Where a robot's links are and how they move."""
    answer = yield from ask(methods.GetLinkStates, proto.GetLinkStatesRequest(robots=[robot]))
    found = answer.robots[0] if answer.robots else proto.RobotLinkStates()
    return link_states_from_proto(found, stamp_from_proto(answer.stamp))


def joint_reactions(memory: Memory, robot: str) -> Plan[JointReactions]:
    """What joints carried over the last step."""
    answer = yield from ask(methods.GetJointReactions, proto.GetJointReactionsRequest(robot=robot))
    known = yield from joints.layout(memory, robot)
    if known.version != answer.layout_version:
        known = yield from joints.fetch_layout(memory, robot)
    wrenches = rows(answer.wrenches, 6)
    if known.version != answer.layout_version or len(wrenches) != len(known.joints):
        raise layout_changed(robot)
    names = tuple(joint.name for joint in known.joints)
    return JointReactions(stamp_from_proto(answer.stamp), names, wrenches)


def jacobian(
    robot: str, link: str, point: npt.ArrayLike | None, given: Configuration | None
) -> Plan[Jacobian]:
    """How rates move a point of a link."""
    request = proto.GetJacobianRequest(
        robot=robot,
        link=link,
        point=None if point is None else vector_to_proto(point, "a point"),
        configuration=configuration(given),
    )
    answer = yield from ask(methods.GetJacobian, request)
    return Jacobian(rows(answer.linear, answer.columns), rows(answer.angular, answer.columns))


def mass_matrix(robot: str, given: Configuration | None) -> Plan[FloatArray]:
    """The joint-space inertia matrix, armature included."""
    request = proto.GetMassMatrixRequest(robot=robot, configuration=configuration(given))
    answer = yield from ask(methods.GetMassMatrix, request)
    return rows(answer.matrix, answer.columns)


def inverse_dynamics(
    robot: str, accelerations: npt.ArrayLike | None, given: Configuration | None
) -> Plan[FloatArray]:
    """The efforts that give these accelerations."""
    request = proto.ComputeInverseDynamicsRequest(
        robot=robot,
        configuration=configuration(given),
        accelerations=None if accelerations is None else _numbers(accelerations),
    )
    answer = yield from ask(methods.ComputeInverseDynamics, request)
    return np.array(answer.efforts, dtype=np.float64)


def inverse_kinematics(
    robot: str,
    link: str,
    position: npt.ArrayLike,
    orientation: npt.ArrayLike | None,
    point: npt.ArrayLike | None,
    guess: Configuration | None,
    joints: Sequence[str],
    max_iterations: int,
    tolerance: float,
) -> Plan[InverseKinematics]:
    """Joint positions at which a link is at a pose."""
    target = proto.Pose(position=vector_to_proto(position, "a position"))
    if orientation is not None:
        x, y, z, w = vector(orientation, 4, "an orientation (x y z w)").tolist()
        target.orientation.CopyFrom(proto.Quaternion(x=x, y=y, z=z, w=w))
    request = proto.ComputeInverseKinematicsRequest(
        robot=robot,
        link=link,
        target=target,
        point=None if point is None else vector_to_proto(point, "a point"),
        guess=configuration(guess),
        joints=joints,
        max_iterations=max_iterations,
        tolerance=tolerance,
    )
    answer = yield from ask(methods.ComputeInverseKinematics, request)
    return InverseKinematics(
        positions=np.array(answer.positions, dtype=np.float64),
        converged=answer.converged,
        position_error=answer.position_error,
        orientation_error=answer.orientation_error,
        iterations=answer.iterations,
    )


def _numbers(values: npt.ArrayLike) -> list[float]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise ValueError(f"an array in joint order has one dimension, not the shape {array.shape}")
    return array.tolist()

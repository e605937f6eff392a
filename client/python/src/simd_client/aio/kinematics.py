"""Quantities computed from a robot's configuration: link states, Jacobians, inertia, inverse kinematics."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.aio.connection import Connection
from simd_client.attributes import FixedAttributes
from simd_client.errors import AnswerError
from simd_client.geometry import FloatArray, rows, vector, vector_to_proto
from simd_client.kinematics import (
    Configuration,
    InverseKinematics,
    Jacobian,
    JointReactions,
    configuration_to_proto,
    joint_array,
)
from simd_client.link_states import LinkStates
from simd_client.proto import methods
from simd_client.state import layout_changed
from simd_client.world import stamp_from_proto


class Kinematics(FixedAttributes):
    """The part of a robot that computes kinematics and dynamics."""

    def __init__(self, connection: Connection, name: str) -> None:
        self._connection = connection
        self._name = name

    @property
    def connection(self) -> Connection:
        """The connection that the robot was obtained from."""
        return self._connection

    @property
    def name(self) -> str:
        """The robot's name in the world."""
        return self._name

    async def link_states(self) -> LinkStates:
        """Returns poses and velocities of all links, in the order of `links`."""
        found = await self._connection.link_states(self.name)
        if self.name not in found:
            raise AnswerError(f"the daemon's answer cannot be understood: it lacks robot `{self.name}`")
        return found[self.name]

    async def joint_reactions(self) -> JointReactions:
        """Returns the force and torque in each joint over the last step, from the parent link on the
        child."""
        request = proto.GetJointReactionsRequest(robot=self.name)
        answer = await self._connection.call(methods.GetJointReactions, request)
        known = await self._connection.layout(self.name)
        if known.version != answer.layout_version:
            known = await self._connection.fetch_layout(self.name)
        wrenches = rows(answer.wrenches, 6)
        if known.version != answer.layout_version or len(wrenches) != len(known.joints):
            raise layout_changed(self.name)
        names = tuple(joint.name for joint in known.joints)
        return JointReactions(stamp_from_proto(answer.stamp), names, wrenches)

    async def jacobian(
        self, link: str, point: npt.ArrayLike | None = None, configuration: Configuration | None = None
    ) -> Jacobian:
        """Returns the Jacobian of a point of a link (in the link's frame, metres; default: its origin)."""
        request = proto.GetJacobianRequest(
            robot=self.name,
            link=link,
            point=None if point is None else vector_to_proto(point, "a point"),
            configuration=configuration_to_proto(configuration),
        )
        answer = await self._connection.call(methods.GetJacobian, request)
        return Jacobian(rows(answer.linear, answer.columns), rows(answer.angular, answer.columns))

    async def mass_matrix(self, configuration: Configuration | None = None) -> FloatArray:
        """Returns the joint-space inertia matrix, armature included; the six velocities of a free root come
        first."""
        request = proto.GetMassMatrixRequest(
            robot=self.name, configuration=configuration_to_proto(configuration)
        )
        answer = await self._connection.call(methods.GetMassMatrix, request)
        return rows(answer.matrix, answer.columns)

    async def inverse_dynamics(
        self, accelerations: npt.ArrayLike | None = None, configuration: Configuration | None = None
    ) -> FloatArray:
        """Returns the efforts that produce these accelerations (default: zero) under gravity, without
        contacts, limits and friction; the six of a free root come first."""
        request = proto.ComputeInverseDynamicsRequest(
            robot=self.name,
            configuration=configuration_to_proto(configuration),
            accelerations=None if accelerations is None else joint_array(accelerations),
        )
        answer = await self._connection.call(methods.ComputeInverseDynamics, request)
        return np.array(answer.efforts, dtype=np.float64)

    async def inverse_kinematics(
        self,
        link: str,
        position: npt.ArrayLike,
        orientation: npt.ArrayLike | None = None,
        *,
        point: npt.ArrayLike | None = None,
        guess: Configuration | None = None,
        joints: Iterable[str] = (),
        max_iterations: int = 0,
        tolerance: float = 0.0,
    ) -> InverseKinematics:
        """Returns joint positions, within the limits, that bring `point` of a link to `position` (metres,
        world) and the link to `orientation` (x y z w). Only `joints` move; by default all of them.
        `max_iterations` is 300 and `tolerance` (metres) 1e-4 unless they are above 0."""
        target = proto.Pose(position=vector_to_proto(position, "a position"))
        if orientation is not None:
            x, y, z, w = vector(orientation, 4, "an orientation (x y z w)").tolist()
            target.orientation.CopyFrom(proto.Quaternion(x=x, y=y, z=z, w=w))
        request = proto.ComputeInverseKinematicsRequest(
            robot=self.name,
            link=link,
            target=target,
            point=None if point is None else vector_to_proto(point, "a point"),
            guess=configuration_to_proto(guess),
            joints=joints,
            max_iterations=max_iterations,
            tolerance=tolerance,
        )
        answer = await self._connection.call(methods.ComputeInverseKinematics, request)
        return InverseKinematics(
            positions=np.array(answer.positions, dtype=np.float64),
            converged=answer.converged,
            position_error=answer.position_error,
            orientation_error=answer.orientation_error,
            iterations=answer.iterations,
        )

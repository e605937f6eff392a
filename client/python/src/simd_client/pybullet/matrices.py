"""Jacobians, inertia matrices and inverse dynamics."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from simd_client.proto import (
    ComputeInverseDynamicsRequest,
    GetJacobianRequest,
    GetMassMatrixRequest,
    methods,
)

from . import coordinates
from .arguments import floats, formerly, vector
from .bodies import Body
from .connections import connected
from .coordinates import Array
from .errors import error, unsupported
from .world import World

# Bit of `flags`: positions have a base and quaternions, see `coordinates`.
_LONG = 1


def calculateJacobian(
    bodyUniqueId: int,
    linkIndex: int,
    localPosition: Any,
    objPositions: Any,
    objVelocities: Any = (),
    objAccelerations: Any = (),
    physicsClientId: int = 0,
) -> tuple[Any, Any]:
    """Returns the Jacobian of a point of a link, given in the link's frame: three rows for its velocity,
    three for the link's angular velocity. A free base has six columns in front, angular and then linear
    velocity of its centre of mass, in the base's own axes."""
    del objVelocities, objAccelerations
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateJacobian failed.")
    link = body.link_name(linkIndex)
    if link is None:
        raise error("Error in calculateJacobian: invalid linkIndex")
    text = "calculateJacobian: localPosition and objPositions must be sequences of numbers"
    request = GetJacobianRequest(robot=body.robot, link=link)
    request.point.x, request.point.y, request.point.z = vector(localPosition, text)
    request.configuration.CopyFrom(coordinates.short(body, floats(objPositions, text)))
    answer = world.wire.call(methods.GetJacobian, request)
    change = coordinates.from_short(body)
    linear, angular = (_matrix(rows, answer.columns) @ change for rows in (answer.linear, answer.angular))
    return _rows(linear), _rows(angular)


def calculateMassMatrix(
    bodyUniqueId: int, objPositions: Any, flags: int = 0, physicsClientId: int = 0
) -> Any:
    """Returns the joint-space inertia matrix, row by row; a free base adds six velocities in front, as in
    calculateJacobian. With flags 1, positions are a base's seven and then the joints', with quaternions. Rows
    then fit DeepMimic's controllers: linear and angular velocity of the base in world axes, and a 1 for a
    missing one."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateMassMatrix failed.")
    request = GetMassMatrixRequest(robot=body.robot)
    text = "calculateMassMatrix: objPositions must be a sequence of numbers"
    positions = floats(objPositions, text)
    if flags & _LONG:
        _check_long(body, "calculateMassMatrix", positions)
        request.configuration.CopyFrom(coordinates.long(body, positions))
        change = coordinates.from_long(body, positions)
    else:
        # As in PyBullet, excess numbers are ignored, even though the base's come first.
        positions = positions[: sum(joint.width for joint in body.joints)]
        request.configuration.CopyFrom(coordinates.short(body, positions))
        change = coordinates.from_short(body)
    answer = world.wire.call(methods.GetMassMatrix, request)
    inertia = np.transpose(change) @ _matrix(answer.matrix, answer.columns) @ change
    if flags & _LONG:
        empty = coordinates.unused_columns(body)
        inertia[empty, empty] = 1.0
    return _rows(inertia)


@formerly("bodyIndex", "bodyUniqueId")
def calculateInverseDynamics(
    bodyUniqueId: int,
    objPositions: Any,
    objVelocities: Any,
    objAccelerations: Any,
    flags: int = 0,
    physicsClientId: int = 0,
) -> tuple[float, ...]:
    """Returns the efforts that produce these joint accelerations, under gravity and without contacts.

    A free base adds its position and quaternion, six velocities and six accelerations (angular, then linear
    of its centre of mass) before the joints' numbers. The answer then begins with the force and the torque;
    all but the pose are in the base's axes. With flags 1, for free bases, numbers are as in
    calculateMassMatrix, and the efforts are without any acceleration. As in PyBullet, the given accelerations
    are ignored."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateInverseDynamics failed.")
    text = "Error in calculateInverseDynamics, please check arguments."
    positions, velocities = floats(objPositions, text), floats(objVelocities, text)
    accelerations = floats(objAccelerations, text)
    if len(velocities) != len(accelerations):
        raise error(f"calculateInverseDynamics: {len(velocities)} velocities, and {len(accelerations)} accelerations")
    request = ComputeInverseDynamicsRequest(robot=body.robot)
    if flags & _LONG:
        _check_long(body, "calculateInverseDynamics", positions)
        request.configuration.CopyFrom(coordinates.long(body, positions, velocities))
        return _efforts(world, request, coordinates.from_long(body, positions))
    if body.fixed:
        request.configuration.CopyFrom(coordinates.short(body, positions, velocities))
        change = coordinates.from_short(body)
        request.accelerations.extend((change @ np.array(accelerations)).tolist())
        return _efforts(world, request, change)
    wanted = coordinates.placed_widths(body)
    if (len(positions), len(velocities)) != wanted:
        raise error(f"{text} {body.robot} has {wanted[0]} positions and {wanted[1]} velocities, its free base's first")
    request.configuration.CopyFrom(coordinates.placed(body, positions, velocities))
    request.accelerations.extend(coordinates.placed_accelerations(body, positions, velocities, accelerations))
    efforts = _efforts(world, request, coordinates.from_placed(body, positions))
    return (*efforts[3:6], *efforts[:3], *efforts[6:])


def _check_long(body: Body, function: str, positions: Sequence[float]) -> None:
    if body.fixed:
        raise unsupported(function, "flags 1 is for robots with a free base")
    wanted = coordinates.long_width(body)
    if len(positions) != wanted:
        raise error(f"{function}: {len(positions)} positions, where {body.robot} has {wanted} with flags 1")


def _efforts(world: World, request: ComputeInverseDynamicsRequest, change: Array) -> tuple[float, ...]:
    efforts = np.array(world.wire.call(methods.ComputeInverseDynamics, request).efforts)
    return tuple((np.transpose(change) @ efforts).tolist())


def _matrix(values: Iterable[float], columns: int) -> Array:
    """Returns a matrix from consecutive rows."""
    flat = list(values)
    rows = [flat[start : start + columns] for start in range(0, len(flat), columns)]
    return np.array(rows, np.float64)


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


__all__ = ["calculateInverseDynamics", "calculateJacobian", "calculateMassMatrix"]

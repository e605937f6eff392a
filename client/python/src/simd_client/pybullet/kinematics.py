"""Poses and velocities of links, Jacobians, inverse dynamics."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simd_client.proto import (
    ApplyLinkWrenchRequest,
    ComputeInverseDynamicsRequest,
    Configuration,
    GetJacobianRequest,
    GetMassMatrixRequest,
    RobotLinkPoses,
    RobotLinkStates,
    SetEntityStateRequest,
    WrenchFrame,
    methods,
)
from simd_client.proto import Pose as PoseMessage

from . import constants
from .arguments import Pose, Vector, floats, formerly, indices, quaternion, vector
from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .rotations import compose, cross, inverse, rotate
from .world import World

Array = NDArray[np.float64]


def getLinkState(
    bodyUniqueId: int,
    linkIndex: int,
    computeLinkVelocity: int = 0,
    computeForwardKinematics: int = 0,
    physicsClientId: int = 0,
) -> tuple[Any, ...] | None:
    """World pose of the centre of mass, its pose in the link's frame, world pose of the link's
    frame, and, if asked for, linear and angular velocity of the centre of mass."""
    del computeForwardKinematics
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getLinkState failed.")
    if not 0 <= linkIndex < len(body.joints):
        return None
    return _link_states(world, body, [linkIndex], bool(computeLinkVelocity))[0]


def getLinkStates(
    bodyUniqueId: int,
    linkIndices: Any,
    computeLinkVelocity: int = 0,
    computeForwardKinematics: int = 0,
    physicsClientId: int = 0,
) -> tuple[Any, ...] | None:
    """`getLinkState` for several links of a robot."""
    del computeForwardKinematics
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getLinkState failed.")
    wanted = indices(linkIndices, "expected a sequence of link indices")
    if any(not 0 <= index < len(body.joints) for index in wanted):
        return None
    return tuple(_link_states(world, body, wanted, bool(computeLinkVelocity)))


def _link_states(world: World, body: Body, wanted: list[int], moving: bool) -> list[tuple[Any, ...]]:
    twists = world.link_states(body).twists if moving else None
    poses = world.link_poses(body)
    answers: list[tuple[Any, ...]] = []
    for index in wanted:
        link = body.joints[index].link
        frame, inertia = link_pose(body, poses, link), body.frame(link)
        answer = (*compose(frame, inertia), *inertia, *frame)
        if twists is not None:
            at = 6 * body.link_places[link]
            x, y, z, a, b, c = twists[at : at + 6]
            answer = (*answer, *_at_center(frame, inertia, (x, y, z), (a, b, c)))
        answers.append(answer)
    return answers


def link_pose(body: Body, states: RobotLinkPoses | RobotLinkStates, link: str) -> Pose:
    """world_from_link."""
    at = 7 * body.link_places[link]
    x, y, z, i, j, k, w = states.poses[at : at + 7]
    return (x, y, z), (i, j, k, w)


def _at_center(frame: Pose, inertia: Pose, linear: Vector, angular: Vector) -> tuple[Vector, Vector]:
    """Velocities of the centre of mass, from those of the link's origin."""
    dx, dy, dz = cross(angular, rotate(frame[1], inertia[0]))
    return (linear[0] + dx, linear[1] + dy, linear[2] + dz), angular


def getBasePositionAndOrientation(bodyUniqueId: int, physicsClientId: int = 0) -> Pose:
    """World pose of the root link's centre of mass and axes of inertia."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "GetBasePositionAndOrientation failed.")
    return compose(world.root(body)[0], body.frame(body.base_link))


def getBaseVelocity(bodyUniqueId: int, physicsClientId: int = 0) -> tuple[Vector, Vector]:
    """Linear velocity of the root link's centre of mass, and angular velocity, world axes."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getBaseVelocity failed.")
    return _base_velocity(world, body)


def _base_velocity(world: World, body: Body) -> tuple[Vector, Vector]:
    pose, (linear, angular) = world.root(body)
    return _at_center(pose, body.frame(body.base_link), linear, angular)


def resetBasePositionAndOrientation(
    bodyUniqueId: int, posObj: Any, ornObj: Any, physicsClientId: int = 0
) -> None:
    """Sets the world pose of the root link's centre of mass, at rest."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "resetBasePositionAndOrientation failed.")
    center = (
        vector(posObj, "position needs a 3 coordinates [x,y,z]."),
        quaternion(ornObj, "orientation needs a 4 coordinates [x,y,z,w]."),
    )
    request = SetEntityStateRequest(robot=body.robot)
    _put_pose(request.pose, compose(center, inverse(body.frame(body.base_link))))
    if not body.fixed:
        request.twist.SetInParent()
    world.wire.call(methods.SetEntityState, request)
    world.forget_states()


def resetBaseVelocity(
    objectUniqueId: int, linearVelocity: Any = None, angularVelocity: Any = None, physicsClientId: int = 0
) -> None:
    """Sets the linear velocity of the root link's centre of mass, the angular one, or both."""
    world = connected(physicsClientId)
    body = world.body(objectUniqueId, "resetBaseVelocity failed.")
    if linearVelocity is None and angularVelocity is None:
        raise error("expected at least linearVelocity and/or angularVelocity.")
    if body.fixed:
        return
    linear, angular = _base_velocity(world, body)
    if linearVelocity is not None:
        linear = vector(linearVelocity, "linearVelocity needs 3 coordinates [x,y,z].")
    if angularVelocity is not None:
        angular = vector(angularVelocity, "angularVelocity needs 3 coordinates [x,y,z].")
    back = cross(angular, rotate(world.root(body)[0][1], body.frame(body.base_link)[0]))
    request = SetEntityStateRequest(robot=body.robot)
    line, turn = request.twist.linear, request.twist.angular
    line.x, line.y, line.z = (linear[i] - back[i] for i in range(3))
    turn.x, turn.y, turn.z = angular
    world.wire.call(methods.SetEntityState, request)
    world.forget_states()


def applyExternalForce(
    objectUniqueId: int, linkIndex: int, forceObj: Any, posObj: Any, flags: int, physicsClientId: int = 0
) -> None:
    """A force on a link for the next step: in world axes at a world position, or in the axes of
    the link's inertia at a position from its centre of mass."""
    text = "force and position need 3 coordinates [x,y,z]."
    force, place = vector(forceObj, text), vector(posObj, text)
    _push(physicsClientId, objectUniqueId, linkIndex, force, None, place, flags)


def applyExternalTorque(
    objectUniqueId: int, linkIndex: int, torqueObj: Any, flags: int, physicsClientId: int = 0
) -> None:
    """A torque on a link for the next step, in world axes or in those of the link's inertia."""
    torque = vector(torqueObj, "torque needs 3 coordinates [x,y,z].")
    _push(physicsClientId, objectUniqueId, linkIndex, None, torque, None, flags)


def _push(
    client: int,
    unique_id: int,
    index: int,
    force: Vector | None,
    torque: Vector | None,
    place: Vector | None,
    flags: int,
) -> None:
    if flags not in (constants.WORLD_FRAME, constants.LINK_FRAME):
        raise error("flags must be WORLD_FRAME or LINK_FRAME")
    world = connected(client)
    body = world.body(unique_id, "there is no such body")
    link = body.link_name(index)
    if link is None:
        raise error("Link index out-of-range.")
    inertia = body.frame(link)
    request = ApplyLinkWrenchRequest(robot=body.robot, link=link)
    if flags == constants.LINK_FRAME:
        request.frame = WrenchFrame.WRENCH_FRAME_LINK
        turn = inertia[1]
        point = compose(inertia, (place, turn))[0] if place is not None else None
    else:
        request.frame = WrenchFrame.WRENCH_FRAME_WORLD
        turn = (0.0, 0.0, 0.0, 1.0)
        point = None
        if place is not None:
            frame = link_pose(body, world.link_poses(body), link)
            point = compose(inverse(frame), (place, turn))[0]
    if force is not None:
        wire = request.wrench.force
        wire.x, wire.y, wire.z = rotate(turn, force)
    if torque is not None:
        wire = request.wrench.torque
        wire.x, wire.y, wire.z = rotate(turn, torque)
    if point is not None:
        request.point.x, request.point.y, request.point.z = point
    world.wire.call(methods.ApplyLinkWrench, request)


def calculateJacobian(
    bodyUniqueId: int,
    linkIndex: int,
    localPosition: Any,
    objPositions: Any,
    objVelocities: Any = (),
    objAccelerations: Any = (),
    physicsClientId: int = 0,
) -> tuple[Any, Any]:
    """The Jacobian of a point of a link, given in the link's frame: three rows for its velocity,
    three for the link's angular velocity. A free base has six columns in front, angular and then
    linear velocity of its centre of mass, in the base's own axes."""
    del objVelocities, objAccelerations
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateJacobian failed.")
    link = body.link_name(linkIndex)
    if link is None:
        raise error("Error in calculateJacobian: invalid linkIndex")
    text = "calculateJacobian: localPosition and objPositions must be sequences of numbers"
    request = GetJacobianRequest(robot=body.robot, link=link)
    request.point.x, request.point.y, request.point.z = vector(localPosition, text)
    _configure(world, body, request.configuration, floats(objPositions, text))
    answer = world.wire.call(methods.GetJacobian, request)
    change = _from_bullet(body, answer.columns)
    linear, angular = (_matrix(rows, answer.columns) @ change for rows in (answer.linear, answer.angular))
    return _rows(linear), _rows(angular)


def calculateMassMatrix(
    bodyUniqueId: int, objPositions: Any, flags: int = 0, physicsClientId: int = 0
) -> Any:
    """The joint-space inertia matrix, row by row; of a free base with six velocities in front, as
    calculateJacobian has them."""
    del flags
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateMassMatrix failed.")
    request = GetMassMatrixRequest(robot=body.robot)
    text = "calculateMassMatrix: objPositions must be a sequence of numbers"
    # As in PyBullet, what is beyond the joints' is not read, though it be the base's that comes first.
    positions = floats(objPositions, text)[: sum(joint.width for joint in body.joints)]
    _configure(world, body, request.configuration, positions)
    answer = world.wire.call(methods.GetMassMatrix, request)
    change = _from_bullet(body, answer.columns)
    return _rows(np.transpose(change) @ _matrix(answer.matrix, answer.columns) @ change)


@formerly("bodyIndex", "bodyUniqueId")
def calculateInverseDynamics(
    bodyUniqueId: int,
    objPositions: Any,
    objVelocities: Any,
    objAccelerations: Any,
    flags: int = 0,
    physicsClientId: int = 0,
) -> tuple[float, ...]:
    """The efforts that give the joints these accelerations, under gravity and without contacts."""
    del flags
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateInverseDynamics failed.")
    text = "Error in calculateInverseDynamics, please check arguments."
    positions, velocities = floats(objPositions, text), floats(objVelocities, text)
    accelerations = floats(objAccelerations, text)
    if not body.fixed:
        raise unsupported("calculateInverseDynamics", "only for robots with a fixed base")
    if not len(positions) == len(velocities) == len(accelerations):
        raise error(text)
    request = ComputeInverseDynamicsRequest(robot=body.robot, accelerations=accelerations)
    _configure(world, body, request.configuration, positions, velocities)
    return tuple(world.wire.call(methods.ComputeInverseDynamics, request).efforts)


def _configure(
    world: World,
    body: Body,
    configuration: Configuration,
    positions: list[float],
    velocities: list[float] | None = None,
) -> None:
    """PyBullet takes a value for each joint velocity, and a free base at the origin."""
    wanted = sum(1 if joint.width == 1 else joint.width for joint in body.joints)
    if len(positions) != wanted or any(joint.width == 6 for joint in body.joints):
        raise error(f"{len(positions)} joint positions for {wanted} degrees of freedom of {body.robot}")
    configuration.positions.extend(positions)
    if velocities is not None:
        configuration.velocities.extend(velocities)
    if not body.fixed:
        _put_pose(configuration.root, inverse(body.frame(body.base_link)))


def _from_bullet(body: Body, columns: int) -> Array:
    """simd's velocities from Bullet's. Of a free base simd has the linear velocity of the root's origin,
    then the angular one; Bullet the angular one, then the linear velocity of the centre of mass."""
    change: Array = np.eye(columns)
    if not body.fixed:
        x, y, z = inverse(body.frame(body.base_link))[0]
        change[:6, :6] = 0.0
        change[0:3, 3:6] = np.eye(3)
        # The origin moves with the angular velocity about the centre: w x p.
        change[0:3, 0:3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        change[3:6, 0:3] = np.eye(3)
    return change


def _matrix(values: Iterable[float], columns: int) -> Array:
    """From rows one after the other."""
    flat = list(values)
    rows = [flat[start : start + columns] for start in range(0, len(flat), columns)]
    return np.array(rows, np.float64)


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def _put_pose(message: PoseMessage, pose: Pose) -> None:
    (x, y, z), turn = pose
    message.position.x, message.position.y, message.position.z = x, y, z
    x, y, z, w = turn
    message.orientation.x, message.orientation.y = x, y
    message.orientation.z, message.orientation.w = z, w


__all__ = [
    "applyExternalForce",
    "applyExternalTorque",
    "calculateInverseDynamics",
    "calculateJacobian",
    "calculateMassMatrix",
    "getBasePositionAndOrientation",
    "getBaseVelocity",
    "getLinkState",
    "getLinkStates",
    "resetBasePositionAndOrientation",
    "resetBaseVelocity",
]

"""Poses and velocities of links, and wrenches applied to them."""

from __future__ import annotations

from typing import Any

from simd_client.proto import (
    ApplyLinkWrenchRequest,
    RobotLinkPoses,
    RobotLinkStates,
    SetEntityStateRequest,
    WrenchFrame,
    methods,
)
from simd_client.proto import Pose as PoseMessage

from . import constants
from .arguments import ORIGIN, Pose, Vector, indices, quaternion, vector, vector_or
from .bodies import Body
from .connections import connected
from .errors import error
from .rotations import compose, cross, inverse, rotate
from .world import World


# m/s or rad/s.
_FASTEST = 1e9

def getLinkState(
    bodyUniqueId: int,
    linkIndex: int,
    computeLinkVelocity: int = 0,
    computeForwardKinematics: int = 0,
    physicsClientId: int = 0,
) -> tuple[Any, ...] | None:
    """Returns the world pose of the centre of mass, its pose in the link's frame, and the world pose of the
    link's frame. If requested, also the linear and angular velocity of the centre of mass."""
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
            at = 6 * body.link_indices[link]
            x, y, z, a, b, c = twists[at : at + 6]
            answer = (*answer, *_at_center(frame, inertia, (x, y, z), (a, b, c)))
        answers.append(answer)
    return answers


def link_pose(body: Body, states: RobotLinkPoses | RobotLinkStates, link: str) -> Pose:
    """Returns world_from_link."""
    at = 7 * body.link_indices[link]
    x, y, z, i, j, k, w = states.poses[at : at + 7]
    return (x, y, z), (i, j, k, w)


def _at_center(frame: Pose, inertia: Pose, linear: Vector, angular: Vector) -> tuple[Vector, Vector]:
    """Returns velocities of the centre of mass, from those of the link's origin."""
    dx, dy, dz = cross(angular, rotate(frame[1], inertia[0]))
    return (linear[0] + dx, linear[1] + dy, linear[2] + dz), angular


def getBasePositionAndOrientation(bodyUniqueId: int, physicsClientId: int = 0) -> Pose:
    """Returns the world pose of the root link's centre of mass and axes of inertia."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "GetBasePositionAndOrientation failed.")
    return compose(world.root(body)[0], body.frame(body.base_link))


def getBaseVelocity(bodyUniqueId: int, physicsClientId: int = 0) -> tuple[Vector, Vector]:
    """Returns the linear velocity of the root link's centre of mass, and the angular velocity, world axes."""
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
    put_pose(request.pose, compose(center, inverse(body.frame(body.base_link))))
    if not body.fixed:
        request.twist.SetInParent()
    world.wire.call(methods.SetEntityState, request)
    world.forget_states()


def _bounded(velocity: Vector) -> Vector:
    """Clamps a velocity to the daemon's maximum."""
    x, y, z = (max(-_FASTEST, min(each, _FASTEST)) for each in velocity)
    return x, y, z


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
        linear = _bounded(vector_or(ORIGIN, linearVelocity, "linearVelocity"))
    if angularVelocity is not None:
        angular = _bounded(vector_or(ORIGIN, angularVelocity, "angularVelocity"))
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
    """Applies a force to a link for the next step. It is in world axes at a world position, or in the axes of
    the link's inertia, relative to its centre of mass."""
    text = "force and position need 3 coordinates [x,y,z]."
    force, position = vector(forceObj, text), vector(posObj, text)
    _apply_wrench(physicsClientId, objectUniqueId, linkIndex, force, None, position, flags)


def applyExternalTorque(
    objectUniqueId: int, linkIndex: int, torqueObj: Any, flags: int, physicsClientId: int = 0
) -> None:
    """Applies a torque to a link for the next step, in world axes or in those of the link's inertia."""
    torque = vector(torqueObj, "torque needs 3 coordinates [x,y,z].")
    _apply_wrench(physicsClientId, objectUniqueId, linkIndex, None, torque, None, flags)


def _apply_wrench(
    client: int,
    unique_id: int,
    index: int,
    force: Vector | None,
    torque: Vector | None,
    position: Vector | None,
    flags: int,
) -> None:
    if flags not in (constants.WORLD_FRAME, constants.LINK_FRAME):
        raise error("flags must be WORLD_FRAME or LINK_FRAME")
    world = connected(client)
    body = world.body(unique_id, "there is no such body")
    link = body.link_name(index)
    if link is None:
        # PyBullet accepts it, and applies nothing.
        world.say_once(f"a force on link {index} of body {unique_id}, which it does not have, does nothing")
        return
    inertia = body.frame(link)
    request = ApplyLinkWrenchRequest(robot=body.robot, link=link)
    if flags == constants.LINK_FRAME:
        request.frame = WrenchFrame.WRENCH_FRAME_LINK
        turn = inertia[1]
        point = compose(inertia, (position, turn))[0] if position is not None else None
    else:
        request.frame = WrenchFrame.WRENCH_FRAME_WORLD
        turn = (0.0, 0.0, 0.0, 1.0)
        point = None
        if position is not None:
            frame = link_pose(body, world.link_poses(body), link)
            point = compose(inverse(frame), (position, turn))[0]
    if force is not None:
        wire = request.wrench.force
        wire.x, wire.y, wire.z = rotate(turn, force)
    if torque is not None:
        wire = request.wrench.torque
        wire.x, wire.y, wire.z = rotate(turn, torque)
    if point is not None:
        request.point.x, request.point.y, request.point.z = point
    world.apply_wrench(request)


def put_pose(message: PoseMessage, pose: Pose) -> None:
    """Sets a message."""
    (x, y, z), turn = pose
    message.position.x, message.position.y, message.position.z = x, y, z
    x, y, z, w = turn
    message.orientation.x, message.orientation.y = x, y
    message.orientation.z, message.orientation.w = z, w


__all__ = [
    "applyExternalForce",
    "applyExternalTorque",
    "getBasePositionAndOrientation",
    "getBaseVelocity",
    "getLinkState",
    "getLinkStates",
    "resetBasePositionAndOrientation",
    "resetBaseVelocity",
]

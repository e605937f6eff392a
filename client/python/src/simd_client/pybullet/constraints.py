"""createConstraint: a base fixed to the world, and gears between two joints of a robot."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import Any

from simd_client.proto import SetEntityStateRequest, methods

from . import constants, descriptions
from .arguments import Pose, Vector, quaternion, vector
from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .respawn import respawn
from .rotations import compose, inverse
from .world import World

_WHICH = "JOINT_FIXED between a robot's base and the world, and JOINT_GEAR between two joints of a robot only"


@dataclass
class Constraint:
    """One that a script made."""

    kind: int
    body: int
    parent_link: int
    child: int
    child_link: int
    axis: Vector
    # inertia_from_constraint of the body, world_from_constraint on the world's.
    parent_frame: Pose
    child_frame: Pose
    force: float = 500.0
    ratio: float = 0.0
    offset: float = 0.0


def createConstraint(
    parentBodyUniqueId: int,
    parentLinkIndex: int,
    childBodyUniqueId: int,
    childLinkIndex: int,
    jointType: int,
    jointAxis: Any,
    parentFramePosition: Any,
    childFramePosition: Any,
    parentFrameOrientation: Any = (0.0, 0.0, 0.0, 1.0),
    childFrameOrientation: Any = (0.0, 0.0, 0.0, 1.0),
    physicsClientId: int = 0,
) -> int:
    """Fixes a base to the world, at the child's frame, or makes a gear (see changeConstraint for its
    ratio). Returns the number of the constraint."""
    world = connected(physicsClientId)
    body = world.body(parentBodyUniqueId, "createConstraint failed.")
    text = "createConstraint: positions need 3 numbers, orientations 4"
    made = Constraint(
        kind=jointType,
        body=parentBodyUniqueId,
        parent_link=parentLinkIndex,
        child=childBodyUniqueId,
        child_link=childLinkIndex,
        axis=vector(jointAxis, text),
        parent_frame=(vector(parentFramePosition, text), quaternion(parentFrameOrientation, text)),
        child_frame=(vector(childFramePosition, text), quaternion(childFrameOrientation, text)),
    )
    if jointType == constants.JOINT_FIXED and childBodyUniqueId < 0 and parentLinkIndex == -1:
        _hold(world, body, made)
    elif jointType == constants.JOINT_GEAR and childBodyUniqueId == parentBodyUniqueId:
        for index in (parentLinkIndex, childLinkIndex):
            if not 0 <= index < len(body.joints) or body.joints[index].width != 1:
                raise error(f"createConstraint: joint {index} of {body.robot} neither turns nor slides")
    else:
        raise unsupported("createConstraint", _WHICH)
    number = world.next_constraint
    world.next_constraint += 1
    world.constraints[number] = made
    return number


def changeConstraint(
    userConstraintUniqueId: int,
    jointChildPivot: Any = None,
    jointChildFrameOrientation: Any = None,
    maxForce: float | None = None,
    gearRatio: float | None = None,
    gearAuxLink: int | None = None,
    relativePositionTarget: float | None = None,
    erp: float | None = None,
    physicsClientId: int = 0,
) -> None:
    """Moves a fixed base, or sets the ratio of a gear. Both are exact: no force limits them."""
    del erp, gearAuxLink
    world = connected(physicsClientId)
    constraint = _there(world, userConstraintUniqueId)
    if maxForce is not None:
        constraint.force = float(maxForce)
    text = "changeConstraint: a pivot needs 3 numbers, an orientation 4"
    if constraint.kind == constants.JOINT_FIXED:
        position, orientation = constraint.child_frame
        if jointChildPivot is not None:
            position = vector(jointChildPivot, text)
        if jointChildFrameOrientation is not None:
            orientation = quaternion(jointChildFrameOrientation, text)
        constraint.child_frame = (position, orientation)
        _place(world, world.body(constraint.body, "changeConstraint failed"), constraint)
    elif gearRatio is not None or relativePositionTarget is not None:
        constraint.ratio = constraint.ratio if gearRatio is None else float(gearRatio)
        if relativePositionTarget is not None:
            constraint.offset = float(relativePositionTarget)
        _gear(world, world.body(constraint.body, "changeConstraint failed"), constraint)


def removeConstraint(userConstraintUniqueId: int, physicsClientId: int = 0) -> None:
    """Frees a fixed base, or removes a gear."""
    world = connected(physicsClientId)
    constraint = world.constraints.pop(userConstraintUniqueId, None)
    body = world.bodies.get(constraint.body) if constraint is not None else None
    if constraint is None or body is None:
        return
    if constraint.kind == constants.JOINT_FIXED:
        respawn(world, body, "removeConstraint", fixed=False, pose=world.root(body)[0])
    elif constraint.ratio:
        _edit_mimic(world, body, constraint, None)


def getNumConstraints(physicsClientId: int = 0) -> int:
    """The number of constraints that the script made."""
    return len(connected(physicsClientId).constraints)


def getConstraintUniqueId(serialIndex: int, physicsClientId: int = 0) -> int:
    """The number of the constraint at that index; -1 beyond the last."""
    numbers = sorted(connected(physicsClientId).constraints)
    return numbers[serialIndex] if 0 <= serialIndex < len(numbers) else -1


def getConstraintInfo(constraintUniqueId: int, physicsClientId: int = 0) -> tuple[Any, ...]:
    """Bodies, links, kind, axis, pivots, frames, force, gear ratio, auxiliary link, offset, erp."""
    c = connected(physicsClientId).constraints.get(constraintUniqueId)
    if c is None:
        raise error("Couldn't get user constraint info")
    head = (c.body, c.parent_link, c.child, c.child_link, c.kind, c.axis)
    frames = (c.parent_frame[0], c.child_frame[0], c.parent_frame[1], c.child_frame[1])
    return (*head, *frames, c.force, c.ratio, -1, c.offset, 0.0)


def getConstraintState(constraintUniqueId: int, physicsClientId: int = 0) -> tuple[float, ...]:
    """Raises: the daemon does not report the forces of constraints."""
    _there(connected(physicsClientId), constraintUniqueId)
    raise unsupported("getConstraintState", "the daemon does not report the forces of constraints")


def _there(world: World, number: int) -> Constraint:
    found = world.constraints.get(number)
    if found is None:
        raise error("Couldn't find a user constraint of that number")
    return found


def held(world: World, body: Body) -> bool:
    """Whether a constraint fixes the base to the world."""
    return any(
        each.body == body.unique_id and each.kind == constants.JOINT_FIXED for each in world.constraints.values()
    )


def _held_at(body: Body, constraint: Constraint) -> Pose:
    """world_from_root, so that the frame on the body is the frame in the world."""
    root_from_constraint = compose(body.frame(body.base_link), constraint.parent_frame)
    return compose(constraint.child_frame, inverse(root_from_constraint))


def _hold(world: World, body: Body, constraint: Constraint) -> None:
    if body.fixed:
        _place(world, body, constraint)
    else:
        respawn(world, body, "createConstraint", fixed=True, pose=_held_at(body, constraint))


def _place(world: World, body: Body, constraint: Constraint) -> None:
    (x, y, z), (a, b, c, d) = _held_at(body, constraint)
    request = SetEntityStateRequest(robot=body.robot)
    at, turn = request.pose.position, request.pose.orientation
    at.x, at.y, at.z = x, y, z
    turn.x, turn.y, turn.z, turn.w = a, b, c, d
    world.wire.call(methods.SetEntityState, request)
    world.forget_states()


def _gear(world: World, body: Body, constraint: Constraint) -> None:
    """Bullet's gear keeps velocity + ratio * other velocity = 0: one joint mimics the other."""
    states = world.joint_states(body)
    own, other = (body.joints[i] for i in (constraint.parent_link, constraint.child_link))
    at = states.position[own.position_index] + constraint.ratio * states.position[other.position_index]
    mimic = ElementTree.Element(
        "mimic", joint=other.name, multiplier=repr(-constraint.ratio), offset=repr(at + constraint.offset)
    )
    _edit_mimic(world, body, constraint, mimic)


def _edit_mimic(world: World, body: Body, constraint: Constraint, mimic: ElementTree.Element | None) -> None:
    robot = None if body.urdf is None else descriptions.parse(body.urdf)
    if robot is None:
        raise unsupported("createConstraint", "gears are for robots that this script loaded")
    name = body.joints[constraint.parent_link].name
    for joint in robot.iter("joint"):
        if joint.get("name") == name:
            for old in joint.findall("mimic"):
                joint.remove(old)
            if mimic is not None:
                joint.append(mimic)
    text = ElementTree.tostring(robot)
    entity = world.wire.reload(body.robot, text, body.files)
    world.replaced(body, entity, body.frames, text)
    world.retune()


__all__ = [
    "changeConstraint",
    "createConstraint",
    "getConstraintInfo",
    "getConstraintState",
    "getConstraintUniqueId",
    "getNumConstraints",
    "removeConstraint",
]

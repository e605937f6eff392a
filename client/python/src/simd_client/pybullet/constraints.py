"""createConstraint and related functions: the daemon's constraints, with PyBullet's numbers and units."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from simd_client import proto
from simd_client.proto import methods

from . import constants
from .arguments import ORIGIN, UPRIGHT, Pose, Vector, quaternion_or, vector_or
from .bodies import Body
from .connections import connected
from .errors import error
from .kinematics import link_pose
from .rotations import compose, cross, rotate
from .world import World

_KINDS = {
    constants.JOINT_FIXED: proto.ConstraintKind.CONSTRAINT_KIND_WELD,
    constants.JOINT_POINT2POINT: proto.ConstraintKind.CONSTRAINT_KIND_POINT_TO_POINT,
    constants.JOINT_PRISMATIC: proto.ConstraintKind.CONSTRAINT_KIND_SLIDE,
    constants.JOINT_GEAR: proto.ConstraintKind.CONSTRAINT_KIND_GEAR,
}


@dataclass
class Constraint:
    """A constraint of the script."""

    kind: int
    body: int
    parent_link: int
    child: int
    child_link: int
    axis: Vector
    # inertia_from_constraint of the body; the same for the child, or world_from_constraint.
    parent_frame: Pose
    child_frame: Pose
    force: float = 500.0
    ratio: float = 0.0
    aux_link: int = 0
    offset: float = 0.0
    erp: float = 0.0
    # The daemon's name; empty if none of its links can move.
    name: str = ""


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
    """Holds a link to another one, or with -1 for the child to the world. Frames are relative to the centers
    of mass. Returns the number of the constraint."""
    world = connected(physicsClientId)
    body = world.body(parentBodyUniqueId, "createConstraint failed.")
    made = Constraint(
        kind=jointType,
        body=parentBodyUniqueId,
        parent_link=parentLinkIndex,
        child=childBodyUniqueId,
        child_link=childLinkIndex,
        axis=vector_or(ORIGIN, jointAxis, "jointAxis"),
        parent_frame=_given("parentFrame", parentFramePosition, parentFrameOrientation),
        child_frame=_given("childFrame", childFramePosition, childFrameOrientation),
    )
    if jointType not in _KINDS:
        # PyBullet has no others either.
        raise error("createConstraint failed.")
    other = None
    if childBodyUniqueId >= 0:
        other = world.body(childBodyUniqueId, "createConstraint failed.")
    if body.link_name(parentLinkIndex) is None or (other is not None and other.link_name(childLinkIndex) is None):
        raise error("createConstraint failed: there is no such link.")
    if jointType == constants.JOINT_GEAR and other is None:
        raise error("createConstraint failed: a gear needs a child body.")
    if jointType == constants.JOINT_PRISMATIC and made.axis == ORIGIN:
        # A slide along no axis holds like a weld.
        weld = replace(made, kind=constants.JOINT_FIXED)
        _make(world, body, other, weld)
        made.name = weld.name
    elif jointType == constants.JOINT_GEAR and not _has_gear(body, parentLinkIndex, other, childLinkIndex):
        world.say_once("createConstraint: a gear with a joint that neither turns nor slides holds nothing")
    elif jointType == constants.JOINT_GEAR:
        _make_gear(world, body, other, made)
    else:
        _make(world, body, other, made)
    number = world.next_constraint
    world.next_constraint += 1
    world.constraints[number] = made
    return number


def _given(name: str, position: Any, orientation: Any) -> Pose:
    return vector_or(ORIGIN, position, f"{name}Position"), quaternion_or(UPRIGHT, orientation, f"{name}Orientation")


def _has_gear(body: Body, link: int, other: Body | None, child: int) -> bool:
    """Whether both links have parent joints of one axis."""
    ends = ((body, link), (other or body, child))
    return all(0 <= index < len(end.joints) and end.joints[index].width == 1 for end, index in ends)


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
    """Moves the frame on the child, or sets the maximum force, or the ratio of a gear. `gearAuxLink` and
    `erp` have no effect. As in PyBullet, a ratio of 0 and negative values of `maxForce`, `gearAuxLink` and
    `erp` are ignored."""
    world = connected(physicsClientId)
    found = world.constraints.get(userConstraintUniqueId)
    if found is None:
        return
    # A refusal of the daemon changes nothing.
    made = replace(found)
    request = proto.ChangeConstraintRequest(name=made.name)
    if jointChildPivot is not None or jointChildFrameOrientation is not None:
        position, orientation = made.child_frame
        made.child_frame = (
            vector_or(position, jointChildPivot, "jointChildPivot"),
            quaternion_or(orientation, jointChildFrameOrientation, "jointChildFrameOrientation"),
        )
        if made.kind != constants.JOINT_GEAR:
            body = world.bodies.get(made.child)
            request.child_pose.CopyFrom(_pose(_frame(body, made.child_link, made.child_frame)))
    if maxForce is not None and maxForce >= 0:
        made.force = request.max_force = request.max_torque = float(maxForce)
    made.ratio = float(gearRatio) if gearRatio else made.ratio
    if relativePositionTarget is not None:
        made.offset = float(relativePositionTarget)
    if made.name and made.kind == constants.JOINT_GEAR and (gearRatio or relativePositionTarget is not None):
        request.ratio = -(made.ratio or 1.0)
        request.offset = gear_position(world, made) + made.offset
    if gearAuxLink is not None and gearAuxLink >= 0:
        made.aux_link = int(gearAuxLink)
    if erp is not None and erp >= 0:
        made.erp = float(erp)
    if made.name:
        world.wire.call(methods.ChangeConstraint, request)
    world.constraints[userConstraintUniqueId] = made


def removeConstraint(userConstraintUniqueId: int, physicsClientId: int = 0) -> None:
    """Releases two links."""
    world = connected(physicsClientId)
    made = world.forget_constraint(userConstraintUniqueId)
    if made is not None and made.name and _reading(world, made) is not None:
        world.wire.call(methods.DeleteConstraint, proto.DeleteConstraintRequest(name=made.name))


def getNumConstraints(physicsClientId: int = 0) -> int:
    """Returns the number of the script's constraints."""
    return len(connected(physicsClientId).constraints)


def getConstraintUniqueId(serialIndex: int, physicsClientId: int = 0) -> int:
    """Returns the number of the constraint at that index; -1 beyond the last."""
    numbers = list(connected(physicsClientId).constraints)
    return numbers[serialIndex] if 0 <= serialIndex < len(numbers) else -1


def getConstraintInfo(constraintUniqueId: int, physicsClientId: int = 0) -> tuple[Any, ...]:
    """Returns bodies, links, kind, axis, pivots, frames, force, gear ratio, auxiliary link, offset, erp."""
    c = connected(physicsClientId).constraints.get(constraintUniqueId)
    if c is None:
        raise error("Couldn't get user constraint info")
    head = (c.body, c.parent_link, c.child, c.child_link, c.kind, c.axis)
    frames = (c.parent_frame[0], c.child_frame[0], c.parent_frame[1], c.child_frame[1])
    return (*head, *frames, c.force, c.ratio, c.aux_link, c.offset, c.erp)


def getConstraintState(constraintUniqueId: int, physicsClientId: int = 0) -> tuple[float, ...]:
    """Returns the constraint's forces over the last step, with PyBullet's signs. JOINT_FIXED: force and
    torque on the parent, world axes. JOINT_POINT2POINT: force on the child. JOINT_PRISMATIC: two forces
    across the axis and the torque, z x y, on the parent. JOINT_GEAR: the size of the effort on the parent's
    joint."""
    world = connected(physicsClientId)
    made = world.constraints.get(constraintUniqueId)
    if made is None:
        raise error("Couldn't getConstraintState.")
    reading = _reading(world, made) or proto.Constraint()
    force = (reading.force.x, reading.force.y, reading.force.z)
    torque = (-reading.torque.x, -reading.torque.y, -reading.torque.z)
    if made.kind == constants.JOINT_GEAR:
        return (_dot(force, force) ** 0.5 + _dot(torque, torque) ** 0.5,)
    if made.kind == constants.JOINT_POINT2POINT:
        return force
    x, y, z = force
    if made.kind == constants.JOINT_FIXED:
        return (-x, -y, -z, *torque)
    first, second = _across(world, made)
    return (-_dot(force, first), -_dot(force, second), torque[2], torque[0], torque[1])


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _across(world: World, made: Constraint) -> tuple[Vector, Vector]:
    """Returns the axes of a slider's two forces in the world. The second is the first of x and y that is not
    along the axis, projected across it."""
    _, turn = _frame(None, -1, made.child_frame)
    if made.child >= 0:
        body = world.body(made.child, "getConstraintState failed")
        pose = link_pose(body, world.link_poses(body), body.link_name(made.child_link) or "")
        turn = compose(pose, _frame(body, made.child_link, made.child_frame))[1]
    axis = rotate(turn, made.axis)
    length = _dot(axis, axis) ** 0.5 or 1.0
    x, y, z = axis = (axis[0] / length, axis[1] / length, axis[2] / length)
    second = (1 - x * x, -x * y, -x * z) if abs(x) < 0.9 else (-x * y, 1 - y * y, -y * z)
    size = _dot(second, second) ** 0.5
    second = (second[0] / size, second[1] / size, second[2] / size)
    return cross(second, axis), second


def _frame(body: Body | None, link: int, frame: Pose) -> Pose:
    """Returns link_from_constraint, from inertia_from_constraint; for the world unchanged."""
    if body is None:
        return frame
    return compose(body.frame(body.link_name(link) or ""), frame)


def _pose(pose: Pose) -> proto.Pose:
    (x, y, z), (a, b, c, d) = pose
    turn = proto.Quaternion(x=a, y=b, z=c, w=d)
    return proto.Pose(position=proto.Vector3(x=x, y=y, z=z), orientation=turn)


def _end(body: Body | None, link: int, frame: Pose) -> proto.ConstraintEnd:
    pose = _pose(_frame(body, link, frame))
    if body is None:
        return proto.ConstraintEnd(pose=pose)
    name = body.link_name(link)
    if name is None:
        raise error(f"createConstraint: {body.robot} has no link {link}")
    return proto.ConstraintEnd(robot=body.robot, link=name, pose=pose)


def _make(world: World, body: Body, other: Body | None, made: Constraint) -> None:
    request = proto.CreateConstraintRequest(
        name=world.constraint_name(),
        kind=_KINDS[made.kind],
        parent=_end(body, made.parent_link, made.parent_frame),
        child=_end(other, made.child_link, made.child_frame),
    )
    if made.kind == constants.JOINT_PRISMATIC:
        x, y, z = made.axis
        request.axis.CopyFrom(proto.Vector3(x=x, y=y, z=z))
    is_still = (body.fixed and made.parent_link == -1) and (
        other is None or (other.fixed and made.child_link == -1)
    )
    if not is_still:
        made.name = world.wire.call(methods.CreateConstraint, request).name


def _make_gear(world: World, body: Body, other: Body | None, made: Constraint) -> None:
    """Bullet's gear keeps velocity + ratio * the child's velocity = 0. Its ratio is 1 until it is changed,
    although getConstraintInfo then returns 0."""
    ends: list[proto.ConstraintEnd] = []
    for each, index in ((other, made.child_link), (body, made.parent_link)):
        if each is None or not 0 <= index < len(each.joints) or each.joints[index].width != 1:
            robot = "the world" if each is None else each.robot
            raise error(f"createConstraint: joint {index} of {robot} neither turns nor slides")
        ends.append(proto.ConstraintEnd(robot=each.robot, joint=each.joints[index].name))
    request = proto.CreateConstraintRequest(
        name=world.constraint_name(), kind=_KINDS[made.kind], parent=ends[0], child=ends[1], ratio=-1.0
    )
    made.name = world.wire.call(methods.CreateConstraint, request).name


def gear_position(world: World, made: Constraint) -> float:
    """Returns the invariant of the gear, at the joints' current positions."""
    total = 0.0
    for number, index, factor in ((made.body, made.parent_link, 1.0), (made.child, made.child_link, made.ratio or 1.0)):
        body = world.body(number, "changeConstraint failed")
        total += factor * world.joint_states(body).position[body.joints[index].position_index]
    return total


def _reading(world: World, made: Constraint) -> proto.Constraint | None:
    """Returns the daemon's constraint; `None` if it was deleted with a robot."""
    answer = world.wire.call(methods.ListConstraints, proto.ListConstraintsRequest())
    return next((each for each in answer.constraints if each.name == made.name), None)


__all__ = [
    "changeConstraint",
    "createConstraint",
    "getConstraintInfo",
    "getConstraintState",
    "getConstraintUniqueId",
    "getNumConstraints",
    "removeConstraint",
]

"""Contact points and ray casts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from simd_client.proto import (
    BoxGeometry,
    CapsuleGeometry,
    CastRaysRequest,
    ClosestPoints,
    Contact,
    CylinderGeometry,
    GetClosestPointsRequest,
    QueryBody,
    QueryShape,
    RayHit,
    SphereGeometry,
    Vector3,
    methods,
)

from . import constants, shapes
from .arguments import ORIGIN, Pose, Vector, vector
from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .kinematics import link_pose
from .primitives import Primitive
from .rotations import compose, cross
from .world import World

# Maximum number of rays in one request.
_MAX_RAYS = 20_000
# Any link, in place of a link's number; -1 is the base.
_ANY = -2
_MISS = (-1, -1, 1.0, ORIGIN, ORIGIN)


def getContactPoints(
    bodyA: int = -1,
    bodyB: int = -1,
    linkIndexA: int = _ANY,
    linkIndexB: int = _ANY,
    physicsClientId: int = 0,
) -> tuple[tuple[Any, ...], ...]:
    """Returns the contact points of the last step, 14 values each: see docs/pybullet.md."""
    world = connected(physicsClientId)
    asked = max(bodyA, bodyB)
    if asked >= 0 and asked not in world.bodies:
        return ()
    if world.is_detected:
        touching = _touching(world, bodyA, bodyB)
        return tuple(row for row in touching if linkIndexA in (_ANY, row[3]) and linkIndexB in (_ANY, row[4]))
    numbers = world.numbers()
    found: list[tuple[Any, ...]] = []
    for contact in world.contacts():
        a = numbers.get((contact.robot_a, contact.link_a))
        b = numbers.get((contact.robot_b, contact.link_b))
        if a is None or b is None:
            # Another client added this robot since: syncBodyInfo adds it.
            continue
        if _asked(a, bodyA, linkIndexA) and _asked(b, bodyB, linkIndexB):
            found.append(_reported(contact, a, b, 1.0))
        elif _asked(b, bodyA, linkIndexA) and _asked(a, bodyB, linkIndexB):
            found.append(_reported(contact, b, a, -1.0))
    return tuple(found)


def _asked(end: tuple[int, int], body: int, link: int) -> bool:
    return body in (-1, end[0]) and link in (_ANY, end[1])


def _reported(contact: Contact, a: tuple[int, int], b: tuple[int, int], sign: float) -> tuple[Any, ...]:
    """Converts a contact. PyBullet's normal points from B to A, the daemon's from its first robot to its
    second; `sign` is -1 if the two are swapped. Forces act on A."""
    n, p, f, depth = contact.normal, contact.point, contact.friction_force, contact.depth
    x, y, z = normal = (-sign * n.x, -sign * n.y, -sign * n.z)
    half = depth / 2.0
    u, v, w = p.x, p.y, p.z
    dx, dy, dz = x * half, y * half, z * half
    rub, across, along = _friction((-sign * f.x, -sign * f.y, -sign * f.z), normal)
    on_a, on_b = (u - dx, v - dy, w - dz), (u + dx, v + dy, w + dz)
    return (0, a[0], b[0], a[1], b[1], on_a, on_b, normal, -depth, contact.normal_force, rub, across, 0.0, along)


def _friction(force: Vector, normal: Vector) -> tuple[float, Vector, Vector]:
    """All of it along one direction, and the direction across without any."""
    x, y, z = force
    size = length = math.sqrt(x * x + y * y + z * z)
    if size == 0.0:
        # Any direction in the plane of the contact.
        x, y, z = cross(normal, (1.0, 0.0, 0.0) if abs(normal[0]) < 0.9 else (0.0, 1.0, 0.0))
        length = math.sqrt(x * x + y * y + z * z) or 1.0
    unit = (x / length, y / length, z / length)
    return size, unit, cross(normal, unit)


def getClosestPoints(
    bodyA: int,
    bodyB: int,
    distance: float,
    linkIndexA: int = _ANY,
    linkIndexB: int = _ANY,
    collisionShapeA: int = -1,
    collisionShapeB: int = -1,
    collisionShapePositionA: Any = None,
    collisionShapePositionB: Any = None,
    collisionShapeOrientationA: Any = None,
    collisionShapeOrientationB: Any = None,
    physicsClientId: int = 0,
) -> tuple[tuple[Any, ...], ...]:
    """Returns the nearest points of each pair of links within a distance, in the form of `getContactPoints`
    with forces of zero. A shape of createCollisionShape can replace or accompany a body. As in PyBullet it is
    link -2, and a shape of several parts has a point for each."""
    world = connected(physicsClientId)
    poses = [
        shapes.pose(position, orientation)
        for position, orientation in (
            (collisionShapePositionA, collisionShapeOrientationA),
            (collisionShapePositionB, collisionShapeOrientationB),
        )
    ]
    first = [*_loose(world, collisionShapeA, poses[0]), *_side(world, bodyA, linkIndexA)]
    second = [*_loose(world, collisionShapeB, poses[1]), *_side(world, bodyB, linkIndexB)]
    numbers = world.numbers()
    # As in PyBullet, a shape has the number of the body next to it.
    loose_a, loose_b = (bodyA, _ANY), (bodyB, _ANY)
    found: list[tuple[Any, ...]] = []
    for a, b in ((a, b) for a in first for b in second):
        request = GetClosestPointsRequest(a=a, b=b, max_distance=distance)
        for pair in world.wire.call(methods.GetClosestPoints, request).pairs:
            on_a = numbers.get((pair.robot_a, pair.link_a)) if pair.robot_a else loose_a
            on_b = numbers.get((pair.robot_b, pair.link_b)) if pair.robot_b else loose_b
            if on_a is None or on_b is None:
                continue
            found.append(_near(pair, on_a, on_b, swapped=False))
            if a.robot and a.robot == b.robot and a.link == b.link:
                # As in PyBullet, each of the two is A once.
                found.append(_near(pair, on_b, on_a, swapped=True))
    return tuple(sorted(found, key=lambda row: (row[3], row[4])))


def _side(world: World, number: int, link: int) -> list[QueryBody]:
    """Returns a body or a link of it; nothing if it does not exist."""
    body = world.bodies.get(number)
    if body is None:
        return []
    name = "" if link == _ANY else body.link_name(link)
    return [] if name is None else [QueryBody(robot=body.robot, link=name)]


def _loose(world: World, number: int, pose: Pose) -> list[QueryBody]:
    """Returns a shape that belongs to no body, a part for each of its parts."""
    sides: list[QueryBody] = []
    for part in world.collision_shapes.get(number):
        side = QueryBody(shape=_query_shape(part))
        (x, y, z), (i, j, k, w) = compose(pose, part.pose)
        at, turn = side.pose.position, side.pose.orientation
        at.x, at.y, at.z = x, y, z
        turn.x, turn.y, turn.z, turn.w = i, j, k, w
        sides.append(side)
    return sides


def _query_shape(part: Primitive) -> QueryShape:
    if part.kind == constants.GEOM_BOX:
        x, y, z = part.size
        return QueryShape(box=BoxGeometry(size=Vector3(x=x, y=y, z=z)))
    if part.kind == constants.GEOM_SPHERE:
        return QueryShape(sphere=SphereGeometry(radius=part.size[0]))
    if part.kind == constants.GEOM_CYLINDER:
        return QueryShape(cylinder=CylinderGeometry(radius=part.size[0], length=part.size[1]))
    if part.kind == constants.GEOM_CAPSULE:
        return QueryShape(capsule=CapsuleGeometry(radius=part.size[0], length=part.size[1]))
    raise unsupported("getClosestPoints", "the daemon measures to meshes of bodies, and not to those of no body: make one with createMultiBody")


def _near(pair: ClosestPoints, a: tuple[int, int], b: tuple[int, int], swapped: bool) -> tuple[Any, ...]:
    """PyBullet's normal points from B to A."""
    on_a, on_b = (pair.point_b, pair.point_a) if swapped else (pair.point_a, pair.point_b)
    sign, n = (1.0 if swapped else -1.0), pair.normal
    normal = (sign * n.x, sign * n.y, sign * n.z)
    points = ((on_a.x, on_a.y, on_a.z), (on_b.x, on_b.y, on_b.z))
    return (0, a[0], b[0], a[1], b[1], *points, normal, pair.distance, 0.0, 0.0, ORIGIN, 0.0, ORIGIN)


def performCollisionDetection(physicsClientId: int = 0) -> None:
    """Refreshes contacts after something was moved since the last step. `getContactPoints` then has the
    current contacts, without forces: the deepest point of each pair of links."""
    connected(physicsClientId).detect()


def _touching(world: World, first: int, second: int) -> list[tuple[Any, ...]]:
    """Returns the deepest points of touching links, of all pairs of bodies, or of those of one or two, which
    are A."""
    bodies = list(world.bodies)
    found: list[tuple[Any, ...]] = []
    for at, a in enumerate(bodies):
        for b in bodies[at:]:
            asked = {number for number in (first, second) if number >= 0}
            if not asked <= {a, b} or (a == b and not world.bodies[a].self_collision):
                continue
            one, other = (b, a) if first == b or second == a else (a, b)
            for row in getClosestPoints(one, other, 0.0, physicsClientId=world.number):
                if row[8] <= 0.0 and world.pairs.get(_pair(row), True):
                    found.append(row)
    return found


def _pair(row: tuple[Any, ...]) -> tuple[tuple[int, int], tuple[int, int]]:
    a, b = sorted(((row[1], row[3]), (row[2], row[4])))
    return a, b


def rayTest(
    rayFromPosition: Any,
    rayToPosition: Any,
    collisionFilterMask: int = -1,
    reportHitNumber: int = -1,
    physicsClientId: int = 0,
) -> tuple[tuple[Any, ...], ...]:
    """Returns the first hit of a ray: body, link, fraction of its length, position, normal."""
    del reportHitNumber
    return rayTestBatch(
        [rayFromPosition], [rayToPosition], collisionFilterMask=collisionFilterMask, physicsClientId=physicsClientId
    )


def rayTestBatch(
    rayFromPositions: Any,
    rayToPositions: Any,
    numThreads: int = 1,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    reportHitNumber: int = -1,
    collisionFilterMask: int = -1,
    fractionEpsilon: float = 0.0,
    physicsClientId: int = 0,
) -> tuple[tuple[Any, ...], ...]:
    """Casts many rays like `rayTest`, in world axes, or relative to a link's centre of mass in the axes of
    its inertia. Two arrays of three numbers are one ray."""
    del numThreads, reportHitNumber, fractionEpsilon
    mask = None if collisionFilterMask == -1 else int(collisionFilterMask) & 0xFFFFFFFF
    world = connected(physicsClientId)
    rayFromPositions, rayToPositions = _of_one(rayFromPositions), _of_one(rayToPositions)
    if len(rayFromPositions) != len(rayToPositions):
        raise error("Size of from_positions need to be equal to size of to_positions.")
    frame = _frame(world, parentObjectUniqueId, parentLinkIndex)
    numbers = world.numbers()
    answers: list[tuple[Any, ...]] = []
    for start in range(0, len(rayFromPositions), _MAX_RAYS):
        request = CastRaysRequest(collision_mask=mask)
        part = slice(start, start + _MAX_RAYS)
        for begin, end in zip(rayFromPositions[part], rayToPositions[part], strict=True):
            ray = request.rays.add()
            for wire, point in ((getattr(ray, "from"), begin), (ray.to, end)):
                wire.x, wire.y, wire.z = _placed(frame, vector(point, "a ray's ends need 3 numbers each"))
        hits = world.wire.call(methods.CastRays, request).hits
        answers.extend(_hit(hit, numbers) for hit in hits)
    return tuple(answers)


def _of_one(ends: Any) -> Any:
    """Returns the ends of several rays. As in PyBullet, an array of three numbers is one end, and a list of
    three numbers is not."""
    return [ends] if getattr(ends, "shape", None) == (3,) else ends


def _frame(world: World, number: int, link: int) -> Pose | None:
    """Returns world_from_inertia of the link that is the rays' frame."""
    if number < 0:
        return None
    body: Body = world.body(number, "there is no such body")
    name = body.link_name(link)
    if name is None:
        raise error("Link index out-of-range.")
    return compose(link_pose(body, world.link_poses(body), name), body.frame(name))


def _placed(frame: Pose | None, point: Vector) -> Vector:
    return point if frame is None else compose(frame, (point, (0.0, 0.0, 0.0, 1.0)))[0]


def _hit(hit: RayHit, numbers: Mapping[tuple[str, str], tuple[int, int]]) -> tuple[Any, ...]:
    if not hit.hit:
        return _MISS
    body, link = numbers.get((hit.robot, hit.link), (-1, -1))
    point, normal = hit.point, hit.normal
    return (body, link, hit.fraction, (point.x, point.y, point.z), (normal.x, normal.y, normal.z))


__all__ = ["getClosestPoints", "getContactPoints", "performCollisionDetection", "rayTest", "rayTestBatch"]

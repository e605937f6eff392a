"""Contact points and ray casts."""

from __future__ import annotations

import math
from typing import Any

from simd_client.proto import (
    CastRaysRequest,
    ClosestPoints,
    Contact,
    GetClosestPointsRequest,
    GetContactsRequest,
    QueryBody,
    RayHit,
    methods,
)

from .arguments import ORIGIN, Pose, Vector, vector
from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .kinematics import link_pose
from .rotations import compose, cross
from .world import World

# The most rays in one request.
_MOST_RAYS = 20_000
# Any link, where a link's number is asked for; -1 is the base.
_ANY = -2
_MISS = (-1, -1, 1.0, ORIGIN, ORIGIN)


def getContactPoints(
    bodyA: int = -1,
    bodyB: int = -1,
    linkIndexA: int = _ANY,
    linkIndexB: int = _ANY,
    physicsClientId: int = 0,
) -> tuple[tuple[Any, ...], ...]:
    """The contact points of the last step, 14 values each: see docs/pybullet.md."""
    world = connected(physicsClientId)
    asked = max(bodyA, bodyB)
    if asked >= 0 and asked not in world.bodies:
        return ()
    request = GetContactsRequest(robot=world.bodies[asked].robot if asked >= 0 else "")
    numbers = world.numbers()
    found: list[tuple[Any, ...]] = []
    for contact in world.wire.call(methods.GetContacts, request).contacts:
        a = numbers.get((contact.robot_a, contact.link_a))
        b = numbers.get((contact.robot_b, contact.link_b))
        if a is None or b is None:
            # A robot that another client brought since: syncBodyInfo adds it.
            continue
        for first, second, sign in ((a, b, 1.0), (b, a, -1.0)):
            if _asked(first, bodyA, linkIndexA) and _asked(second, bodyB, linkIndexB):
                found.append(_told(contact, first, second, sign))
                break
    return tuple(found)


def _asked(place: tuple[int, int], body: int, link: int) -> bool:
    return body in (-1, place[0]) and link in (_ANY, place[1])


def _told(contact: Contact, a: tuple[int, int], b: tuple[int, int], sign: float) -> tuple[Any, ...]:
    """PyBullet's normal points from B to A, the daemon's from its first robot to its second; `sign`
    is -1 if the two are swapped. Forces are those on A."""
    n = contact.normal
    normal = (-sign * n.x, -sign * n.y, -sign * n.z)
    half = contact.depth / 2.0
    p = contact.point
    on_a = (p.x - normal[0] * half, p.y - normal[1] * half, p.z - normal[2] * half)
    on_b = (p.x + normal[0] * half, p.y + normal[1] * half, p.z + normal[2] * half)
    f = contact.friction_force
    rub, across, along = _friction((-sign * f.x, -sign * f.y, -sign * f.z), normal)
    sides = (a[0], b[0], a[1], b[1])
    return (0, *sides, on_a, on_b, normal, -contact.depth, contact.normal_force, rub, across, 0.0, along)


def _friction(force: Vector, normal: Vector) -> tuple[float, Vector, Vector]:
    """All of it along one direction, and the direction across that has none."""
    size = math.sqrt(sum(x * x for x in force))
    if size == 0.0:
        # Any direction in the plane of the contact.
        axis = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.9 else (0.0, 1.0, 0.0)
        side = cross(normal, axis)
        length = math.sqrt(sum(x * x for x in side)) or 1.0
    else:
        side, length = force, size
    unit = (side[0] / length, side[1] / length, side[2] / length)
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
    """The nearest points of each pair of links that are at most so far apart, as `getContactPoints` tells contacts, with
    forces of zero."""
    del collisionShapePositionA, collisionShapePositionB, collisionShapeOrientationA, collisionShapeOrientationB
    if collisionShapeA != -1 or collisionShapeB != -1:
        raise unsupported("getClosestPoints", "the daemon measures between bodies, not to shapes of no body")
    world = connected(physicsClientId)
    a, b = world.bodies.get(bodyA), world.bodies.get(bodyB)
    if a is None or b is None:
        return ()
    request = GetClosestPointsRequest(a=QueryBody(robot=a.robot), b=QueryBody(robot=b.robot), max_distance=distance)
    for side, body, link in ((request.a, a, linkIndexA), (request.b, b, linkIndexB)):
        if link != _ANY:
            name = body.link_name(link)
            if name is None:
                return ()
            side.link = name
    numbers = world.numbers()
    found: list[tuple[Any, ...]] = []
    for pair in world.wire.call(methods.GetClosestPoints, request).pairs:
        first, second = numbers.get((pair.robot_a, pair.link_a)), numbers.get((pair.robot_b, pair.link_b))
        if first is None or second is None:
            continue
        found.append(_near(pair, first, second, swapped=False))
        if a is b and request.a.link == request.b.link:
            # As in PyBullet, each of the two is A once.
            found.append(_near(pair, second, first, swapped=True))
    return tuple(sorted(found, key=lambda row: (row[3], row[4])))


def _near(pair: ClosestPoints, a: tuple[int, int], b: tuple[int, int], swapped: bool) -> tuple[Any, ...]:
    """PyBullet's normal points from B to A."""
    on_a, on_b = (pair.point_b, pair.point_a) if swapped else (pair.point_a, pair.point_b)
    sign, n = (1.0 if swapped else -1.0), pair.normal
    normal = (sign * n.x, sign * n.y, sign * n.z)
    points = ((on_a.x, on_a.y, on_a.z), (on_b.x, on_b.y, on_b.z))
    return (0, a[0], b[0], a[1], b[1], *points, normal, pair.distance, 0.0, 0.0, ORIGIN, 0.0, ORIGIN)


def performCollisionDetection(physicsClientId: int = 0) -> None:
    """Does nothing: contacts are those of the last step."""
    connected(physicsClientId)


def rayTest(
    rayFromPosition: Any,
    rayToPosition: Any,
    collisionFilterMask: int = -1,
    reportHitNumber: int = -1,
    physicsClientId: int = 0,
) -> tuple[tuple[Any, ...], ...]:
    """The first hit of a ray: body, link, fraction of its length, position, normal."""
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
    """`rayTest` for many rays, in world axes or in those of a link."""
    del numThreads, reportHitNumber, fractionEpsilon
    mask = None if collisionFilterMask == -1 else int(collisionFilterMask) & 0xFFFFFFFF
    world = connected(physicsClientId)
    if len(rayFromPositions) != len(rayToPositions):
        raise error("Size of from_positions need to be equal to size of to_positions.")
    frame = _frame(world, parentObjectUniqueId, parentLinkIndex)
    numbers = world.numbers()
    answers: list[tuple[Any, ...]] = []
    for start in range(0, len(rayFromPositions), _MOST_RAYS):
        request = CastRaysRequest(collision_mask=mask)
        part = slice(start, start + _MOST_RAYS)
        for begin, end in zip(rayFromPositions[part], rayToPositions[part], strict=True):
            ray = request.rays.add()
            for wire, place in ((getattr(ray, "from"), begin), (ray.to, end)):
                wire.x, wire.y, wire.z = _placed(frame, vector(place, "a ray's ends need 3 numbers each"))
        hits = world.wire.call(methods.CastRays, request).hits
        answers.extend(_hit(hit, numbers) for hit in hits)
    return tuple(answers)


def _frame(world: World, number: int, link: int) -> Pose | None:
    """world_from_link of the link that rays are given in."""
    if number < 0:
        return None
    body: Body = world.body(number, "there is no such body")
    name = body.link_name(link)
    if name is None:
        raise error("Link index out-of-range.")
    return link_pose(body, world.link_poses(body), name)


def _placed(frame: Pose | None, place: Vector) -> Vector:
    return place if frame is None else compose(frame, (place, (0.0, 0.0, 0.0, 1.0)))[0]


def _hit(hit: RayHit, numbers: dict[tuple[str, str], tuple[int, int]]) -> tuple[Any, ...]:
    if not hit.hit:
        return _MISS
    body, link = numbers.get((hit.robot, hit.link), (-1, -1))
    place, normal = hit.point, hit.normal
    return (body, link, hit.fraction, (place.x, place.y, place.z), (normal.x, normal.y, normal.z))


__all__ = ["getClosestPoints", "getContactPoints", "performCollisionDetection", "rayTest", "rayTestBatch"]

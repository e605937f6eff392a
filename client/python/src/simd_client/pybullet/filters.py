"""Collision filtering: setCollisionFilterPair, setCollisionFilterGroupMask, and the flags of
self-collision."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from simd_client.proto import CollisionPair, PairCollision, SetCollisionFilterRequest, methods
from simd_client.surface import Surface

from . import constants
from .bodies import Body
from .connections import connected
from .world import World

Pair = tuple[tuple[int, int], tuple[int, int]]
"""Two links, each by the number of its body and its own; the smaller first."""

_DEFAULT = PairCollision.PAIR_COLLISION_DEFAULT
_OFF = PairCollision.PAIR_COLLISION_DISABLED
_ON = PairCollision.PAIR_COLLISION_ENABLED
_BITS = 0xFFFFFFFF
# Bullet's group of the world's parts, which do not touch each other.
_STATIC = 2
_MOVING = 1


def of_the_world(surface: Surface) -> Surface:
    """Returns the surface with Bullet's groups of a base that is fixed to the world."""
    return replace(surface, collision_group=_STATIC, collision_mask=_BITS & ~_STATIC)


def of_what_moves(surface: Surface) -> Surface:
    """Returns the surface with Bullet's groups of a free base."""
    return replace(surface, collision_group=_MOVING, collision_mask=_BITS)


def setCollisionFilterPair(
    bodyUniqueIdA: int,
    bodyUniqueIdB: int,
    linkIndexA: int,
    linkIndexB: int,
    enableCollision: int,
    physicsClientId: int = 0,
) -> None:
    """Switches two links off or on, regardless of their groups and masks. Links of one body touch only if it
    was loaded with URDF_USE_SELF_COLLISION, and its flags do not exclude them. As in PyBullet, unknown links
    are ignored."""
    world = connected(physicsClientId)
    pair = ((bodyUniqueIdA, linkIndexA), (bodyUniqueIdB, linkIndexB))
    bodies = [world.bodies.get(number) for number, _ in pair]
    if any(body is None or body.link_name(link) is None for body, (_, link) in zip(bodies, pair, strict=True)):
        world.say_once("setCollisionFilterPair: there is no such body or link; the call does nothing")
        return
    if pair[0] == pair[1]:
        return
    first, second = sorted(pair)
    world.pairs[first, second] = bool(enableCollision)
    _send(world, first[0], [_wire(world, (first, second), bool(enableCollision))])


def setCollisionFilterGroupMask(
    bodyUniqueId: int,
    linkIndexA: int,
    collisionFilterGroup: int,
    collisionFilterMask: int,
    physicsClientId: int = 0,
) -> None:
    """Sets a link's groups, a bit each, and the groups that it touches. Two links touch if one of them is in
    a group that the other one touches. As in PyBullet, an unknown link is ignored."""
    world = connected(physicsClientId)
    body = world.bodies.get(bodyUniqueId)
    link = None if body is None else body.link_name(linkIndexA)
    if body is None or link is None:
        world.say_once("setCollisionFilterGroupMask: there is no such body or link; the call does nothing")
        return
    surface = body.surfaces.get(link, Surface())
    group, mask = int(collisionFilterGroup) & _BITS, int(collisionFilterMask) & _BITS
    world.set_surfaces(body, {link: replace(surface, collision_group=group, collision_mask=mask)})


def set_parents(world: World, body: Body, flags: int) -> None:
    """Sets loadURDF's flags for links and their parents."""
    body.parent_flags = flags & (
        constants.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS | constants.URDF_USE_SELF_COLLISION_INCLUDE_PARENT
    )
    if body.self_collision and body.parent_flags:
        put(world, body.unique_id)


def put(world: World, number: int) -> None:
    """Sends all pairs of a body that was loaded or spawned again."""
    body = world.bodies[number]
    pairs: list[CollisionPair] = []
    if body.self_collision and body.parent_flags:
        excludes = body.parent_flags & constants.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS
        for link in range(len(body.joints)):
            for above in list(_above(body, link))[: None if excludes else 1]:
                pairs.append(_wire(world, ((number, above), (number, link)), True))
    known = [key for key in world.pairs if number in (key[0][0], key[1][0])]
    pairs.extend(_wire(world, key, world.pairs[key], number) for key in known)
    if pairs:
        _send(world, number, pairs)


def _send(world: World, number: int, pairs: list[CollisionPair]) -> None:
    request = SetCollisionFilterRequest(robot=world.bodies[number].robot, pairs=pairs)
    world.wire.call(methods.SetCollisionFilter, request)


def _wire(
    world: World, key: tuple[tuple[int, int], tuple[int, int]], on: bool, number: int | None = None
) -> CollisionPair:
    """Converts a pair as seen from the body of this number, by default the first one."""
    first, second = key if number in (None, key[0][0]) else (key[1], key[0])
    a, b = world.bodies[first[0]], world.bodies[second[0]]
    return CollisionPair(
        link=a.link_name(first[1]) or "",
        other_robot="" if a is b else b.robot,
        other_link=b.link_name(second[1]) or "",
        collision=_collision(a, first[1], second[1], on) if a is b else _ON if on else _OFF,
    )


def _collision(body: Body, a: int, b: int, on: bool) -> PairCollision:
    """Returns the filter of two links of one body; the flags decide for parents."""
    if not on:
        return _OFF
    lower, upper = max(a, b), min(a, b)
    above = list(_above(body, lower))
    if upper not in above:
        return _ON
    if body.parent_flags & constants.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS:
        return _OFF
    if upper == above[0] and not body.parent_flags & constants.URDF_USE_SELF_COLLISION_INCLUDE_PARENT:
        return _DEFAULT
    return _ON


def _above(body: Body, link: int) -> Iterator[int]:
    """Yields a link's parent, the parent's parent, and so on up to the base."""
    while link >= 0:
        link = body.joints[link].info[16]
        yield link


__all__ = ["setCollisionFilterGroupMask", "setCollisionFilterPair"]

"""Collision filter of a robot: self-collision, and pairs of links that are switched off or on."""

from __future__ import annotations

from dataclasses import dataclass

from simd_client import proto

_COLLISIONS = {
    None: proto.PairCollision.PAIR_COLLISION_DEFAULT,
    False: proto.PairCollision.PAIR_COLLISION_DISABLED,
    True: proto.PairCollision.PAIR_COLLISION_ENABLED,
}


@dataclass(frozen=True)
class CollisionPair:
    """Two links that are switched off or on."""

    link: str
    other_link: str
    enabled: bool | None
    """Whether the two touch, regardless of groups, masks and joints; `None`: those rules decide."""
    other_robot: str = ""
    """Empty: the same robot."""


@dataclass(frozen=True)
class CollisionFilter:
    """Collision filter of a robot."""

    self_collision: bool
    """Whether its links touch each other, except links that a joint connects."""
    pairs: tuple[CollisionPair, ...]
    """Switched pairs: pairs within the robot, then pairs with other robots."""


def collision_filter_from_proto(message: proto.GetCollisionFilterResponse) -> CollisionFilter:
    """Converts a filter from its message."""
    enabled = proto.PairCollision.PAIR_COLLISION_ENABLED
    pairs = (
        CollisionPair(each.link, each.other_link, each.collision == enabled, each.other_robot)
        for each in message.pairs
    )
    return CollisionFilter(message.self_collision, tuple(pairs))


def collision_pair_to_proto(pair: CollisionPair) -> proto.CollisionPair:
    """Converts a pair to its message."""
    return proto.CollisionPair(
        link=pair.link,
        other_robot=pair.other_robot,
        other_link=pair.other_link,
        collision=_COLLISIONS[pair.enabled],
    )

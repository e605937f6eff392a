"""What a robot touches: itself or not, and which pairs of links are switched off or on."""

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
    """Whether the two touch, whatever groups, masks and joints say; `None`: as those say."""
    other_robot: str = ""
    """Empty: the same robot."""


@dataclass(frozen=True)
class CollisionFilter:
    """What a robot touches."""

    self_collision: bool
    """Its links touch each other, except those that a joint connects."""
    pairs: tuple[CollisionPair, ...]
    """Those that are switched off or on: its own, then those with other robots."""


def collision_filter_from_proto(message: proto.GetCollisionFilterResponse) -> CollisionFilter:
    """From its message."""
    enabled = proto.PairCollision.PAIR_COLLISION_ENABLED
    pairs = (
        CollisionPair(each.link, each.other_link, each.collision == enabled, each.other_robot)
        for each in message.pairs
    )
    return CollisionFilter(message.self_collision, tuple(pairs))


def collision_pair_to_proto(pair: CollisionPair) -> proto.CollisionPair:
    """As a message."""
    return proto.CollisionPair(
        link=pair.link,
        other_robot=pair.other_robot,
        other_link=pair.other_link,
        collision=_COLLISIONS[pair.enabled],
    )

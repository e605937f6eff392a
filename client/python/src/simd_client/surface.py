"""Friction, restitution, collision groups and damping of links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Union

from simd_client import proto


@dataclass(frozen=True)
class Surface:
    """Friction, restitution, collision groups and damping of a link. `Physics.surface_combination` of the world
    combines the surfaces of two links in contact."""

    friction: float | None = None
    """Coefficient of dry friction, at least 0. `None` does not change it; in a reading it means that the link has no
    collision shape."""
    restitution: float | None = None
    """From 0 (does not bounce) to 1 (loses no speed). `None` as for friction."""
    collision_group: int | None = None
    """The groups that the link is in: 32 bits, by default 1. `None` as for friction."""
    collision_mask: int | None = None
    """The groups that it touches: 32 bits, by default all. Two links touch if one of them is in a group that the other
    one touches. `None` as for friction."""
    rolling_friction: float | None = None
    """Rolling friction: the maximum torque is this many metres times the normal force; at least 0. `None` as
    for friction."""
    spinning_friction: float | None = None
    """Spinning friction about the normal, in the same unit."""
    contact_stiffness: float | None = None
    """Stiffness of the spring at each contact point, N/m; 0 is rigid. `None` as for friction."""
    contact_damping: float | None = None
    """Damping in parallel with that spring, N s/m. `None` as for friction."""
    linear_damping: float | None = None
    """Damping k of the link's own motion, 1/s: a mass m that moves at v gets the force -m k v (1 + |v|). `None` does not
    change it."""
    angular_damping: float | None = None
    """Damping k' of the link's angular motion, 1/s: the torque is -I k' w (1 + |w|). `None` does not change it."""


Surfaces = Union[Surface, Mapping[str, Surface]]
"""One for all links, or some by the link's name."""


def surfaces_to_proto(surfaces: Surfaces | None) -> list[proto.LinkProperties]:
    """Converts to messages; an empty name means all links."""
    if surfaces is None:
        return []
    named = {"": surfaces} if isinstance(surfaces, Surface) else surfaces
    return [
        proto.LinkProperties(
            link=link,
            friction=each.friction,
            restitution=each.restitution,
            rolling_friction=each.rolling_friction,
            spinning_friction=each.spinning_friction,
            contact_stiffness=each.contact_stiffness,
            contact_damping=each.contact_damping,
            linear_damping=each.linear_damping,
            angular_damping=each.angular_damping,
            collision_group=each.collision_group,
            collision_mask=each.collision_mask,
        )
        for link, each in named.items()
    ]


def surface_from_proto(message: proto.LinkProperties) -> Surface:
    """Converts one link's from its message."""
    return Surface(
        message.friction if message.HasField("friction") else None,
        message.restitution if message.HasField("restitution") else None,
        message.collision_group if message.HasField("collision_group") else None,
        message.collision_mask if message.HasField("collision_mask") else None,
        message.rolling_friction if message.HasField("rolling_friction") else None,
        message.spinning_friction if message.HasField("spinning_friction") else None,
        message.contact_stiffness if message.HasField("contact_stiffness") else None,
        message.contact_damping if message.HasField("contact_damping") else None,
        message.linear_damping if message.HasField("linear_damping") else None,
        message.angular_damping if message.HasField("angular_damping") else None,
    )

"""Friction and restitution of links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Union

from simd_client import proto


@dataclass(frozen=True)
class Surface:
    """Friction and restitution of a link. In a contact the smaller friction and the larger restitution apply."""

    friction: float | None = None
    """Coefficient of dry friction, at least 0. `None` does not change it; in a reading it means that the link has no
    collision shape."""
    restitution: float | None = None
    """From 0 (does not bounce) to 1 (loses no speed). `None` as for friction."""


Surfaces = Union[Surface, Mapping[str, Surface]]
"""One for all links, or some by the link's name."""


def surfaces_to_proto(surfaces: Surfaces | None) -> list[proto.LinkProperties]:
    """As messages; an empty name is all links."""
    if surfaces is None:
        return []
    named = {"": surfaces} if isinstance(surfaces, Surface) else surfaces
    return [
        proto.LinkProperties(link=link, friction=each.friction, restitution=each.restitution)
        for link, each in named.items()
    ]


def surface_from_proto(message: proto.LinkProperties) -> Surface:
    """One link's from its message."""
    return Surface(
        message.friction if message.HasField("friction") else None,
        message.restitution if message.HasField("restitution") else None,
    )

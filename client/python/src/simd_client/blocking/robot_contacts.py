# Generated from simd_client/aio/robot_contacts.py by tools/make_blocking.py; do not edit.
"""Contacts, surfaces and collision filter of a robot."""

from __future__ import annotations

from collections.abc import Iterable

from simd_client import proto
from simd_client.blocking.motion import Motion
from simd_client.collision_filter import (
    CollisionFilter,
    CollisionPair,
    collision_filter_from_proto,
    collision_pair_to_proto,
)
from simd_client.contact import Contact, contacts_from_proto
from simd_client.proto import methods
from simd_client.state import Named, name_of
from simd_client.surface import Surface, surface_from_proto, surfaces_to_proto
from simd_client.world import Stamp, stamp_from_proto


class RobotContacts(Motion):
    """The part of a robot that covers its contacts, surfaces and collision filter."""

    def contacts(self) -> tuple[Contact, ...]:
        """Returns its contact points with others and with itself, of the newest state."""
        request = proto.GetContactsRequest(robot=self.name)
        return contacts_from_proto(self._connection.call(methods.GetContacts, request).contacts)

    def surfaces(self) -> dict[str, Surface]:
        """Returns friction and restitution by link; `None` for a link without a collision shape."""
        request = proto.GetLinkPropertiesRequest(robot=self.name)
        answer = self._connection.call(methods.GetLinkProperties, request)
        return {each.link: surface_from_proto(each) for each in answer.links}

    def set_surface(
        self,
        *,
        friction: float | None = None,
        restitution: float | None = None,
        rolling_friction: float | None = None,
        spinning_friction: float | None = None,
        contact_stiffness: float | None = None,
        contact_damping: float | None = None,
        link: str | None = None,
    ) -> Stamp:
        """Changes the given surface properties of one link or of all. Rolling and spinning friction are in
        metres. Each contact point's spring has N/m (0 is rigid), and its damper N s/m."""
        surface = Surface(
            friction,
            restitution,
            rolling_friction=rolling_friction,
            spinning_friction=spinning_friction,
            contact_stiffness=contact_stiffness,
            contact_damping=contact_damping,
        )
        links = surfaces_to_proto({link or "": surface})
        request = proto.SetLinkPropertiesRequest(robot=self.name, links=links)
        return stamp_from_proto(self._connection.call(methods.SetLinkProperties, request).stamp)

    def set_collision_groups(
        self, group: int | None = None, mask: int | None = None, *, link: str | None = None
    ) -> Stamp:
        """Changes the groups of one link or of all (`group`), and the groups that they touch (`mask`), 32
        bits each. Two links touch if one of them is in a group that the other one touches."""
        links = surfaces_to_proto({link or "": Surface(collision_group=group, collision_mask=mask)})
        request = proto.SetLinkPropertiesRequest(robot=self.name, links=links)
        return stamp_from_proto(self._connection.call(methods.SetLinkProperties, request).stamp)

    def stays_awake(self) -> bool:
        """Whether it never sleeps, even if the world lets bodies sleep."""
        request = proto.GetLinkPropertiesRequest(robot=self.name)
        return self._connection.call(methods.GetLinkProperties, request).stays_awake

    def set_stays_awake(self, stays_awake: bool) -> Stamp:
        """Changes whether it may sleep, and wakes it. Robots with joints never sleep."""
        request = proto.SetLinkPropertiesRequest(robot=self.name, stays_awake=stays_awake)
        return stamp_from_proto(self._connection.call(methods.SetLinkProperties, request).stamp)

    def collision_filter(self) -> CollisionFilter:
        """Self-collision of its links, and the switched pairs of links."""
        request = proto.GetCollisionFilterRequest(robot=self.name)
        return collision_filter_from_proto(self._connection.call(methods.GetCollisionFilter, request))

    def set_collision(
        self, link: str, other_link: str, enabled: bool | None, *, other: str | Named | None = None
    ) -> Stamp:
        """Switches a pair of links off or on, regardless of groups, masks and joints; `None` restores those
        rules. The second link belongs to `other`, or to this robot."""
        named = "" if other is None else name_of(other)
        return self.set_collision_filter([CollisionPair(link, other_link, enabled, named)])

    def set_collision_filter(
        self, pairs: Iterable[CollisionPair] = (), *, self_collision: bool | None = None
    ) -> Stamp:
        """Switches pairs of links, and self-collision."""
        given = [collision_pair_to_proto(pair) for pair in pairs]
        request = proto.SetCollisionFilterRequest(robot=self.name, pairs=given)
        if self_collision is not None:
            request.self_collision = self_collision
        return stamp_from_proto(self._connection.call(methods.SetCollisionFilter, request).stamp)

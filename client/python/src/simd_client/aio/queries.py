"""Geometric queries in a world: contacts, rays, distances, overlaps."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.aio.primitives import Primitives
from simd_client.contact import Contact, RayHits, contacts_from_proto, hits_from_proto, ray_ends, ray_requests
from simd_client.geometry import Pose, pose_to_proto, vector_from_proto, vector_to_proto
from simd_client.proto import methods
from simd_client.query import (
    ClosestPoints,
    LinkBounds,
    Shape,
    Side,
    bounds_from_proto,
    closest_from_proto,
    side_to_proto,
)
from simd_client.state import Named, name_of


class Queries(Primitives):
    """The part of a connection that answers geometric queries."""

    async def contacts(self, robot: str | Named | None = None) -> tuple[Contact, ...]:
        """Returns the contact points of the newest state: of all robots, or of one robot."""
        request = proto.GetContactsRequest(robot="" if robot is None else name_of(robot))
        return contacts_from_proto((await self.call(methods.GetContacts, request)).contacts)

    async def cast_rays(
        self, starts: npt.ArrayLike, ends: npt.ArrayLike, *, collision_mask: int | None = None
    ) -> RayHits:
        """Returns the first hit of each ray in the newest state: one row per ray, metres, world axes; all
        rays may share one start. Only links in one of the groups of `collision_mask` are hit. Up to 20,000
        rays are one round trip."""
        begin, end = ray_ends(starts, ends)
        hits: list[proto.RayHit] = []
        for request in ray_requests(begin, end, collision_mask):
            hits.extend((await self.call(methods.CastRays, request)).hits)
        return hits_from_proto(hits, end)

    async def closest_points(
        self,
        a: Side,
        b: Side | None = None,
        *,
        max_distance: float | None = None,
        nearest_only: bool = False,
        filtered: bool = False,
    ) -> tuple[ClosestPoints, ...]:
        """Returns the nearest points of links of two robots and their distance, one for each pair of links.
        `b` may be the same as `a`, and defaults to every other robot. A `QueryRobot` names one link, or a
        hypothetical configuration of the robot; a `Shape` or `PlacedShape` belongs to no robot. `filtered`
        leaves out links that may not touch each other."""
        request = proto.GetClosestPointsRequest(
            a=side_to_proto(a),
            b=None if b is None else side_to_proto(b),
            max_distance=max_distance,
            nearest_only=nearest_only,
            filtered=filtered,
        )
        return closest_from_proto((await self.call(methods.GetClosestPoints, request)).pairs)

    async def overlaps(
        self, shape: Shape, pose: Pose | None = None, *, bounds_only: bool = False
    ) -> tuple[tuple[str, str], ...]:
        """Returns robot and link of all that overlap a shape. With `bounds_only` it compares only their boxes
        along the world's axes."""
        request = proto.FindOverlapsRequest(
            shape=shape.message, pose=None if pose is None else pose_to_proto(pose), bounds_only=bounds_only
        )
        links = (await self.call(methods.FindOverlaps, request)).links
        return tuple((each.robot, each.link) for each in links)

    async def cast_shape(self, shape: Shape, translation: npt.ArrayLike, pose: Pose | None = None) -> RayHits:
        """Returns the first hit of a shape that moves by `translation` from a pose, without turning."""
        way = vector_to_proto(translation, "a translation")
        request = proto.CastShapeRequest(
            shape=shape.message, pose=None if pose is None else pose_to_proto(pose), translation=way
        )
        hit = (await self.call(methods.CastShape, request)).hit
        start = Pose() if pose is None else pose
        end = np.asarray(start.position) + vector_from_proto(way)
        return hits_from_proto([hit], end[None, :])

    async def link_bounds(self, *robots: str | Named) -> tuple[LinkBounds, ...]:
        """Returns the boxes around the shapes of links, along the world's axes: of these robots, or of all.
        Links without collision shapes and planes have none."""
        request = proto.GetLinkBoundsRequest(robots=[name_of(robot) for robot in robots])
        return bounds_from_proto((await self.call(methods.GetLinkBounds, request)).links)

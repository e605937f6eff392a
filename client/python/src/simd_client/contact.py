"""Contact points between links, and hits of rays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import FloatArray, vector_from_proto

RAYS = 20_000
"""Maximum number of rays in one request."""


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact point of two links. Forces are means over the last step; axes are the world's."""

    robot_a: str
    link_a: str
    robot_b: str
    link_b: str
    point: FloatArray
    """Metres, halfway between the two surfaces."""
    normal: FloatArray
    """Unit vector from a to b: the direction of the normal force on b."""
    depth: float
    """Penetration in metres; negative if the surfaces do not touch yet."""
    normal_force: float
    """Newtons on b along the normal, at least 0."""
    friction_force: FloatArray
    """Newtons on b across the normal."""

    @property
    def force(self) -> FloatArray:
        """Total force on b, newtons; a feels the opposite."""
        return self.normal_force * self.normal + self.friction_force


@dataclass(frozen=True, eq=False)
class RayHits:
    """The first hit of each ray, in the order of the rays. World axes."""

    hit: npt.NDArray[np.bool_]
    """Whether the ray hit anything."""
    robots: tuple[str, ...]
    """Empty if the ray hit nothing."""
    links: tuple[str, ...]
    """Empty if the ray hit nothing."""
    fractions: FloatArray
    """Position of the hit between start (0) and end (1); 1 if the ray hit nothing."""
    points: FloatArray
    """Metres, one row per ray: the hit, or the end of the ray."""
    normals: FloatArray
    """Unit vectors out of the surface, one row per ray; zeros if the ray hit nothing."""

    def __len__(self) -> int:
        return len(self.robots)


def contacts_from_proto(messages: Sequence[proto.Contact]) -> tuple[Contact, ...]:
    """Converts contact points from their messages."""
    return tuple(
        Contact(
            robot_a=each.robot_a,
            link_a=each.link_a,
            robot_b=each.robot_b,
            link_b=each.link_b,
            point=vector_from_proto(each.point),
            normal=vector_from_proto(each.normal),
            depth=each.depth,
            normal_force=each.normal_force,
            friction_force=vector_from_proto(each.friction_force),
        )
        for each in messages
    )


def ray_ends(starts: npt.ArrayLike, ends: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Builds requests with one row per ray. Raises `ValueError` if the numbers of starts and ends do not
    match."""
    begin, end = _ends(starts, "starts"), _ends(ends, "ends")
    if len(begin) == 1 and len(end) > 1:
        begin = np.broadcast_to(begin, end.shape)
    if begin.shape != end.shape:
        raise ValueError(f"{len(begin)} starts and {len(end)} ends: give one of each for a ray, or one start")
    return begin, end


def ray_requests(
    begin: FloatArray, end: FloatArray, collision_mask: int | None = None
) -> Iterator[proto.CastRaysRequest]:
    """Splits the rays into requests."""
    for first in range(0, len(begin), RAYS):
        request = proto.CastRaysRequest(collision_mask=collision_mask)
        part = slice(first, first + RAYS)
        for a, b in zip(begin[part].tolist(), end[part].tolist()):
            ray = request.rays.add()
            origin: proto.Vector3 = getattr(ray, "from")
            origin.x, origin.y, origin.z = a
            ray.to.x, ray.to.y, ray.to.z = b
        yield request


def hits_from_proto(hits: Sequence[proto.RayHit], end: FloatArray) -> RayHits:
    """Converts hits from their messages; `end` has the ends of the rays."""
    hit = np.array([each.hit for each in hits], dtype=np.bool_)
    points = _rows([each.point for each in hits])
    return RayHits(
        hit=hit,
        robots=tuple(each.robot for each in hits),
        links=tuple(each.link for each in hits),
        fractions=np.where(hit, [each.fraction for each in hits], 1.0),
        points=np.where(hit[:, None], points, end),
        normals=_rows([each.normal for each in hits]),
    )


def _rows(vectors: Sequence[proto.Vector3]) -> FloatArray:
    return np.reshape(np.array([(v.x, v.y, v.z) for v in vectors], dtype=np.float64), (-1, 3))


def _ends(given: npt.ArrayLike, what: str) -> FloatArray:
    array = np.atleast_2d(np.asarray(given, dtype=np.float64))
    if array.size == 0:
        return np.zeros((0, 3))
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{what} of rays have three numbers each, not the shape {array.shape}")
    return array

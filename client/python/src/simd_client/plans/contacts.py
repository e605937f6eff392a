"""Calls of `ContactService`: what touches what, and what rays hit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import FloatArray, vector_from_proto
from simd_client.plan import Plan, ask
from simd_client.proto import methods

RAYS = 1000
"""Of one request."""


@dataclass(frozen=True, eq=False)
class Contact:
    """A point at which two links touch. Forces are means over the last step; axes are the world's."""

    robot_a: str
    link_a: str
    robot_b: str
    link_b: str
    point: FloatArray
    """Metres, in the middle between the two surfaces."""
    normal: FloatArray
    """Unit vector from a to b: the direction in which b is pushed."""
    depth: float
    """Metres that the two overlap; negative where they are about to touch."""
    normal_force: float
    """Newtons on b along the normal, at least 0."""
    friction_force: FloatArray
    """Newtons on b across the normal."""

    @property
    def force(self) -> FloatArray:
        """Newtons on b in all; a feels the opposite."""
        return self.normal_force * self.normal + self.friction_force


@dataclass(frozen=True, eq=False)
class RayHits:
    """What rays met first, one entry a ray, in their order. World axes."""

    hit: npt.NDArray[np.bool_]
    """Whether anything was met."""
    robots: tuple[str, ...]
    """Empty where nothing was met."""
    links: tuple[str, ...]
    """Empty where nothing was met."""
    fractions: FloatArray
    """Where on the way from start (0) to end (1); 1 where nothing was met."""
    points: FloatArray
    """Metres, one row a ray: where it was stopped, or its end."""
    normals: FloatArray
    """Unit vectors out of the surface, one row a ray; zeros where nothing was met."""

    def __len__(self) -> int:
        return len(self.robots)


def contacts(robot: str) -> Plan[tuple[Contact, ...]]:
    """The points at which links touch; of one robot where one is named."""
    answer = yield from ask(methods.GetContacts, proto.GetContactsRequest(robot=robot))
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
        for each in answer.contacts
    )


def cast_rays(starts: npt.ArrayLike, ends: npt.ArrayLike) -> Plan[RayHits]:
    """What straight lines meet first."""
    begin, end = _ends(starts, "starts"), _ends(ends, "ends")
    if len(begin) == 1 and len(end) > 1:
        begin = np.broadcast_to(begin, end.shape)
    if begin.shape != end.shape:
        raise ValueError(f"{len(begin)} starts and {len(end)} ends: give one of each for a ray, or one start")
    hits: list[proto.RayHit] = []
    for first in range(0, len(begin), RAYS):
        request = proto.CastRaysRequest()
        part = slice(first, first + RAYS)
        for a, b in zip(begin[part].tolist(), end[part].tolist()):
            ray = request.rays.add()
            origin: proto.Vector3 = getattr(ray, "from")
            origin.x, origin.y, origin.z = a
            ray.to.x, ray.to.y, ray.to.z = b
        hits.extend((yield from ask(methods.CastRays, request)).hits)
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

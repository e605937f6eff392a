"""What PyBullet tells of a URDF and the daemon does not: the frames of the inertias."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

from .arguments import ORIGIN, UPRIGHT, Pose, Vector
from .rotations import from_euler


def inertial_frames(urdf: bytes, scale: float) -> dict[str, Pose]:
    """`link_from_inertia` of each link that has one, metres, by the link's name.

    PyBullet's base positions, link states and joint frames are those of the inertias. The daemon
    tells centres of mass, and not how the axes of an inertia were written. A text that cannot
    be read gives none: then the axes are the links'.
    """
    # No document type: an entity could stand for gigabytes.
    if b"<!" in urdf.replace(b"<!--", b""):
        return {}
    try:
        robot = ElementTree.fromstring(urdf)
    except ElementTree.ParseError:
        return {}
    frames: dict[str, Pose] = {}
    for link in robot.iter("link"):
        origin = link.find("inertial/origin")
        name = link.get("name")
        if name is not None:
            frames[name] = (ORIGIN, UPRIGHT) if origin is None else _pose(origin, scale)
    return frames


def _pose(origin: ElementTree.Element, scale: float) -> Pose:
    x, y, z = _numbers(origin.get("xyz"))
    return (x * scale, y * scale, z * scale), from_euler(*_numbers(origin.get("rpy")))


def _numbers(text: str | None) -> Vector:
    try:
        x, y, z = map(float, (text or "0 0 0").split())
    except ValueError:
        return ORIGIN
    return (x, y, z)

"""Poses and numbers of a URDF's elements."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable

from .arguments import ORIGIN, UPRIGHT, Pose, Quaternion, Vector
from .rotations import from_euler, matrix


def pose_of(element: ElementTree.Element) -> Pose:
    """Returns the pose of its `origin`."""
    origin = element.find("origin")
    if origin is None:
        return ORIGIN, UPRIGHT
    return _vector(origin.get("xyz")), from_euler(*_vector(origin.get("rpy")))


def set_pose(element: ElementTree.Element, pose: Pose) -> None:
    """Sets the pose of its `origin`, which it lacks at the identity."""
    for origin in element.findall("origin"):
        element.remove(origin)
    if pose != (ORIGIN, UPRIGHT):
        ElementTree.SubElement(element, "origin", xyz=text_of(pose[0]), rpy=text_of(rpy(pose[1])))


def rpy(turn: Quaternion) -> Vector:
    """Returns roll, pitch and yaw of URDF, also for a pitch of 90 degrees."""
    m = matrix(turn)
    pitch = math.asin(max(-1.0, min(1.0, -m[2][0])))
    if abs(m[2][0]) > 1.0 - 1e-12:
        return (0.0, pitch, math.atan2(-m[0][1], m[1][1]))
    return (math.atan2(m[2][1], m[2][2]), pitch, math.atan2(m[1][0], m[0][0]))


def text_of(values: Iterable[float]) -> str:
    """Returns numbers as an attribute, without loss."""
    return " ".join(repr(float(value)) for value in values)


def numbers_of(text: str) -> list[float]:
    """Returns the numbers of an attribute; none if any of it is something else."""
    try:
        return [float(each) for each in text.split()]
    except ValueError:
        return []


def number_of(element: ElementTree.Element | None, name: str) -> float | None:
    """Returns the only number of an attribute."""
    numbers = numbers_of("" if element is None else element.get(name, ""))
    return numbers[0] if len(numbers) == 1 else None


def _vector(text: str | None) -> Vector:
    numbers = numbers_of(text or "")
    return (numbers[0], numbers[1], numbers[2]) if len(numbers) == 3 else ORIGIN

"""Arguments as PyBullet's scripts give them: lists, tuples and arrays of numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from .errors import error

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Pose = tuple[Vector, Quaternion]

ORIGIN: Vector = (0.0, 0.0, 0.0)
UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


def floats(value: Any, message: str, count: int | None = None) -> list[float]:
    """`count` finite numbers, or any number of them.

    Raises:
        error: with `message`, where `value` is something else.
    """
    if not isinstance(value, Iterable):
        raise error(message)
    try:
        numbers = [float(item) for item in value]  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    except (TypeError, ValueError):
        raise error(message) from None
    if (count is not None and len(numbers) != count) or not all(map(math.isfinite, numbers)):
        raise error(message)
    return numbers


def vector(value: Any, message: str) -> Vector:
    """Three numbers."""
    x, y, z = floats(value, message, 3)
    return (x, y, z)


def quaternion(value: Any, message: str) -> Quaternion:
    """Four numbers: x y z w."""
    x, y, z, w = floats(value, message, 4)
    return (x, y, z, w)


def indices(value: Any, message: str) -> list[int]:
    """Any sequence of whole numbers."""
    if not isinstance(value, Iterable):
        raise error(message)
    try:
        return [int(item) for item in value]  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    except (TypeError, ValueError):
        raise error(message) from None

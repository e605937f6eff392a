"""Arguments as PyBullet's scripts give them: lists, tuples and arrays of numbers."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Callable, Iterable
from typing import Any, TypeVar, cast

from .errors import error

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Color = tuple[float, float, float, float]
Pose = tuple[Vector, Quaternion]

Function = TypeVar("Function", bound=Callable[..., Any])

ORIGIN: Vector = (0.0, 0.0, 0.0)
UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


def floats(value: Any, message: str, count: int | None = None) -> list[float]:
    """Returns `count` finite numbers, or any number of them.

    Raises:
        error: with `message`, if `value` is something else.
    """
    found = numbers(value, message)
    if count is not None and len(found) != count:
        raise error(message)
    # A sum is faster, and is not finite if one of its terms is not.
    if not math.isfinite(sum(found)) and not all(map(math.isfinite, found)):
        raise error(message)
    return found


def numbers(value: Any, message: str) -> list[float]:
    """Returns any number of numbers, which may be infinite.

    Raises:
        error: with `message`, if `value` is something else.
    """
    if type(value) is not list and not isinstance(value, Iterable):
        raise error(message)
    try:
        return list(map(float, value))  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    except (TypeError, ValueError):
        raise error(message) from None


def vector(value: Any, message: str) -> Vector:
    """Returns three numbers."""
    x, y, z = floats(value, message, 3)
    return (x, y, z)


def quaternion(value: Any, message: str) -> Quaternion:
    """Returns four numbers: x y z w."""
    x, y, z, w = floats(value, message, 4)
    return (x, y, z, w)


def vector_or(default: Vector, value: Any, name: str) -> Vector:
    """Returns three numbers; the default for `None`. As in PyBullet also for anything else, with one line on stderr."""
    if value is None:
        return default
    try:
        return vector(value, "")
    except error:
        _say_unread(name, 3, default)
        return default


def quaternion_or(default: Quaternion, value: Any, name: str) -> Quaternion:
    """Returns four numbers, like `vector_or`."""
    if value is None:
        return default
    try:
        return quaternion(value, "")
    except error:
        _say_unread(name, 4, default)
        return default


@functools.cache
def _say_unread(name: str, count: int, default: tuple[float, ...]) -> None:
    print(f"simd: {name} is not read, since it is not {count} numbers: {default} is used, as in PyBullet", file=sys.stderr)


def rgba(value: Any, message: str) -> Color:
    """Returns red, green, blue and alpha, 0 to 1. As in PyBullet, a colour of another length is white."""
    numbers = floats(value, message)
    if len(numbers) != 4:
        return (1.0, 1.0, 1.0, 1.0)
    red, green, blue, alpha = numbers
    return (red, green, blue, alpha)


def indices(value: Any, message: str) -> list[int]:
    """Returns any sequence of whole numbers."""
    if type(value) is not list and not isinstance(value, Iterable):
        raise error(message)
    try:
        return list(map(int, value))  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    except (TypeError, ValueError):
        raise error(message) from None


def formerly(old: str, new: str) -> Callable[[Function], Function]:
    """Accepts the argument `new` under its old name too, as PyBullet does."""

    def renaming(function: Function) -> Function:
        @functools.wraps(function)
        def renamed(*arguments: Any, **named: Any) -> Any:
            if old in named:
                named[new] = named.pop(old)
            return function(*arguments, **named)

        return cast(Function, renamed)

    return renaming

"""The pure functions against PyBullet's own, on random input."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from simd_client.pybullet import cameras, rotations

real: Any = pytest.importorskip("pybullet", exc_type=ImportError)

# PyBullet computes these three in double precision, and the others in single. The last digits of the others
# are noise from 6e-8 on, which square roots and arc cosines near one magnify.
DOUBLE = 1e-12
SINGLE = 2e-6
ILL_CONDITIONED = 1e-4


def flat(value: Any) -> Iterator[float]:
    if isinstance(value, tuple):
        for item in value:  # pyright: ignore[reportUnknownVariableType]
            yield from flat(item)
    else:
        yield float(value)


def vector(rng: random.Random, count: int = 3) -> list[float]:
    return [rng.uniform(-1.0, 1.0) for _ in range(count)]


def unit(rng: random.Random) -> list[float]:
    q = vector(rng, 4)
    length = math.sqrt(sum(x * x for x in q))
    return [x / length for x in q]


def any_length(rng: random.Random) -> list[float]:
    return vector(rng, 4)


Make = Callable[[random.Random], list[float]]
Arguments = Callable[[random.Random, Make], list[Any]]

ROTATIONS: list[tuple[str, float, Arguments]] = [
    ("getQuaternionFromEuler", DOUBLE, lambda r, q: [[4 * x for x in vector(r)]]),
    ("getEulerFromQuaternion", DOUBLE, lambda r, q: [q(r)]),
    ("getMatrixFromQuaternion", DOUBLE, lambda r, q: [q(r)]),
    ("multiplyTransforms", SINGLE, lambda r, q: [vector(r), q(r), vector(r), q(r)]),
    ("invertTransform", SINGLE, lambda r, q: [vector(r), q(r)]),
    ("getDifferenceQuaternion", SINGLE, lambda r, q: [q(r), q(r)]),
    ("getAxisAngleFromQuaternion", ILL_CONDITIONED, lambda r, q: [q(r)]),
    ("getQuaternionFromAxisAngle", SINGLE, lambda r, q: [vector(r), r.uniform(-7.0, 7.0)]),
    ("getAxisDifferenceQuaternion", ILL_CONDITIONED, lambda r, q: [q(r), q(r)]),
    ("calculateVelocityQuaternion", ILL_CONDITIONED, lambda r, q: [q(r), q(r), r.uniform(0.1, 1.0)]),
    ("getQuaternionSlerp", SINGLE, lambda r, q: [q(r), q(r), r.random()]),
    ("rotateVector", SINGLE, lambda r, q: [q(r), vector(r)]),
]


@pytest.mark.parametrize(("name", "tolerance", "arguments"), ROTATIONS, ids=[row[0] for row in ROTATIONS])
@pytest.mark.parametrize("make", [unit, any_length])
def test_a_rotation_is_pybullets(name: str, tolerance: float, arguments: Arguments, make: Make) -> None:
    rng = random.Random(name)
    for _ in range(1000):
        given = arguments(rng, make)
        close(name, given, getattr(rotations, name)(*given), tolerance)


CAMERAS: list[tuple[str, Callable[[random.Random], list[Any]]]] = [
    ("computeViewMatrix", lambda r: [vector(r), vector(r), vector(r)]),
    (
        "computeViewMatrixFromYawPitchRoll",
        lambda r: [vector(r), r.uniform(0.5, 3.0), *(180 * x for x in vector(r)), r.choice([1, 2])],
    ),
    ("computeProjectionMatrix", lambda r: [-1.0, r.uniform(0.5, 1.0), -1.0, r.uniform(0.5, 1.0), 0.1, 10.0]),
    ("computeProjectionMatrixFOV", lambda r: [r.uniform(20.0, 90.0), r.uniform(0.5, 2.0), 0.1, 10.0]),
]


@pytest.mark.parametrize(("name", "arguments"), CAMERAS, ids=[row[0] for row in CAMERAS])
def test_a_camera_is_pybullets(name: str, arguments: Callable[[random.Random], list[Any]]) -> None:
    rng = random.Random(name)
    for _ in range(300):
        given = arguments(rng)
        close(name, given, getattr(cameras, name)(*given), 1e-5)


def close(name: str, given: list[Any], ours: Any, tolerance: float) -> None:
    theirs = list(flat(getattr(real, name)(*given)))
    numbers = list(flat(ours))
    assert len(numbers) == len(theirs)
    for a, b in zip(numbers, theirs, strict=True):
        assert abs(a - b) <= tolerance * (1.0 + abs(b)), (name, given, numbers, theirs)


def test_transforms_are_exact_where_pybullet_rounds() -> None:
    """Double precision: a transform times its inverse is the identity to 1e-15."""
    rng = random.Random(7)
    for _ in range(100):
        a = (vector(rng), unit(rng))
        position, orientation = rotations.multiplyTransforms(*a, *rotations.invertTransform(*a))
        assert max(map(abs, position)) < 1e-15
        assert abs(orientation[3]) > 1.0 - 1e-15


@pytest.mark.parametrize("row", ROTATIONS, ids=[row[0] for row in ROTATIONS])
def test_arguments_of_a_wrong_length_are_refused_as_pybullet_refuses_them(
    row: tuple[str, float, Arguments],
) -> None:
    name = row[0]
    given = row[2](random.Random(1), unit)
    given[0] = [1.0, 2.0]
    with pytest.raises(real.error):
        getattr(real, name)(*given)
    with pytest.raises(rotations_error()):
        getattr(rotations, name)(*given)


def rotations_error() -> type[Exception]:
    from simd_client.pybullet import error

    return error

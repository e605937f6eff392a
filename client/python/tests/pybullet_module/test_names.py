"""The module has every name of PyBullet: constants with equal values, and functions that work, do nothing, or
raise NotImplementedError with their name."""

from __future__ import annotations

from typing import Any

import pytest

import simd_client.pybullet as pybullet
from simd_client.pybullet import unsupported

real: Any = pytest.importorskip("pybullet", exc_type=ImportError)
NAMES = [name for name in dir(real) if not name.startswith("__")]


def test_no_name_is_lacking() -> None:
    assert len(NAMES) > 300
    assert [name for name in NAMES if not hasattr(pybullet, name)] == []


def test_constants_are_equal() -> None:
    constants = [name for name in NAMES if not callable(getattr(real, name))]
    assert len(constants) > 150
    assert [n for n in constants if getattr(pybullet, n) != getattr(real, n)] == []


def test_functions_of_pybullet_are_callable() -> None:
    assert [n for n in NAMES if callable(getattr(real, n)) and not callable(getattr(pybullet, n))] == []


@pytest.mark.parametrize("name", unsupported.__all__)
def test_unsupported_functions_raise_with_their_name(name: str) -> None:
    with pytest.raises(NotImplementedError, match=rf"simd_client\.pybullet\.{name}: \w+"):
        getattr(pybullet, name)(1, 2, some="argument")


def test_the_error_is_an_exception_of_its_own() -> None:
    assert pybullet.error.__mro__[1] is Exception


def test_without_a_connection_functions_say_what_pybullet_says() -> None:
    for name, arguments in (("stepSimulation", ()), ("getNumJoints", (0,)), ("setGravity", (0, 0, -9.81))):
        with pytest.raises(real.error) as theirs:
            getattr(real, name)(*arguments, physicsClientId=77)
        with pytest.raises(pybullet.error) as ours:
            getattr(pybullet, name)(*arguments, physicsClientId=77)
        assert str(ours.value) == str(theirs.value)

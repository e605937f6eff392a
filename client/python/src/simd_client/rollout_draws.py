"""Draws the daemon's random numbers for some copies of a rollout, so that another daemon can do these copies.
This is the client's half of `server/core/src/rollout/draw.rs`. Both have the same bits if both use the same
math library."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, log, tau

import numpy as np
import numpy.typing as npt

from simd_client.geometry import FloatArray
from simd_client.rollout import Variation

_Words = npt.NDArray[np.uint64]

_GOLDEN = 0x9E3779B97F4A7C15
_FIRST, _SECOND = 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
_ALL = 2**64 - 1

LEAST_MASS = 0.01
"""Minimum factor of a mass that a daemon accepts."""

_ADDED = ("joint_positions", "joint_velocities", "wrench")
"""Quantities with numbers that are not factors."""


def drawn(variation: Variation, index: int, seed: int, copies: range, width: int) -> Variation:
    """Returns a drawn variation with explicit numbers for these copies. `index` is its index in the list of
    the rollout, `width` the count of numbers per copy."""
    if variation.uniform is not None:
        low, high = variation.uniform
        part = _units(seed, copies, index, width, 0)
        values = low * (1.0 - part) + high * part
    elif variation.normal is not None:
        mean, deviation = variation.normal
        radius = 1.0 - _units(seed, copies, index, width, 1)
        angle = tau * _units(seed, copies, index, width, 2)
        # numpy's own logarithms and cosines differ in the last bits.
        values = mean + deviation * np.sqrt(-2.0 * _each(log, radius)) * _each(cos, angle)
    else:
        return variation
    if variation.of not in _ADDED:
        values = np.maximum(values, LEAST_MASS if variation.of == "link_masses" else 0.0)
    return replace(variation, values=values, uniform=None, normal=None)


def _each(function: Callable[[float], float], values: FloatArray) -> FloatArray:
    numbers: list[float] = values.ravel().tolist()
    return np.fromiter(map(function, numbers), np.float64, len(numbers)).reshape(values.shape)


def _units(seed: int, copies: range, index: int, width: int, draw: int) -> FloatArray:
    """(copies, width): at least 0 and less than 1, with 53 bits."""
    rows = np.array(copies, dtype=np.uint64)[:, None]
    columns = np.arange(width, dtype=np.uint64)[None, :]
    words = _taken_in(np.zeros((1, 1), dtype=np.uint64), _word(seed))
    for word in (rows, _word(index), columns, _word(draw)):
        words = _taken_in(words, word)
    return (words >> np.uint64(11)).astype(np.float64) / 2.0**53


def _word(value: int) -> _Words:
    return np.array([[value & _ALL]], dtype=np.uint64)


def _taken_in(words: _Words, word: _Words) -> _Words:
    golden = _word(_GOLDEN)
    return _mixed((words + golden) ^ _mixed(word + golden))


def _mixed(value: _Words) -> _Words:
    """The finaliser of SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014)."""
    value = (value ^ (value >> np.uint64(30))) * _word(_FIRST)
    value = (value ^ (value >> np.uint64(27))) * _word(_SECOND)
    return value ^ (value >> np.uint64(31))

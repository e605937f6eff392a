"""Numbers with units, as people type them: `90deg`, `12mm`, `30rpm`. The units equal simctl's."""

from __future__ import annotations

import math
from typing import Union

from simd_client.layout import JointInfo, JointType

Quantity = Union[float, str]
"""A number in SI units, or text with a unit."""

# Factor to SI, and whether the joint rotates. If one unit ends in another, the longer one comes first.
_UNITS = {
    "position": {
        "deg": (math.pi / 180, True),
        "rad": (1.0, True),
        "mm": (1e-3, False),
        "cm": (1e-2, False),
        "m": (1.0, False),
    },
    "velocity": {
        "deg/s": (math.pi / 180, True),
        "rad/s": (1.0, True),
        "rpm": (math.tau / 60, True),
        "mm/s": (1e-3, False),
        "cm/s": (1e-2, False),
        "m/s": (1.0, False),
    },
    "effort": {"Nm": (1.0, True), "N": (1.0, False)},
}
_TURNING = (JointType.REVOLUTE, JointType.CONTINUOUS)


def number(quantity: Quantity, what: str, joint: JointInfo | None = None) -> float:
    """Returns a number in SI units. `what` is `position`, `velocity` or `effort`.

    Raises `ValueError` for text that is not a number with one of the units, or whose unit does not fit the joint.
    """
    if not isinstance(quantity, str):
        return float(quantity)
    text = quantity.strip()
    units = _UNITS[what]
    for unit, (factor, turns) in units.items():
        value = _plain(text.removesuffix(unit)) if text.endswith(unit) else None
        if value is not None:
            if joint is not None and joint.type in (*_TURNING, JointType.PRISMATIC):
                _check(text, turns, joint)
            return value * factor
    value = _plain(text)
    if value is None:
        raise ValueError(f"`{quantity}` is not a number without a unit or with one of {', '.join(units)}")
    return value


def _plain(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _check(text: str, turns: bool, joint: JointInfo) -> None:
    if turns != (joint.type in _TURNING):
        does = "slides" if turns else "turns"
        raise ValueError(f"`{text}` does not fit joint `{joint.name}`, which {does}")

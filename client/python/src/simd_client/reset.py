"""Positions and velocities that joints are set to at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Union

import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import vector
from simd_client.layout import JointInfo, Layout
from simd_client.quantity import Quantity, number

JointValues = Union[Mapping[str, Quantity], npt.ArrayLike]
"""Of a robot's joints: by name, where they may have units, or as an array in joint order."""


def resets_need_layout(positions: JointValues | None, velocities: JointValues | None) -> bool:
    """Whether they are arrays, or have units, which must fit the joints. Raises `ValueError` if only one is by name."""
    by_name = positions is None or isinstance(positions, Mapping)
    if velocities is not None and by_name != isinstance(velocities, Mapping):
        raise ValueError("positions and velocities are both by name or both arrays")
    if positions is None or isinstance(positions, Mapping):
        given = [*(positions or {}).values(), *(velocities.values() if isinstance(velocities, Mapping) else ())]
        return any(isinstance(value, str) for value in given)
    return True


def resets_to_proto(
    layout: Layout | None, positions: JointValues | None, velocities: JointValues | None
) -> Sequence[proto.JointReset]:
    """One message for each joint and axis; none for what the robot was spawned with."""
    if positions is None or isinstance(positions, Mapping):
        return _by_name(layout, positions or {}, velocities if isinstance(velocities, Mapping) else None)
    if layout is None:
        raise ValueError("an array of positions needs a layout")
    return _in_order(layout, positions, velocities)


def _by_name(
    layout: Layout | None, positions: Mapping[str, Quantity], velocities: Mapping[str, Quantity] | None
) -> list[proto.JointReset]:
    velocities = velocities or {}
    for name in velocities:
        if name not in positions:
            raise ValueError(f"joint `{name}` is given a velocity and no position to start from")
    known: Mapping[str, JointInfo] = layout.by_name if layout else {}
    return [
        proto.JointReset(
            joint=name,
            position=number(at, "position", known.get(name)),
            velocity=number(velocities.get(name, 0.0), "velocity", known.get(name)),
        )
        for name, at in positions.items()
    ]


def _in_order(
    layout: Layout, positions: npt.ArrayLike, velocities: JointValues | None
) -> list[proto.JointReset]:
    if isinstance(velocities, Mapping):
        raise ValueError("positions and velocities are both by name or both arrays")
    given = (0.0,) * layout.velocity_count if velocities is None else velocities
    at = vector(positions, layout.position_count, f"a position of robot `{layout.robot}`")
    moving = vector(given, layout.velocity_count, f"a velocity of robot `{layout.robot}`")
    return [
        proto.JointReset(joint=joint.name, position=position, velocity=velocity, axis=axis)
        for joint in layout.joints
        if joint.mimic is None and len(at[joint.positions]) == joint.dof
        for axis, (position, velocity) in enumerate(
            zip(at[joint.positions].tolist(), moving[joint.velocities].tolist())
        )
    ]

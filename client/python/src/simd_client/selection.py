"""Which joints a call is about."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Union, cast

from simd_client import proto
from simd_client.state import Named, name_of

Selection = Union[str, Named, Collection[Union[str, Named]], Mapping[str, Sequence[str]], None]
"""A robot, several robots, or joints by robot; `None` means all joints of all robots."""


def selections_to_proto(selection: Selection) -> list[proto.JointSelection]:
    """The selection as messages."""
    if selection is None:
        return []
    if isinstance(selection, str):
        return [proto.JointSelection(robot=selection)]
    if isinstance(selection, Mapping):
        by_robot = cast("Mapping[str, Sequence[str]]", selection)
        return [proto.JointSelection(robot=robot, joints=joints) for robot, joints in by_robot.items()]
    if isinstance(selection, Collection):
        return [proto.JointSelection(robot=name_of(robot)) for robot in selection]
    return [proto.JointSelection(robot=name_of(selection))]

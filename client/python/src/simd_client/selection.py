"""Selection of the joints of a call."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Union, cast

from simd_client import proto
from simd_client.state import Named, name_of

Selection = Union[str, Named, Collection[Union[str, Named]], Mapping[str, Sequence[str]], None]
"""A robot, several robots, or joints by robot; `None` means all joints of all robots."""


SensorSelection = Union[bool, Collection[str], Mapping[str, Collection[str]]]
"""Sensors by their names, of each robot of the call or by robot; `True` means all of those robots."""


def sensors_to_proto(sensors: SensorSelection, robots: Collection[str]) -> list[proto.SensorSelection]:
    """Converts sensors of robots to messages. Raises `ValueError` for names of sensors without a robot."""
    if isinstance(sensors, str):
        raise TypeError(f"sensors are a list of names, not {sensors!r}")
    if sensors and not robots and not isinstance(sensors, Mapping):
        raise ValueError('without a selection of robots, say whose sensors: sensors={"arm": ["imu"]}')
    if isinstance(sensors, bool):
        return [proto.SensorSelection(robot=robot) for robot in robots] if sensors else []
    if isinstance(sensors, Mapping):
        by_robot = cast("Mapping[str, Collection[str]]", sensors)
        return [proto.SensorSelection(robot=robot, sensors=names) for robot, names in by_robot.items()]
    return [proto.SensorSelection(robot=robot, sensors=sensors) for robot in robots] if sensors else []


def selections_to_proto(selection: Selection) -> list[proto.JointSelection]:
    """Converts the selection to messages."""
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

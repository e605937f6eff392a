"""Readings of sensors as parts of observations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from simd_client import proto
from simd_client.blocking.robot import Robot
from simd_client.geometry import FloatArray
from simd_client.measurement import readings_from_proto
from simd_client.sensor import EncoderSensor, ForceTorqueSensor, ImuSensor, LidarSensor, RangeSensor


class Readings:
    """The newest readings of some sensors of a robot, zeros before the first."""

    def __init__(self, robot: Robot, names: Sequence[str]) -> None:
        """Raises `SensorNotFound`, and `ValueError` for a kind of sensor that observations do not have."""
        self._kinds: dict[str, Any] = {name: robot.sensors.get(name).info().kind for name in names}
        self._newest = {name: np.zeros(_size(name, kind)) for name, kind in self._kinds.items()}

    def forget(self) -> None:
        """A new episode begins."""
        for values in self._newest.values():
            values[:] = 0.0

    def take(self, found: Iterable[proto.SensorReadings]) -> None:
        """Takes the readings of an answer."""
        for each in found:
            readings = readings_from_proto(each)
            if readings:
                self._newest[each.sensor][:] = _numbers(self._kinds[each.sensor], readings[-1].measurement)

    def numbers(self) -> list[FloatArray]:
        """Returns the values of each sensor."""
        return list(self._newest.values())


def _size(name: str, kind: Any) -> int:
    """Returns how many numbers a reading has."""
    if isinstance(kind, ImuSensor):
        return 10
    if isinstance(kind, ForceTorqueSensor):
        return 6
    if isinstance(kind, EncoderSensor):
        return 2
    if isinstance(kind, RangeSensor):
        return 1
    if isinstance(kind, LidarSensor):
        return kind.horizontal.samples * kind.vertical.samples
    raise ValueError(
        f"sensor `{name}` is of the kind {type(kind).__name__}: observations have imu, force_torque, encoder, range and lidar"
    )


def _numbers(kind: Any, measured: Any) -> FloatArray:
    if isinstance(kind, ImuSensor):
        return np.concatenate([measured.linear_acceleration, measured.angular_velocity, measured.orientation])
    if isinstance(kind, ForceTorqueSensor):
        return np.concatenate([measured.force, measured.torque])
    if isinstance(kind, EncoderSensor):
        return np.array([measured.position, measured.velocity])
    ranges = np.atleast_1d(np.asarray(measured if isinstance(kind, RangeSensor) else measured.ranges, dtype=np.float64))
    # A range is at its limit if nothing is hit, or if something is too near.
    return np.clip(np.nan_to_num(ranges.ravel(), nan=kind.max, posinf=kind.max, neginf=kind.min), kind.min, kind.max)

# Generated from simd_client/aio/sensors.py by tools/make_blocking.py; do not edit.
"""Sensors of robots, and their readings."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Callable, Iterable
from types import TracebackType
from typing import Any, Generic

from simd_client import keys, proto
from simd_client.blocking.callbacks import Callbacks
from simd_client.blocking.connection import Connection
from simd_client.blocking.watch import SILENCE, Watch
from simd_client.attributes import FixedAttributes
from simd_client.errors import AnswerError, DeadlineExceeded, NoReading, SensorNotFound, listed, not_found
from simd_client.geometry import Pose
from simd_client.measurement import Measured, SensorReading, readings_from_proto
from simd_client.method import decoded
from simd_client.proto import methods
from simd_client.sensor import SensorInfo, SensorKind, SensorNoise, sensor_from_proto, sensor_to_proto
from simd_client.world import Stamp, stamp_from_proto


class Sensor(FixedAttributes, Generic[Measured]):
    """A sensor of a robot."""

    def __init__(self, connection: Connection, robot: str, name: str) -> None:
        self._connection = connection
        self._robot = robot
        self._name = name

    @property
    def robot(self) -> str:
        """The robot's name."""
        return self._robot

    @property
    def name(self) -> str:
        """Its name, unique within the robot."""
        return self._name

    def info(self) -> SensorInfo:
        """Returns its quantity, frame, rate and noise."""
        for each in listed_sensors(self._connection, self._robot):
            if each.name == self._name:
                return each
        message = f"robot `{self._robot}` has no sensor `{self._name}` any more"
        raise not_found(SensorNotFound, message, robot=self._robot, sensor=self._name)

    def read(self) -> SensorReading[Measured]:
        """Returns the newest reading. Waits for ranges that are due. Raises `NoReading` before the first, and
        for a camera."""
        found = newest_readings(self._connection, [proto.SensorSelection(robot=self._robot, sensors=[self._name])])
        newest = found.get((self._robot, self._name))
        if newest is None:
            _refuse_the_silent(self.info())
            raise NoReading(
                f"sensor `{self._name}` of robot `{self._robot}` has no reading yet: the first comes after steps of one period"
            )
        return newest

    def watch(self, rate: float | None = None) -> Watch[SensorReading[Measured]]:
        """Iterates over readings as they are published, at most `rate` per wall second; the newest wins.
        `readings` has each. Its `newest` raises `NoReading` before the first reading; other calls wait for
        it. For a camera all raise it."""
        return _ReadingWatch[Measured](self._connection, self, rate)

    def readings(self, after: int | None = None) -> ReadingStream[Measured]:
        """Iterates over each reading from now on, or after a sequence: 0 gives all that the daemon still
        keeps. Readings lost because this reader was too slow are counted. Raises `NoReading` for a camera."""
        info = self.info()
        _refuse_the_silent(info)
        return ReadingStream(self._connection, self._robot, self._name, info.last_sequence if after is None else after)

    def on_reading(
        self, function: Callable[[SensorReading[Measured]], object], rate: float | None = None
    ) -> Callbacks[SensorReading[Measured]]:
        """Calls a function with the newest reading, and with newer ones, as `watch` gives them."""
        return Callbacks(self._connection.link, self.watch(rate), function)

    def delete(self) -> Stamp:
        """Removes the sensor."""
        return deleted(self._connection, self._robot, self._name)

    def __repr__(self) -> str:
        return f"<Sensor {self._robot}/{self._name}>"


class Sensors(FixedAttributes):
    """The sensors of a robot. They persist across resets, are part of saved states, and are deleted with the
    robot."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._robot = robot

    def create(
        self,
        kind: SensorKind[Measured],
        name: str = "",
        *,
        link: str = "",
        joint: str = "",
        pose: Pose | None = None,
        rate: float | None = None,
        noise: Iterable[SensorNoise] = (),
        seed: int = 0,
    ) -> Sensor[Measured]:
        """Adds a sensor to the robot: on a link (default: the root link) or, for encoders and force-torque
        sensors, on a joint. `pose` is link_from_sensor; `rate` is in samples per simulated second, by default
        one each step. The same `seed` and names give the same noise. Raises `SensorExists`, `LinkNotFound`,
        `JointNotFound`, `InvalidValue`."""
        sensor = sensor_to_proto(self._robot, name, kind, link, joint, pose, rate, seed, noise)
        answer = self._connection.call(methods.CreateSensor, proto.CreateSensorRequest(sensor=sensor))
        return Sensor(self._connection, self._robot, answer.name)

    def list(self) -> tuple[SensorInfo, ...]:
        """Returns quantity, frame, rate and noise of each, in order of creation."""
        return listed_sensors(self._connection, self._robot)

    def get(self, name: str) -> Sensor[Any]:
        """Returns an existing sensor. Raises `SensorNotFound`."""
        known = [each.name for each in self.list()]
        if name not in known:
            message = f"robot `{self._robot}` has no sensor `{name}`; it has {listed(known, name)}"
            raise not_found(SensorNotFound, message, robot=self._robot, sensor=name)
        return Sensor(self._connection, self._robot, name)

    def read(self, *names: str) -> dict[str, SensorReading[Any]]:
        """Returns the newest reading of these sensors, or of all, by name and in one round trip. Waits for
        ranges that are due; a sensor without a reading is left out."""
        selection = proto.SensorSelection(robot=self._robot, sensors=names)
        found = newest_readings(self._connection, [selection])
        return {sensor: reading for (_, sensor), reading in found.items()}

    def delete(self, name: str) -> Stamp:
        """Removes a sensor. Raises `SensorNotFound`."""
        return deleted(self._connection, self._robot, name)


class WorldSensors(FixedAttributes):
    """The sensors of all robots."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def list(self) -> tuple[SensorInfo, ...]:
        """Returns quantity, frame, rate and noise of each, by robot."""
        return listed_sensors(self._connection, "")

    def read(self) -> dict[str, dict[str, SensorReading[Any]]]:
        """Returns the newest reading of each, by robot and sensor, in one round trip."""
        found: dict[str, dict[str, SensorReading[Any]]] = {}
        for (robot, sensor), reading in newest_readings(self._connection, []).items():
            found.setdefault(robot, {})[sensor] = reading
        return found


class ReadingStream(FixedAttributes, Iterator[SensorReading[Measured]], Generic[Measured]):
    """Iterates over each reading of a sensor in order. `missed` of a reading counts readings lost because
    this reader was too slow.

    It needs no `close`: the daemon keeps nothing for it. Belongs to one thread.
    """

    def __init__(self, connection: Connection, robot: str, sensor: str, after: int) -> None:
        self._connection = connection
        self._robot = robot
        self._sensor = sensor
        self._after = after
        self._missed = 0
        self._ahead: deque[SensorReading[Measured]] = deque()
        self._is_open = True

    def __iter__(self) -> ReadingStream[Measured]:
        return self

    def __next__(self) -> SensorReading[Measured]:
        """Returns the next reading."""
        if not self._is_open:
            raise StopIteration
        return self.wait(None)

    def wait(self, timeout: float | None) -> SensorReading[Measured]:
        """Returns the next reading. Raises `DeadlineExceeded` if none arrives within `timeout` seconds."""
        begin = time.monotonic()
        while not self._ahead:
            if not self._is_open:
                raise StopIteration
            left = SILENCE if timeout is None else max(0.0, begin + timeout - time.monotonic())
            self._fetch(min(left, SILENCE))
            if timeout is not None and left == 0.0 and not self._ahead:
                raise DeadlineExceeded(f"no reading came within {timeout:g} s")
        return self._ahead.popleft()

    def close(self) -> None:
        """Ends the iteration."""
        self._is_open = False
        self._ahead.clear()

    def __enter__(self) -> ReadingStream[Measured]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _fetch(self, wait: float) -> None:
        cursor = proto.SensorCursor(robot=self._robot, sensor=self._sensor, after_sequence=self._after)
        request = proto.NextSensorReadingsRequest(sensors=[cursor], timeout=wait)
        answer = self._connection.call(methods.NextSensorReadings, request, wait=wait)
        if len(answer.sensors) != 1:
            raise AnswerError(f"the daemon's answer cannot be understood: it is of {len(answer.sensors)} sensors, not one")
        batch = answer.sensors[0]
        batch.missed += self._missed
        self._ahead.extend(readings_from_proto(batch))
        self._missed = 0 if self._ahead else batch.missed
        self._after = batch.after_sequence


class _ReadingWatch(Watch[SensorReading[Measured]], Generic[Measured]):
    def __init__(self, connection: Connection, sensor: Sensor[Measured], rate: float | None) -> None:
        super().__init__(connection, keys.sensor_readings(connection.name, sensor.robot, sensor.name), rate)
        self._sensor = sensor

    def _read(self, payload: bytes) -> SensorReading[Measured] | None:
        message = decoded(proto.SensorReadings, payload)
        message.missed = 0
        del message.readings[:-1]
        found = readings_from_proto(message)
        return found[0] if found else None

    def wait(self, timeout: float | None) -> SensorReading[Measured]:
        """Returns the next reading. Raises `DeadlineExceeded` if none arrives within `timeout` seconds, and
        `NoReading` for a camera."""
        if self._last is None:
            self._wait_for_the_first(timeout)
        return super().wait(timeout)

    def _ask(self) -> SensorReading[Measured]:
        return self._sensor.read()

    def _wait_for_the_first(self, timeout: float | None) -> None:
        robot, sensor = self._sensor.robot, self._sensor.name
        begin, after = time.monotonic(), 0
        while self._is_open:
            if newest_readings(self._connection, [proto.SensorSelection(robot=robot, sensors=[sensor])]):
                return
            _refuse_the_silent(self._sensor.info())
            left = SILENCE if timeout is None else max(0.0, begin + timeout - time.monotonic())
            if left == 0.0:
                raise DeadlineExceeded(f"no reading came within {timeout:g} s")
            cursor = proto.SensorCursor(robot=robot, sensor=sensor, after_sequence=after)
            request = proto.NextSensorReadingsRequest(sensors=[cursor], timeout=min(left, SILENCE))
            answer = self._connection.call(methods.NextSensorReadings, request, wait=min(left, SILENCE))
            after = max([of.after_sequence for of in answer.sensors], default=after)
        raise StopIteration

    def _order(self, item: SensorReading[Measured]) -> int:
        return item.sequence


def _refuse_the_silent(info: SensorInfo) -> None:
    """Raises `NoReading` for a sensor that never has readings."""
    if info.unavailable:
        raise NoReading(f"sensor `{info.name}` of robot `{info.robot}` has no readings: {info.unavailable}")


def listed_sensors(connection: Connection, robot: str) -> tuple[SensorInfo, ...]:
    """Returns the sensors of a robot, or of all if its name is empty."""
    answer = connection.call(methods.ListSensors, proto.ListSensorsRequest(robot=robot))
    return tuple(sensor_from_proto(each) for each in answer.sensors)


def newest_readings(
    connection: Connection, selections: list[proto.SensorSelection]
) -> dict[tuple[str, str], SensorReading[Any]]:
    """Returns the newest reading of each sensor that has one, by robot and sensor."""
    request = proto.GetSensorReadingsRequest(selections=selections)
    answer = connection.call(methods.GetSensorReadings, request)
    return {(of.robot, of.sensor): reading for of in answer.sensors for reading in readings_from_proto(of)}


def deleted(connection: Connection, robot: str, name: str) -> Stamp:
    """Removes a sensor."""
    request = proto.DeleteSensorRequest(robot=robot, name=name)
    return stamp_from_proto(connection.call(methods.DeleteSensor, request).stamp)

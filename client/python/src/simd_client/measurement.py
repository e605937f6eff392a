"""Readings of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Generic, TypeVar, cast

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.geometry import FloatArray, Pose, Twist, pose_from_proto, twist_from_proto, vector_from_proto
from simd_client.kinematics import Wrench
from simd_client.world import Stamp, stamp_from_proto

Measured = TypeVar("Measured")


@dataclass(frozen=True, eq=False)
class SensorReading(Generic[Measured]):
    """One sample of a sensor."""

    sequence: int
    """Larger than every earlier reading's."""
    sample: int
    """Index among the sensor's samples, from 1. A gap is a lost sample; a reset of time restarts the
    count."""
    stamp: Stamp
    """Stamp of the measured state."""
    measurement: Measured
    missed: int = 0
    """Number of readings before this one that were lost because this reader was too slow; 0 for a `watch`."""


@dataclass(frozen=True, eq=False)
class ImuMeasurement:
    """Reading of an inertial unit, in its axes."""

    linear_acceleration: FloatArray
    """Specific force, m/s^2: at rest 9.81 up, in free fall 0."""
    angular_velocity: FloatArray
    """rad/s."""
    orientation: FloatArray
    """world_from_sensor, a quaternion x y z w."""


@dataclass(frozen=True, eq=False)
class ContactPartner:
    """A link that touches the sensor's link."""

    robot: str
    link: str
    force: FloatArray
    """Force of this link on the sensor's link, world axes, N."""
    normal_force: float
    """The sum of the normal forces of its points, N."""
    depth: float
    """Maximum overlap of the two, metres; negative if they are about to touch."""
    points: int
    """Contact points."""


@dataclass(frozen=True, eq=False)
class ContactMeasurement:
    """Reading of a contact sensor: means over the last step."""

    touching: bool
    """Whether the sum of the normal forces is above the sensor's threshold."""
    force: FloatArray
    """Force of all other links on the link, world axes, N."""
    normal_force: float
    """The sum of the normal forces of all points, N."""
    partners: tuple[ContactPartner, ...]
    """At most 32 of the links that touch it."""
    more_partners: int
    """Number of further links. The sums include them."""


@dataclass(frozen=True, eq=False)
class LidarMeasurement:
    """Reading of a lidar."""

    ranges: npt.NDArray[np.float32]
    """Metres, a row for each vertical angle and a column for each horizontal one. inf: nothing is within the limits;
    -inf: something is nearer (REP 117); NaN: lost."""


@dataclass(frozen=True, eq=False)
class MotionMeasurement:
    """Pose and twist. For a link's state: world_from_sensor, and its twist in world axes. For odometry:
    begin_from_sensor, and its twist in the sensor's axes."""

    pose: Pose
    twist: Twist


@dataclass(frozen=True, eq=False)
class EncoderMeasurement:
    """Reading of an encoder."""

    position: float
    """rad or m."""
    velocity: float
    """rad/s or m/s."""


def readings_from_proto(message: proto.SensorReadings) -> list[SensorReading[Any]]:
    """Readings of one sensor, in order. Each counts the lost readings between its predecessor and itself; the
    first counts all before it."""
    numbers = [each.sequence for each in message.readings]
    gaps = [next_one - number - 1 for number, next_one in pairwise(numbers)]
    missed = [message.missed - sum(gaps), *gaps]
    return [reading_from_proto(each, gone) for each, gone in zip(message.readings, missed)]


def reading_from_proto(message: proto.SensorReading, missed: int = 0) -> SensorReading[Any]:
    """Converts a reading from its message. Its measurement is `None` if only a newer client knows it."""
    return SensorReading(
        sequence=message.sequence,
        sample=message.sample,
        stamp=stamp_from_proto(message.stamp),
        measurement=_measurement(message),
        missed=missed,
    )


def _measurement(message: proto.SensorReading) -> Any:
    kind = cast("str | None", message.WhichOneof("measurement"))
    if kind == "imu":
        turn = message.imu.orientation
        return ImuMeasurement(
            vector_from_proto(message.imu.linear_acceleration),
            vector_from_proto(message.imu.angular_velocity),
            np.array([turn.x, turn.y, turn.z, turn.w]),
        )
    if kind == "force_torque":
        of_joint = message.force_torque
        return Wrench(vector_from_proto(of_joint.force), vector_from_proto(of_joint.torque))
    if kind == "contact":
        return _contact(message.contact)
    if kind == "range":
        return message.range.range
    if kind == "lidar":
        return LidarMeasurement(_grid(message.lidar.ranges, message.lidar.columns))
    if kind == "link_state":
        return MotionMeasurement(pose_from_proto(message.link_state.pose), twist_from_proto(message.link_state.twist))
    if kind == "encoder":
        return EncoderMeasurement(message.encoder.position, message.encoder.velocity)
    if kind == "odometry":
        return MotionMeasurement(pose_from_proto(message.odometry.pose), twist_from_proto(message.odometry.twist))
    return None


def _contact(message: proto.ContactReading) -> ContactMeasurement:
    partners = tuple(
        ContactPartner(
            robot=each.robot,
            link=each.link,
            force=vector_from_proto(each.force),
            normal_force=each.normal_force,
            depth=each.depth,
            points=each.points,
        )
        for each in message.partners
    )
    force = vector_from_proto(message.force)
    return ContactMeasurement(message.touching, force, message.normal_force, partners, message.more_partners)


def _grid(ranges: Sequence[float], columns: int) -> npt.NDArray[np.float32]:
    flat = np.array(ranges, dtype=np.float32)
    return flat.reshape(-1, columns) if columns and flat.size % columns == 0 else flat.reshape(1, -1)

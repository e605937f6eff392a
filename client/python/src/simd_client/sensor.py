"""Sensors: quantity, frame, rate and noise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar, Union, cast

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.enum_word import count_within, enum_name
from simd_client.geometry import FloatArray, Pose, pose_from_proto, pose_to_proto
from simd_client.kinematics import Wrench
from simd_client.measurement import (
    ContactMeasurement,
    EncoderMeasurement,
    ImuMeasurement,
    LidarMeasurement,
    MotionMeasurement,
)

SensorChannel = Literal[
    "linear_acceleration",
    "angular_velocity",
    "orientation",
    "force",
    "torque",
    "position",
    "linear_velocity",
    "joint_position",
    "joint_velocity",
    "range",
]
"""A quantity that a sensor measures."""

WrenchAxes = Literal["child", "parent", "sensor"]
"""Axes of a force-torque sensor: of the joint's child, of its parent, or of the sensor."""

WrenchDirection = Literal["child_to_parent", "parent_to_child"]
"""Direction of the measured force: which link acts on which."""

PictureKind = Literal["color", "depth", "color_and_depth", "segmentation"]
"""Kinds of pictures of a camera."""


@dataclass(frozen=True)
class SensorNoise:
    """Error model of a channel: measured = round((true + bias + walk + normal) / quantum) * quantum, in the
    unit of the channel."""

    channel: SensorChannel
    standard_deviation: float = 0.0
    """Standard deviation of the normal error, drawn for each sample."""
    axis: int | None = None
    """0, 1 or 2 for x, y or z. `None`: all, each with separate errors."""
    bias_mean: float = 0.0
    """Standard deviation of the bias, which is drawn once."""
    bias_standard_deviation: float = 0.0
    random_walk: float = 0.0
    """Standard deviation of the walk after a second. It grows with the square root of time."""
    correlation_time: float | None = None
    """Time constant of the walk in seconds. `None`: never forgotten."""
    quantum: float = 0.0
    """Resolution: values are whole multiples of it. 0: any."""
    dropout: float = 0.0
    """Fraction of lost samples, 0 to 1."""


@dataclass(frozen=True)
class Sweep:
    """Equidistant angles, both ends included."""

    samples: int
    min: float = 0.0
    """rad."""
    max: float = 0.0
    """rad."""

    def angles(self) -> FloatArray:
        """Returns each of them, rad."""
        return np.linspace(self.min, self.max, self.samples, dtype=np.float64)


Gives = TypeVar("Gives", covariant=True)


class SensorKind(Generic[Gives]):
    """Quantity of a sensor."""


@dataclass(frozen=True)
class ImuSensor(SensorKind[ImuMeasurement]):
    """Specific force, angular velocity and orientation."""


@dataclass(frozen=True)
class ForceTorqueSensor(SensorKind[Wrench]):
    """Force and torque that a joint carries, fixed joints included. The torque is about the sensor's
    origin."""

    axes: WrenchAxes = "child"
    direction: WrenchDirection = "child_to_parent"


@dataclass(frozen=True)
class ContactSensor(SensorKind[ContactMeasurement]):
    """Links that touch a link, and their forces."""

    threshold: float = 0.0
    """Threshold in N: the sum of normal forces that counts as contact. 0: any contact."""


@dataclass(frozen=True)
class RangeSensor(SensorKind[float]):
    """One ray along the sensor's x. Its measurements are metres: inf if nothing is within the limits, -inf if
    something is nearer (REP 117), NaN if it is lost."""

    min: float
    """Metres."""
    max: float
    """Metres."""


@dataclass(frozen=True)
class LidarSensor(SensorKind[LidarMeasurement]):
    """Many rays: each vertical angle with each horizontal one."""

    min: float
    """Metres."""
    max: float
    """Metres."""
    horizontal: Sweep
    """About z, from x to y."""
    vertical: Sweep = field(default_factory=lambda: Sweep(1))
    """Up from the plane of x and y."""
    rolling: bool = False
    """Whether it turns once in a period. Column i of n is then from (n - 1 - i) / n periods before the stamp,
    at the sensor's pose of that time."""

    def directions(self) -> FloatArray:
        """Returns directions of the rays in the sensor's axes, of unit length: rows, columns, x y z."""
        up, about = np.meshgrid(self.vertical.angles(), self.horizontal.angles(), indexing="ij")
        return np.stack((np.cos(up) * np.cos(about), np.cos(up) * np.sin(about), np.sin(up)), axis=-1)

    def points(self, ranges: npt.ArrayLike) -> FloatArray:
        """Returns the hits of the rays, in the sensor's axes, one row per hit, metres; rays without a hit
        have none."""
        grid = np.asarray(ranges, dtype=np.float64)
        hit = np.isfinite(grid)
        return self.directions()[hit] * grid[hit][:, None]


@dataclass(frozen=True)
class LinkStateSensor(SensorKind[MotionMeasurement]):
    """Pose and velocity of the sensor in the world: ground truth."""


@dataclass(frozen=True)
class EncoderSensor(SensorKind[EncoderMeasurement]):
    """Position and velocity of a joint with one axis. Its resolution is the `quantum` of its noise."""

    backlash: float = 0.0
    """Backlash: motion of the joint after a reversal before the encoder follows, rad or m."""


@dataclass(frozen=True)
class OdometrySensor(SensorKind[MotionMeasurement]):
    """Pose of the sensor relative to its start."""


@dataclass(frozen=True)
class CameraSensor(SensorKind[None]):
    """A pinhole camera that looks along x. It has pictures and no readings: see `Robot.cameras`."""

    width: int
    """Pixels."""
    height: int
    """Pixels."""
    horizontal_field_of_view: float
    """rad."""
    near: float
    """Near limit of view, metres."""
    far: float
    """Far limit of view, metres."""
    picture: PictureKind = "color"


AnySensorKind = Union[
    ImuSensor,
    ForceTorqueSensor,
    ContactSensor,
    RangeSensor,
    LidarSensor,
    LinkStateSensor,
    EncoderSensor,
    OdometrySensor,
    CameraSensor,
]
"""All kinds of sensors."""


@dataclass(frozen=True)
class SensorInfo:
    """A sensor of a robot."""

    robot: str
    name: str
    kind: AnySensorKind | None
    """`None` for a kind that only a newer client knows."""
    link: str
    """Empty for sensors of a joint."""
    joint: str
    """Empty for sensors of a link."""
    pose: Pose
    """link_from_sensor; a joint sensor uses the joint's child."""
    rate: float | None
    """Samples per simulated second. `None`: one each step."""
    seed: int
    noise: tuple[SensorNoise, ...]
    described: bool
    """Whether it came with the robot's description."""
    last_sequence: int
    """Sequence of its newest reading; before its first, the number below all of its readings."""
    unavailable: str
    """Reason for missing readings; empty if it has readings."""


def sensor_to_proto(
    robot: str,
    name: str,
    kind: SensorKind[Any],
    link: str,
    joint: str,
    pose: Pose | None,
    rate: float | None,
    seed: int,
    noise: Iterable[SensorNoise],
) -> proto.Sensor:
    """Converts a sensor to a message. Raises `TypeError` for an unknown kind, and `ValueError` for an invalid
    word or number."""
    message = proto.Sensor(
        robot=robot,
        name=name,
        link=link,
        joint=joint,
        pose=None if pose is None else pose_to_proto(pose),
        rate=rate,
        seed=count_within("seed", seed, 2**64 - 1),
        noise=[_noise_to_proto(each) for each in noise],
    )
    _set_kind(message, kind)
    return message


def _set_kind(message: proto.Sensor, kind: SensorKind[Any]) -> None:
    if isinstance(kind, ImuSensor):
        message.imu.SetInParent()
    elif isinstance(kind, ForceTorqueSensor):
        axes = proto.WrenchAxes.Value(enum_name("WRENCH_AXES", kind.axes, WrenchAxes, "kind of axes"))
        direction = proto.WrenchDirection.Value(
            enum_name("WRENCH_DIRECTION", kind.direction, WrenchDirection, "direction")
        )
        message.force_torque.CopyFrom(proto.ForceTorqueSensor(axes=axes, direction=direction))  # type: ignore[arg-type]
    elif isinstance(kind, ContactSensor):
        message.contact.CopyFrom(proto.ContactSensor(threshold=kind.threshold))
    elif isinstance(kind, RangeSensor):
        message.range.CopyFrom(proto.RangeSensor(min=kind.min, max=kind.max))
    elif isinstance(kind, LidarSensor):
        message.lidar.CopyFrom(
            proto.LidarSensor(
                horizontal=_sweep_to_proto(kind.horizontal),
                vertical=_sweep_to_proto(kind.vertical),
                range=proto.RangeLimits(min=kind.min, max=kind.max),
                rolling=kind.rolling,
            )
        )
    elif isinstance(kind, LinkStateSensor):
        message.link_state.SetInParent()
    elif isinstance(kind, EncoderSensor):
        message.encoder.CopyFrom(proto.EncoderSensor(backlash=kind.backlash))
    elif isinstance(kind, OdometrySensor):
        message.odometry.SetInParent()
    elif isinstance(kind, CameraSensor):
        message.camera.CopyFrom(
            proto.CameraSensor(
                picture=proto.Picture.Value(enum_name("PICTURE", kind.picture, PictureKind, "kind of picture")),  # type: ignore[arg-type]
                width=kind.width,
                height=kind.height,
                horizontal_field_of_view=kind.horizontal_field_of_view,
                near=kind.near,
                far=kind.far,
            )
        )
    else:
        raise TypeError(f"a sensor is an ImuSensor, a LidarSensor or another kind, not {kind!r}")


def _sweep_to_proto(sweep: Sweep) -> proto.Sweep:
    return proto.Sweep(samples=sweep.samples, min=sweep.min, max=sweep.max)


def _noise_to_proto(noise: SensorNoise) -> proto.SensorNoise:
    channel = proto.SensorChannel.Value(
        enum_name("SENSOR_CHANNEL", noise.channel, SensorChannel, "channel of noise")
    )
    return proto.SensorNoise(
        channel=channel,  # type: ignore[arg-type]
        axis=noise.axis,
        standard_deviation=noise.standard_deviation,
        bias_mean=noise.bias_mean,
        bias_standard_deviation=noise.bias_standard_deviation,
        random_walk=noise.random_walk,
        correlation_time=noise.correlation_time,
        quantum=noise.quantum,
        dropout=noise.dropout,
    )


def sensor_from_proto(message: proto.SensorInfo) -> SensorInfo:
    """Converts from its message."""
    sensor = message.sensor
    return SensorInfo(
        robot=sensor.robot,
        name=sensor.name,
        kind=_kind(sensor),
        link=sensor.link,
        joint=sensor.joint,
        pose=pose_from_proto(sensor.pose),
        rate=sensor.rate if sensor.HasField("rate") else None,
        seed=sensor.seed,
        noise=tuple(_noise(each) for each in sensor.noise),
        described=message.described,
        last_sequence=message.last_sequence,
        unavailable=message.unavailable,
    )


def _kind(sensor: proto.Sensor) -> AnySensorKind | None:
    kind = cast("str | None", sensor.WhichOneof("kind"))
    if kind == "imu":
        return ImuSensor()
    if kind == "force_torque":
        axes = proto.WrenchAxes.Name(sensor.force_torque.axes).removeprefix("WRENCH_AXES_").lower()
        direction = proto.WrenchDirection.Name(sensor.force_torque.direction)
        direction = direction.removeprefix("WRENCH_DIRECTION_").lower()
        return ForceTorqueSensor(cast("WrenchAxes", axes), cast("WrenchDirection", direction))
    if kind == "contact":
        return ContactSensor(sensor.contact.threshold)
    if kind == "range":
        return RangeSensor(sensor.range.min, sensor.range.max)
    if kind == "lidar":
        lidar, limits = sensor.lidar, sensor.lidar.range
        return LidarSensor(limits.min, limits.max, _sweep(lidar.horizontal), _sweep(lidar.vertical), lidar.rolling)
    if kind == "link_state":
        return LinkStateSensor()
    if kind == "encoder":
        return EncoderSensor(sensor.encoder.backlash)
    if kind == "odometry":
        return OdometrySensor()
    if kind == "camera":
        camera = sensor.camera
        picture = proto.Picture.Name(camera.picture).removeprefix("PICTURE_").lower()
        angle = camera.horizontal_field_of_view
        return CameraSensor(camera.width, camera.height, angle, camera.near, camera.far, cast("PictureKind", picture))
    return None


def _sweep(message: proto.Sweep) -> Sweep:
    return Sweep(message.samples, message.min, message.max)


def _noise(message: proto.SensorNoise) -> SensorNoise:
    channel = proto.SensorChannel.Name(message.channel).removeprefix("SENSOR_CHANNEL_").lower()
    return SensorNoise(
        channel=cast("SensorChannel", channel),
        standard_deviation=message.standard_deviation,
        axis=message.axis if message.HasField("axis") else None,
        bias_mean=message.bias_mean,
        bias_standard_deviation=message.bias_standard_deviation,
        random_walk=message.random_walk,
        correlation_time=message.correlation_time if message.HasField("correlation_time") else None,
        quantum=message.quantum,
        dropout=message.dropout,
    )

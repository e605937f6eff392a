//! Requests of the sensor service.

use std::time::Duration;

use glamx::DPose3;
use simd_core::simulation::command::CreateSensor;
use simd_model::sensor::{
    Camera, ChannelNoise, Channels, Noise, Picture, RangeLimits, Scan, SensorKind, Sweep, WrenchAxes,
    WrenchDirection,
};
use simd_proto::v1::{self, sensor::Kind};

use super::geometry;
use crate::convert::field::{BadField, Path};
use simd_world::handle::{MAX_WATCHED_SENSORS, SensorCursor, SensorSelection};

/// Parses a sensor to create. The core checks its numbers, and names them by their paths within `sensor`.
pub fn create(request: v1::CreateSensorRequest) -> Result<CreateSensor, BadField> {
    let v1::CreateSensorRequest { sensor, request_id: _, claim: _ } = request;
    let at = Path::ROOT.field("sensor");
    let v1::Sensor { robot, name, link, joint, pose, rate, seed, noise, kind } = at.given(sensor)?;
    let pose = pose.map(|pose| geometry::pose(&at.field("pose"), pose)).transpose()?;
    let noise = noise.into_iter().enumerate();
    Ok(CreateSensor {
        robot: at.field("robot").name(robot)?,
        name: at.field("name").short(name)?,
        link: at.field("link").short(link)?,
        joint: at.field("joint").short(joint)?,
        pose: pose.unwrap_or(DPose3::IDENTITY),
        rate,
        kind: self::kind(&at, at.field("kind").given(kind)?)?,
        noise: noise
            .map(|(index, noise)| channel_noise(&at.item("noise", index), noise))
            .collect::<Result<_, _>>()?,
        seed: Some(seed),
    })
}

/// Accepts the names of a robot and of a sensor.
pub fn delete(request: v1::DeleteSensorRequest) -> Result<(String, String), BadField> {
    let v1::DeleteSensorRequest { robot, name, request_id: _, claim: _ } = request;
    Ok((Path::ROOT.field("robot").name(robot)?, Path::ROOT.field("name").name(name)?))
}

/// Returns the robot whose sensors are requested, or `None` for all robots.
pub fn only(request: v1::ListSensorsRequest) -> Result<Option<String>, BadField> {
    let robot = Path::ROOT.field("robot").short(request.robot)?;
    Ok((!robot.is_empty()).then_some(robot))
}

/// Parses the sensors whose newest readings are requested, and the longest wait for scans.
pub fn newest(request: v1::GetSensorReadingsRequest) -> Result<(Vec<SensorSelection>, Duration), BadField> {
    let v1::GetSensorReadingsRequest { selections, timeout } = request;
    let timeout = Path::ROOT.field("timeout").seconds(timeout, 0.001..=60.0, 1.0)?;
    Ok((self::selections("selections", selections)?, timeout))
}

/// Parses the sensors whose readings are followed, and the longest wait for the first reading.
pub fn next(request: v1::NextSensorReadingsRequest) -> Result<(Vec<SensorCursor>, Duration), BadField> {
    let v1::NextSensorReadingsRequest { sensors, timeout } = request;
    let timeout = Path::ROOT.field("timeout").seconds(timeout, 0.0..=60.0, 0.0)?;
    if !(1..=MAX_WATCHED_SENSORS).contains(&sensors.len()) {
        let expected = format!("there must be 1 to {MAX_WATCHED_SENSORS}");
        return Err(Path::ROOT
            .field("sensors")
            .refuse(format_args!("a list of {}", sensors.len()), expected));
    }
    let cursor = |(index, cursor): (usize, v1::SensorCursor)| {
        let at = Path::ROOT.item("sensors", index);
        let v1::SensorCursor { robot, sensor, after_sequence: after } = cursor;
        Ok(SensorCursor {
            robot: at.field("robot").name(robot)?,
            sensor: at.field("sensor").name(sensor)?,
            after,
        })
    };
    let cursors = sensors.into_iter().enumerate().map(cursor).collect::<Result<Vec<_>, BadField>>()?;
    Path::ROOT.each_once("sensors", cursors.iter().map(|cursor| (&cursor.robot, &cursor.sensor)))?;
    Ok((cursors, timeout))
}

/// Parses the sensors whose readings are watched, and the time between two messages.
pub fn watch(request: v1::WatchSensorReadingsRequest) -> Result<(Vec<SensorSelection>, Duration), BadField> {
    let v1::WatchSensorReadingsRequest { selections, rate } = request;
    let rate = if rate == 0.0 { 50.0 } else { Path::ROOT.field("rate").within(rate, 0.1..=1000.0)? };
    Ok((self::selections("selections", selections)?, Duration::from_secs_f64(1.0 / rate)))
}

/// Parses the sensors whose newest readings accompany states.
pub fn beside(sensors: Vec<v1::SensorSelection>) -> Result<Vec<SensorSelection>, BadField> {
    selections("sensors", sensors)
}

/// Parses a selection of sensors. A robot or a sensor named twice is refused, so that no answer is larger
/// than the world.
fn selections(field: &str, given: Vec<v1::SensorSelection>) -> Result<Vec<SensorSelection>, BadField> {
    let mut out = Vec::with_capacity(given.len());
    for (index, v1::SensorSelection { robot, sensors }) in given.into_iter().enumerate() {
        let at = Path::ROOT.item(field, index);
        let robot = at.field("robot").name(robot)?;
        let sensors = sensors.into_iter().enumerate();
        let sensors = sensors
            .map(|(index, sensor)| at.item("sensors", index).name(sensor))
            .collect::<Result<Vec<_>, _>>()?;
        at.each_once("sensors", &sensors)?;
        out.push(SensorSelection { robot, sensors });
    }
    Path::ROOT.each_once(field, out.iter().map(|selection| &selection.robot))?;
    Ok(out)
}

fn kind(at: &Path<'_>, kind: Kind) -> Result<SensorKind, BadField> {
    Ok(match kind {
        Kind::Imu(v1::ImuSensor {}) => SensorKind::Imu,
        Kind::ForceTorque(v1::ForceTorqueSensor { axes, direction }) => {
            let at = at.field("force_torque");
            let axes = match at.field("axes").known(axes)? {
                v1::WrenchAxes::Unspecified | v1::WrenchAxes::Child => WrenchAxes::Child,
                v1::WrenchAxes::Parent => WrenchAxes::Parent,
                v1::WrenchAxes::Sensor => WrenchAxes::Sensor,
            };
            let direction = match at.field("direction").known(direction)? {
                v1::WrenchDirection::Unspecified | v1::WrenchDirection::ChildToParent => {
                    WrenchDirection::ChildOnParent
                }
                v1::WrenchDirection::ParentToChild => WrenchDirection::ParentOnChild,
            };
            SensorKind::ForceTorque { axes, direction }
        }
        Kind::Contact(v1::ContactSensor { threshold }) => SensorKind::Contact { threshold },
        Kind::Range(v1::RangeSensor { min: least, max: most }) => {
            SensorKind::Range(RangeLimits { least, most })
        }
        Kind::Lidar(v1::LidarSensor { horizontal, vertical, range, rolling }) => {
            let at = at.field("lidar");
            let v1::RangeLimits { min: least, max: most } = at.field("range").given(range)?;
            SensorKind::Lidar(Scan {
                horizontal: sweep(at.field("horizontal").given(horizontal)?),
                vertical: vertical.map_or(Sweep::one(0.0), sweep),
                range: RangeLimits { least, most },
                rolling,
            })
        }
        Kind::LinkState(v1::LinkStateSensor {}) => SensorKind::LinkState,
        Kind::Encoder(v1::EncoderSensor { backlash }) => SensorKind::Encoder { backlash },
        Kind::Odometry(v1::OdometrySensor {}) => SensorKind::Odometry,
        Kind::Camera(v1::CameraSensor { picture, width, height, horizontal_field_of_view, near, far }) => {
            let picture = match at.field("camera").field("picture").known(picture)? {
                v1::Picture::Unspecified | v1::Picture::Color => Picture::Color,
                v1::Picture::Depth => Picture::Depth,
                v1::Picture::ColorAndDepth => Picture::ColorAndDepth,
                v1::Picture::Segmentation => Picture::Segmentation,
            };
            SensorKind::Camera(Camera { picture, width, height, horizontal_field_of_view, near, far })
        }
    })
}

fn sweep(v1::Sweep { samples, min: least, max: most }: v1::Sweep) -> Sweep {
    Sweep { samples, least, most }
}

fn channel_noise(at: &Path<'_>, given: v1::SensorNoise) -> Result<ChannelNoise, BadField> {
    let v1::SensorNoise {
        channel,
        axis,
        standard_deviation,
        bias_mean,
        bias_standard_deviation,
        random_walk,
        correlation_time,
        quantum,
        dropout,
    } = given;
    let at_channel = at.field("channel");
    let channels = match at_channel.known(channel)? {
        v1::SensorChannel::Unspecified => return Err(at_channel.refuse("not given", "it must be given")),
        v1::SensorChannel::LinearAcceleration => Channels::LinearAcceleration,
        v1::SensorChannel::AngularVelocity => Channels::AngularVelocity,
        v1::SensorChannel::Orientation => Channels::Orientation,
        v1::SensorChannel::Force => Channels::Force,
        v1::SensorChannel::Torque => Channels::Torque,
        v1::SensorChannel::Position => Channels::Position,
        v1::SensorChannel::LinearVelocity => Channels::LinearVelocity,
        v1::SensorChannel::JointPosition => Channels::JointPosition,
        v1::SensorChannel::JointVelocity => Channels::JointVelocity,
        v1::SensorChannel::Range => Channels::Range,
    };
    let axis = axis
        .map(|axis| u8::try_from(axis).map_err(|_| at.field("axis").refuse(axis, "it must be 0, 1 or 2")))
        .transpose()?;
    let noise = Noise {
        standard_deviation,
        bias_mean,
        bias_standard_deviation,
        random_walk,
        correlation_time,
        quantum,
        dropout,
    };
    Ok(ChannelNoise { channels, axis, noise })
}

//! Answers of the sensor service.

use simd_core::simulation::measure::{ImuMeasurement, MotionMeasurement, WrenchMeasurement};
use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::{
    Camera, ChannelNoise, Channels, Noise, Picture, RangeLimits, Scan, SensorKind, SensorMount, Sweep,
    WrenchAxes, WrenchDirection,
};
use simd_proto::v1::{self, sensor::Kind, sensor_reading::Measurement};

use super::geometry::{pose, twist, vector};
use super::stamp;
use simd_world::handle::{
    ContactReading, LoggedReading, Measured, NamedContactPartner, Published, ReadingBatch, SensorReadings,
};

/// Reason why a camera has no readings.
const PICTURES: &str =
    "a camera has pictures instead of readings: ask for them with GetPicture, or `simctl camera view`";

/// Converts a sensor of a published state; `last_sequence` is the number of its newest reading.
pub fn info(state: &Published, sensor: &WorldSensor, last_sequence: u64) -> v1::SensorInfo {
    let is_camera = matches!(sensor.definition.kind, SensorKind::Camera(_));
    v1::SensorInfo {
        sensor: Some(definition(state, sensor)),
        last_sequence,
        described: sensor.definition.is_described,
        unavailable: if is_camera { PICTURES } else { "" }.to_owned(),
    }
}

fn definition(state: &Published, sensor: &WorldSensor) -> v1::Sensor {
    let of = &*sensor.definition;
    let entity = state.state.world.entities.get(sensor.robot);
    let (link, joint) = match of.on {
        SensorMount::Link(link) => {
            (entity.and_then(|entity| entity.model.links.get(link)).map(|link| link.name.clone()), None)
        }
        SensorMount::Joint(joint) => {
            (None, entity.and_then(|entity| entity.model.joints.get(joint)).map(|joint| joint.name.clone()))
        }
    };
    v1::Sensor {
        robot: entity.map(|entity| entity.name.clone()).unwrap_or_default(),
        name: of.name.clone(),
        link: link.unwrap_or_default(),
        joint: joint.unwrap_or_default(),
        pose: Some(pose(of.pose)),
        rate: of.rate,
        seed: of.seed,
        noise: of.noise.iter().map(channel_noise).collect(),
        kind: Some(kind(of.kind)),
    }
}

/// Converts the kind of a sensor.
pub(super) fn kind(kind: SensorKind) -> Kind {
    match kind {
        SensorKind::Imu => Kind::Imu(v1::ImuSensor {}),
        SensorKind::ForceTorque { axes, direction } => {
            let axes = match axes {
                WrenchAxes::Child => v1::WrenchAxes::Child,
                WrenchAxes::Parent => v1::WrenchAxes::Parent,
                WrenchAxes::Sensor => v1::WrenchAxes::Sensor,
            };
            let direction = match direction {
                WrenchDirection::ChildOnParent => v1::WrenchDirection::ChildToParent,
                WrenchDirection::ParentOnChild => v1::WrenchDirection::ParentToChild,
            };
            Kind::ForceTorque(v1::ForceTorqueSensor { axes: axes.into(), direction: direction.into() })
        }
        SensorKind::Contact { threshold } => Kind::Contact(v1::ContactSensor { threshold }),
        SensorKind::Range(RangeLimits { least, most }) => {
            Kind::Range(v1::RangeSensor { min: least, max: most })
        }
        SensorKind::Lidar(Scan { horizontal, vertical, range, rolling }) => Kind::Lidar(v1::LidarSensor {
            horizontal: Some(sweep(horizontal)),
            vertical: Some(sweep(vertical)),
            range: Some(v1::RangeLimits { min: range.least, max: range.most }),
            rolling,
        }),
        SensorKind::LinkState => Kind::LinkState(v1::LinkStateSensor {}),
        SensorKind::Encoder { backlash } => Kind::Encoder(v1::EncoderSensor { backlash }),
        SensorKind::Odometry => Kind::Odometry(v1::OdometrySensor {}),
        SensorKind::Camera(Camera { picture, width, height, horizontal_field_of_view, near, far }) => {
            let picture = match picture {
                Picture::Color => v1::Picture::Color,
                Picture::Depth => v1::Picture::Depth,
                Picture::ColorAndDepth => v1::Picture::ColorAndDepth,
                Picture::Segmentation => v1::Picture::Segmentation,
            };
            let picture = picture.into();
            Kind::Camera(v1::CameraSensor { picture, width, height, horizontal_field_of_view, near, far })
        }
    }
}

fn sweep(Sweep { samples, least: min, most: max }: Sweep) -> v1::Sweep {
    v1::Sweep { samples, min, max }
}

fn channel_noise(of: &ChannelNoise) -> v1::SensorNoise {
    let ChannelNoise { channels, axis, noise } = *of;
    let channel = match channels {
        Channels::LinearAcceleration => v1::SensorChannel::LinearAcceleration,
        Channels::AngularVelocity => v1::SensorChannel::AngularVelocity,
        Channels::Orientation => v1::SensorChannel::Orientation,
        Channels::Force => v1::SensorChannel::Force,
        Channels::Torque => v1::SensorChannel::Torque,
        Channels::Position => v1::SensorChannel::Position,
        Channels::LinearVelocity => v1::SensorChannel::LinearVelocity,
        Channels::JointPosition => v1::SensorChannel::JointPosition,
        Channels::JointVelocity => v1::SensorChannel::JointVelocity,
        Channels::Range => v1::SensorChannel::Range,
    };
    let Noise {
        standard_deviation,
        bias_mean,
        bias_standard_deviation,
        random_walk,
        correlation_time,
        quantum,
        dropout,
    } = noise;
    v1::SensorNoise {
        channel: channel.into(),
        axis: axis.map(u32::from),
        standard_deviation,
        bias_mean,
        bias_standard_deviation,
        random_walk,
        correlation_time,
        quantum,
        dropout,
    }
}

/// Converts readings of one sensor.
pub fn readings(of: SensorReadings) -> v1::SensorReadings {
    let SensorReadings { robot, sensor, batch: ReadingBatch { readings, missed, after } } = of;
    let readings = readings.into_iter().map(reading).collect();
    v1::SensorReadings { robot, sensor, readings, missed, after_sequence: after }
}

/// Converts a reading.
pub fn reading(of: LoggedReading) -> v1::SensorReading {
    let LoggedReading { sequence, sample, at, wall_time, state_sequence, measured } = of;
    v1::SensorReading {
        sequence,
        sample,
        stamp: Some(stamp::stamp(at, Some(wall_time), state_sequence)),
        measurement: Some(measurement(&measured)),
    }
}

fn measurement(measured: &Measured) -> Measurement {
    match measured {
        Measured::Imu(ImuMeasurement { linear_acceleration, angular_velocity, orientation }) => {
            let [x, y, z, w] = orientation.to_array();
            Measurement::Imu(v1::ImuReading {
                linear_acceleration: Some(vector(*linear_acceleration)),
                angular_velocity: Some(vector(*angular_velocity)),
                orientation: Some(v1::Quaternion { x, y, z, w }),
            })
        }
        Measured::ForceTorque(WrenchMeasurement { force, torque }) => {
            Measurement::ForceTorque(v1::WrenchReading {
                force: Some(vector(*force)),
                torque: Some(vector(*torque)),
            })
        }
        Measured::Contact(touch) => Measurement::Contact(contact(touch)),
        Measured::Range(range) => Measurement::Range(v1::RangeReading { range: *range }),
        Measured::Lidar { ranges, columns, period: _ } => {
            Measurement::Lidar(v1::LidarReading { ranges: ranges.to_vec(), columns: *columns })
        }
        Measured::LinkState(MotionMeasurement { pose: at, linear, angular }) => {
            let (pose, twist) = (Some(pose(*at)), Some(twist(*linear, *angular)));
            Measurement::LinkState(v1::LinkStateReading { pose, twist })
        }
        Measured::Encoder(encoder) => Measurement::Encoder(v1::EncoderReading {
            position: encoder.position,
            velocity: encoder.velocity,
        }),
        Measured::Odometry(MotionMeasurement { pose: at, linear, angular }) => {
            let (pose, twist) = (Some(pose(*at)), Some(twist(*linear, *angular)));
            Measurement::Odometry(v1::OdometryReading { pose, twist })
        }
    }
}

fn contact(touch: &ContactReading) -> v1::ContactReading {
    let ContactReading { touching, force, normal_force, partners, more_partners } = touch;
    let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    let partner = |partner: &NamedContactPartner| {
        let NamedContactPartner { robot, link, force, normal_force, depth, points } = partner;
        v1::ContactPartner {
            robot: robot.clone(),
            link: link.clone(),
            force: Some(vector(*force)),
            normal_force: *normal_force,
            depth: *depth,
            points: count(*points),
        }
    };
    v1::ContactReading {
        touching: *touching,
        force: Some(vector(*force)),
        normal_force: *normal_force,
        partners: partners.iter().map(partner).collect(),
        more_partners: count(*more_partners),
    }
}

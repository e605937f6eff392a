//! Readings of sensors.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};

use crate::simulation::moment::Moment;
use crate::simulation::published_state::WorldLayout;
use crate::simulation::sensors::SensorDefinition;

/// Maximum number of links that the reading of a contact sensor lists.
pub const MAX_CONTACT_PARTNERS: usize = 32;

/// One sample of a sensor.
#[derive(Clone, Debug)]
pub struct SensorReading {
    /// Sensor, by [`WorldSensor::id`](super::super::sensors::WorldSensor::id).
    pub id: u64,
    /// Definition of the sensor.
    pub definition: Arc<SensorDefinition>,
    /// Robot in `world`, by index.
    pub robot: usize,
    /// Layout of the world to which indices refer.
    pub world: Arc<WorldLayout>,
    /// Count of the sensor's samples from 1, including lost ones. Restarts with an epoch.
    pub sample: u64,
    /// Moment of the state.
    pub at: Moment,
    /// Time between samples, seconds.
    pub period: f64,
    /// Measurement, with noise.
    pub measurement: Measurement,
}

/// Measurement by type of sensor.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurement {
    /// Measurement of an IMU.
    Imu(ImuMeasurement),
    /// Measurement of a force-torque sensor.
    ForceTorque(WrenchMeasurement),
    /// Measurement of a contact sensor.
    Contact(ContactMeasurement),
    /// Range of a range finder, metres: infinite if nothing is in range, minus infinity if it is too near,
    /// NaN if it was lost.
    Range(f64),
    /// Range of each ray of a lidar, in the order of [`Scan`](simd_model::sensor::Scan).
    Lidar(Vec<f32>),
    /// State of a link: `world_from_sensor`, and the twist in world axes.
    LinkState(MotionMeasurement),
    /// Measurement of an encoder.
    Encoder(EncoderMeasurement),
    /// Odometry: `start_from_sensor`, and the twist in the sensor's own axes.
    Odometry(MotionMeasurement),
}

/// Measurement of an inertial unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuMeasurement {
    /// Specific force: acceleration less gravity, in the sensor's axes, m/s^2. At rest 9.81 upwards, in free
    /// fall zero.
    pub linear_acceleration: DVec3,
    /// Angular velocity in the sensor's axes, rad/s.
    pub angular_velocity: DVec3,
    /// Orientation `world_from_sensor`.
    pub orientation: DQuat,
}

/// Measurement of a force-torque sensor, in its configured axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchMeasurement {
    /// Force, N.
    pub force: DVec3,
    /// Torque about the sensor's origin, N m.
    pub torque: DVec3,
}

/// Measurement of a contact sensor: means over the last step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactMeasurement {
    /// Whether the sum of all normal forces is above the sensor's threshold.
    pub touching: bool,
    /// Force on the link, world axes, N.
    pub force: DVec3,
    /// Sum of the normal forces of all points, N.
    pub normal_force: f64,
    /// Links that touch it, in the order of robots and links; at most [`MAX_CONTACT_PARTNERS`].
    pub partners: Vec<ContactPartner>,
    /// Number of further links.
    pub more_partners: usize,
}

/// A link that touches the sensor's link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPartner {
    /// Robot in [`SensorReading::world`], by index.
    pub robot: usize,
    /// Link in that robot's model, by index.
    pub link: usize,
    /// Force of it on the sensor's link, world axes, N.
    pub force: DVec3,
    /// Sum of the normal forces of its points, N.
    pub normal_force: f64,
    /// Largest overlap of the two, metres; negative if they are about to touch.
    pub depth: f64,
    /// Number of contact points.
    pub points: usize,
}

/// Pose and motion of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionMeasurement {
    /// Pose of the sensor.
    pub pose: DPose3,
    /// Velocity of its origin, m/s.
    pub linear: DVec3,
    /// Angular velocity, rad/s.
    pub angular: DVec3,
}

/// Measurement of an encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderMeasurement {
    /// Position, rad or m.
    pub position: f64,
    /// Velocity, rad/s or m/s.
    pub velocity: f64,
}

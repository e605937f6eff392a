//! What sensors measured.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};

use crate::simulation::moment::Moment;
use crate::simulation::published_state::WorldLayout;
use crate::simulation::sensors::SensorDefinition;

/// Links that the reading of a sensor of contact lists at the most.
pub const MAX_CONTACT_PARTNERS: usize = 32;

/// One sample of a sensor.
#[derive(Clone, Debug)]
pub struct SensorReading {
    /// Which sensor: [`WorldSensor::id`](super::super::sensors::WorldSensor::id).
    pub id: u64,
    /// What it is.
    pub definition: Arc<SensorDefinition>,
    /// Index of its robot in `world`.
    pub robot: usize,
    /// The robots that there were: indices are of these.
    pub world: Arc<WorldLayout>,
    /// Counts the sensor's samples from 1, lost ones too. Begins anew where an epoch does.
    pub sample: u64,
    /// Of which state it is.
    pub at: Moment,
    /// From one sample to the next, seconds.
    pub period: f64,
    /// What was measured, with noise.
    pub measurement: Measurement,
}

/// What was measured, by kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurement {
    /// Of an IMU.
    Imu(ImuMeasurement),
    /// Of a sensor of force and torque.
    ForceTorque(WrenchMeasurement),
    /// Of a sensor of contact.
    Contact(ContactMeasurement),
    /// Of a range finder: metres; infinite where nothing is in reach, minus infinity where it is too near, NaN where it was lost.
    Range(f64),
    /// Of a lidar: the same of each ray, in the order of [`Scan`](simd_model::sensor::Scan).
    Lidar(Vec<f32>),
    /// Of a link's state: `world_from_sensor`, and the twist in world axes.
    LinkState(MotionMeasurement),
    /// Of an encoder.
    Encoder(EncoderMeasurement),
    /// Of odometry: `start_from_sensor`, and the twist in the sensor's own axes.
    Odometry(MotionMeasurement),
}

/// What an inertial unit measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuMeasurement {
    /// The specific force: acceleration less gravity, in the sensor's axes, m/s^2. At rest 9.81 upwards, in free fall zero.
    pub linear_acceleration: DVec3,
    /// In the sensor's axes, rad/s.
    pub angular_velocity: DVec3,
    /// `world_from_sensor`.
    pub orientation: DQuat,
}

/// What a sensor of force and torque measures, in the axes that it is to be in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchMeasurement {
    /// N.
    pub force: DVec3,
    /// About the sensor's origin, N m.
    pub torque: DVec3,
}

/// What a sensor of contact measures: means over the last step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactMeasurement {
    /// The sum of all normal forces is above the sensor's threshold.
    pub touching: bool,
    /// On the link, world axes, N.
    pub force: DVec3,
    /// The sum of the normal forces of all points, N.
    pub normal_force: f64,
    /// Who touches it, in the order of robots and links; at most [`MAX_CONTACT_PARTNERS`].
    pub partners: Vec<ContactPartner>,
    /// Those that are not listed.
    pub more_partners: usize,
}

/// A link that touches the sensor's link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPartner {
    /// Index of its robot in [`SensorReading::world`].
    pub robot: usize,
    /// Its index in that robot's model.
    pub link: usize,
    /// Of it on the sensor's link, world axes, N.
    pub force: DVec3,
    /// The sum of the normal forces of its points, N.
    pub normal_force: f64,
    /// How far the two overlap at the most, metres; negative where they are about to touch.
    pub depth: f64,
    /// Points at which they touch.
    pub points: usize,
}

/// Where a sensor is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionMeasurement {
    /// Of the sensor.
    pub pose: DPose3,
    /// Of its origin, m/s.
    pub linear: DVec3,
    /// rad/s.
    pub angular: DVec3,
}

/// What an encoder measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderMeasurement {
    /// rad or m.
    pub position: f64,
    /// rad/s or m/s.
    pub velocity: f64,
}

//! The command that makes sensors.

use glamx::DPose3;
use serde::{Deserialize, Serialize};
use simd_model::sensor::{ChannelNoise, SensorKind};

use crate::plain::pose3;

/// A sensor to make. Its first sample falls due one period after the moment of the command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CreateSensor {
    /// Its robot's name.
    pub robot: String,
    /// Unique in the robot; `[A-Za-z0-9_-]+`. Empty: its kind with a number, as `imu_1`.
    pub name: String,
    /// The link that it sits on; empty: the root link. Not for kinds that are on a joint.
    pub link: String,
    /// For encoders and sensors of force and torque: the joint.
    pub joint: String,
    /// `link_from_sensor`; of a sensor on a joint in the frame of the joint's child.
    #[serde(with = "pose3")]
    pub pose: DPose3,
    /// Samples in a second of sim time, above 0. `None`, or more than there are steps: one each step.
    pub rate: Option<f64>,
    /// What it measures.
    pub kind: SensorKind,
    /// Of its channels; the later ones win.
    pub noise: Vec<ChannelNoise>,
    /// What its noise is drawn from. `None`: a number that follows from the names of robot and sensor.
    pub seed: Option<u64>,
}

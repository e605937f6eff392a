//! Command that creates sensors.

use glamx::DPose3;
use serde::{Deserialize, Serialize};
use simd_model::sensor::{ChannelNoise, SensorKind};

use crate::plain::pose3;

/// Sensor to create. Its first sample is due one period after the moment of the command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CreateSensor {
    /// Name of the robot.
    pub robot: String,
    /// Name, unique in the robot; `[A-Za-z0-9_-]+`. Empty means its type with a number, as `imu_1`.
    pub name: String,
    /// Link that it is mounted on; empty means the root link. Not for types that are mounted on a joint.
    pub link: String,
    /// Joint, for encoders and force-torque sensors.
    pub joint: String,
    /// Pose `link_from_sensor`; for a sensor on a joint in the frame of the joint's child.
    #[serde(with = "pose3")]
    pub pose: DPose3,
    /// Samples per second of sim time, above 0. `None`, or more than the steps per second, means one each
    /// step.
    pub rate: Option<f64>,
    /// Type of sensor.
    pub kind: SensorKind,
    /// Noise of its channels; later entries win.
    pub noise: Vec<ChannelNoise>,
    /// Seed of its noise. `None` means a number derived from the names of robot and sensor.
    pub seed: Option<u64>,
}

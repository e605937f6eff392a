//! Definition of a sensor, which only commands change.

use std::sync::Arc;

use glamx::DPose3;
use serde::{Deserialize, Serialize};
use simd_model::sensor::{ChannelNoise, MAX_CHANNEL_NOISE, SensorKind, SensorMount};

use crate::plain::{bounded_list, pose3};

/// A sensor of a robot. It is immutable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorDefinition {
    /// Name, unique in its robot; `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Mount of the sensor; indices refer to the robot's model.
    pub on: SensorMount,
    /// Link whose frame `pose` is in; for a sensor on a joint, the joint's child.
    pub link: usize,
    /// Pose `link_from_sensor`.
    #[serde(with = "pose3")]
    pub pose: DPose3,
    /// Samples per second of sim time. `None`, or more than the steps per second, means one each step.
    pub rate: Option<f64>,
    /// Type of sensor.
    pub kind: SensorKind,
    /// Noise of its channels; later entries win.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_CHANNEL_NOISE, _, _>")]
    pub noise: Vec<ChannelNoise>,
    /// Seed of its noise.
    pub seed: u64,
    /// Whether it comes from the robot's description, and not from a client.
    pub is_described: bool,
}

/// Published form of a sensor.
#[derive(Clone, Debug)]
pub struct WorldSensor {
    /// Identifier, which no other sensor of this world had before. It is not part of the state: a sensor from
    /// a file gets another one.
    pub id: u64,
    /// Robot, by index in [`WorldLayout::entities`](super::super::published_state::WorldLayout::entities).
    pub robot: usize,
    /// Definition of the sensor.
    pub definition: Arc<SensorDefinition>,
}

//! What a sensor is, until a command changes it.

use std::sync::Arc;

use glamx::DPose3;
use serde::{Deserialize, Serialize};
use simd_model::sensor::{ChannelNoise, MAX_CHANNEL_NOISE, SensorKind, SensorMount};

use crate::plain::{bounded_list, pose3};

/// A sensor of a robot. It does not change while it is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorDefinition {
    /// Unique in its robot; `[A-Za-z0-9_-]+`.
    pub name: String,
    /// What it is on; indices are of the robot's model.
    pub on: SensorMount,
    /// The link whose frame `pose` is in: of a sensor on a joint the joint's child.
    pub link: usize,
    /// `link_from_sensor`.
    #[serde(with = "pose3")]
    pub pose: DPose3,
    /// Samples in a second of sim time. `None`, or more than there are steps: one each step.
    pub rate: Option<f64>,
    /// What it measures.
    pub kind: SensorKind,
    /// Of its channels; the later ones win.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_CHANNEL_NOISE, _, _>")]
    pub noise: Vec<ChannelNoise>,
    /// What its noise is drawn from.
    pub seed: u64,
    /// The robot's description has it, and no client made it.
    pub is_described: bool,
}

/// A sensor as it is published.
#[derive(Clone, Debug)]
pub struct WorldSensor {
    /// Unlike that of any other sensor of this world before it. It is no part of the state: one that came from a file has another.
    pub id: u64,
    /// Index of its robot in [`WorldLayout::entities`](super::super::published_state::WorldLayout::entities).
    pub robot: usize,
    /// What it is.
    pub definition: Arc<SensorDefinition>,
}

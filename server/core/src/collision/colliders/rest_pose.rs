//! Where colliders are while their robot sleeps.

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use super::{Bounds, Placed, RobotColliders};
use crate::plain::{pose3, vector3};

/// Where a collider of a robot that sleeps rests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestPose {
    /// World from the shape, in parry's axes for it.
    #[serde(with = "pose3")]
    pub world_from_shape: DPose3,
    /// How far around it contacts are looked for, metres.
    pub margin: f64,
    /// As much of that as is for its motion without turning, along that motion.
    #[serde(with = "vector3")]
    pub drift: DVec3,
}

impl RobotColliders {
    /// The pose of each, and how far around it contacts are looked for: what a step reads of a robot
    /// that sleeps, whose colliders keep the poses of the step in which it fell asleep.
    pub fn save_poses(&self) -> impl Iterator<Item = RestPose> + '_ {
        self.placed.iter().zip(&self.frames).map(|(&Placed { margin, drift, .. }, frame)| RestPose {
            world_from_shape: frame.world_from_shape,
            margin,
            drift,
        })
    }

    /// Gives each a saved pose; there is one for each.
    pub fn restore_poses(&mut self, poses: &[RestPose]) {
        self.bounds = Bounds::default();
        self.is_any_lost = false;
        for ((placed, frame), rest) in self.placed.iter_mut().zip(&mut self.frames).zip(poses) {
            // What sleeps is slow: its margin is not bounded.
            let RestPose { world_from_shape, margin, drift } = *rest;
            let axes = placed.set_pose(frame, world_from_shape);
            placed.set_margin(margin, drift);
            placed.bound(frame, axes, &self.shapes);
            self.bounds = self.bounds.around(placed.bounds);
        }
    }
}

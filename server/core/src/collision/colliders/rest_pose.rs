//! Poses of colliders while their robot sleeps.

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use super::{Bounds, Placed, RobotColliders};
use crate::plain::{pose3, vector3};

/// Pose of a collider of a sleeping robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestPose {
    /// World from shape, in parry's axes for the shape.
    #[serde(with = "pose3")]
    pub world_from_shape: DPose3,
    /// Distance within which contacts are looked for, metres.
    pub margin: f64,
    /// Part of that for its motion without turning, along that motion.
    #[serde(with = "vector3")]
    pub drift: DVec3,
}

impl RobotColliders {
    /// Returns the pose and the contact distance of each collider, which a step reads of a sleeping robot.
    /// Its colliders keep the poses of the step in which it fell asleep.
    pub fn save_poses(&self) -> impl Iterator<Item = RestPose> + '_ {
        self.placed.iter().zip(&self.frames).map(|(&Placed { margin, drift, .. }, frame)| RestPose {
            world_from_shape: frame.world_from_shape,
            margin,
            drift,
        })
    }

    /// Restores the saved pose of each collider; there is one for each.
    pub fn restore_poses(&mut self, poses: &[RestPose]) {
        self.bounds = Bounds::default();
        self.is_any_lost = false;
        for ((placed, frame), rest) in self.placed.iter_mut().zip(&mut self.frames).zip(poses) {
            // A sleeping robot is slow, so its margin is not bounded.
            let RestPose { world_from_shape, margin, drift } = *rest;
            let axes = placed.set_pose(frame, world_from_shape);
            placed.set_margin(margin, drift);
            placed.bound(frame, axes, &self.shapes);
            self.bounds = self.bounds.around(placed.bounds);
        }
    }
}

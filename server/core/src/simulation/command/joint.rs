//! What joints are to do besides single targets: resets, properties, trajectories.

use std::sync::Arc;

use glamx::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use simd_model::robot::JointLimits;

use super::super::target_sources::TargetSource;
use super::super::trajectory::MAX_POINTS;
use super::{Begin, Tolerance, TrajectoryPoint};
use crate::plain::{quaternion, shared, shared_list, vector3};

/// Where joints of a robot are put.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotReset {
    /// Its name.
    pub robot: String,
    /// None: every joint goes back to where it was spawned, at rest.
    pub joints: Vec<JointReset>,
}

/// Where a joint is put.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointReset {
    /// Its name.
    pub joint: String,
    /// Which axis of a planar joint: 0 x, 1 y, 2 angle. Else 0.
    pub axis: u32,
    /// rad or m.
    pub position: f64,
    /// rad/s or m/s.
    pub velocity: f64,
    /// Of a spherical joint, which takes this alone.
    pub spherical: Option<SphericalReset>,
}

/// Where a spherical joint starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointOrientation {
    /// Its name.
    pub joint: String,
    /// Of the child in the joint's frame, of unit length.
    #[serde(with = "quaternion")]
    pub orientation: DQuat,
}

/// Where a spherical joint is put.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SphericalReset {
    /// Of the child in the joint's frame, of unit length.
    #[serde(with = "quaternion")]
    pub orientation: DQuat,
    /// Relative to the parent, in the child's axes, rad/s.
    #[serde(with = "vector3")]
    pub angular_velocity: DVec3,
}

/// New settings of a joint; `None` leaves one as it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointProperties {
    /// Its name.
    pub joint: String,
    /// N m s/rad or N s/m.
    pub damping: Option<f64>,
    /// N m or N.
    pub friction: Option<f64>,
    /// kg m^2 or kg.
    pub armature: Option<f64>,
    /// Stiffness of a spring beside the actuator, N m/rad or N/m, 0 for none, and where it pulls nowhere, rad or m. Of joints of
    /// one axis, and of ball joints, where it pulls nowhere at the orientation 0 0 0 1 and the second number is 0.
    pub spring: Option<(f64, f64)>,
    /// Replaces all four limits.
    pub limits: Option<JointLimits>,
    /// Stiffness and damping of targets that give none.
    pub default_gains: Option<(f64, f64)>,
    /// To position, velocity and hold targets the effort is added that holds what hangs on the joint against gravity.
    pub gravity_compensation: Option<bool>,
}

/// A trajectory for joints of one robot.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FollowTrajectory {
    /// Its name.
    pub robot: String,
    /// Which joints, each with one axis, in the order of the points' numbers.
    pub joints: Vec<String>,
    /// In the order of their times. The way to the first begins where the joints are.
    /// Shared with the trajectory, so that none is copied on the physics thread.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_POINTS, _, _>"
    )]
    pub points: Arc<Vec<TrajectoryPoint>>,
    /// When it begins.
    pub begin: Begin,
    /// On the path and at the goal, for each joint; or none at all.
    pub tolerances: Vec<[Tolerance; 2]>,
    /// How long after its end the joints may take to come within the tolerances of the goal, seconds; `None` is for ever.
    pub goal_time_tolerance: Option<f64>,
    /// Who asks. Nothing is allowed or refused by it.
    #[serde(skip)]
    pub source: Option<Arc<TargetSource>>,
}

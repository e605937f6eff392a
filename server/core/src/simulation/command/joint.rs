//! Commands for joints besides single targets: resets, properties, trajectories.

use std::sync::Arc;

use glamx::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use simd_model::robot::JointLimits;

use super::super::target_sources::TargetSource;
use super::super::trajectory::MAX_POINTS;
use super::{Begin, Tolerance, TrajectoryPoint};
use crate::plain::{quaternion, shared, shared_list, vector3};

/// Reset of joints of a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotReset {
    /// Name of the robot.
    pub robot: String,
    /// Joints; an empty list returns every joint to its spawned position, at rest.
    pub joints: Vec<JointReset>,
}

/// Reset of a joint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointReset {
    /// Name of the joint.
    pub joint: String,
    /// Axis of a planar joint: 0 x, 1 y, 2 angle. Else 0.
    pub axis: u32,
    /// Position, rad or m.
    pub position: f64,
    /// Velocity, rad/s or m/s.
    pub velocity: f64,
    /// Reset of a spherical joint, which uses only this.
    pub spherical: Option<SphericalReset>,
}

/// Initial orientation of a spherical joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointOrientation {
    /// Name of the joint.
    pub joint: String,
    /// Orientation of the child in the joint's frame, of unit length.
    #[serde(with = "quaternion")]
    pub orientation: DQuat,
}

/// Reset of a spherical joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SphericalReset {
    /// Orientation of the child in the joint's frame, of unit length.
    #[serde(with = "quaternion")]
    pub orientation: DQuat,
    /// Angular velocity relative to the parent, in the child's axes, rad/s.
    #[serde(with = "vector3")]
    pub angular_velocity: DVec3,
}

/// New settings of a joint; `None` leaves one unchanged.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointProperties {
    /// Name of the joint.
    pub joint: String,
    /// Damping, N m s/rad or N s/m.
    pub damping: Option<f64>,
    /// Dry friction, N m or N.
    pub friction: Option<f64>,
    /// Armature, kg m^2 or kg.
    pub armature: Option<f64>,
    /// Stiffness of a spring in addition to the actuator, N m/rad or N/m, 0 for none, and its rest position,
    /// rad or m. For joints of one axis, and for ball joints, where the rest orientation is 0 0 0 1 and the
    /// second number is 0.
    pub spring: Option<(f64, f64)>,
    /// Limits, which replace all four.
    pub limits: Option<JointLimits>,
    /// Stiffness and damping of targets that have none.
    pub default_gains: Option<(f64, f64)>,
    /// Whether an effort that holds the joint's load against gravity is added to position, velocity and hold
    /// targets.
    pub gravity_compensation: Option<bool>,
    /// Whether the setpoint follows a velocity profile on its way to a position target.
    pub profile: Option<bool>,
}

/// Trajectory for joints of one robot.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FollowTrajectory {
    /// Name of the robot.
    pub robot: String,
    /// Joints, each with one axis, in the order of the points' numbers.
    pub joints: Vec<String>,
    /// Points in the order of their times. The path to the first one begins at the joints' present positions.
    /// Shared with the trajectory, so that none is copied on the physics thread.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_POINTS, _, _>"
    )]
    pub points: Arc<Vec<TrajectoryPoint>>,
    /// Start of the trajectory.
    pub begin: Begin,
    /// Tolerances on the path and at the goal, for each joint; may be empty.
    pub tolerances: Vec<[Tolerance; 2]>,
    /// Time after its end within which the joints must reach the tolerances of the goal, seconds; `None`
    /// means no limit.
    pub goal_time_tolerance: Option<f64>,
    /// Sender, which grants and refuses nothing.
    #[serde(skip)]
    pub source: Option<Arc<TargetSource>>,
}

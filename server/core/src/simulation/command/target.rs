//! What joints are asked to do.

use std::sync::Arc;

use glamx::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::plain::{quaternion, vector3};
use crate::simulation::target_sources::TargetSource;

/// New targets for joints of one or several robots, all or none.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SetTargets {
    /// Whose, and which.
    pub robots: Vec<RobotTargets>,
    /// Refuse a target beyond a limit instead of clamping it.
    pub refuse_beyond_limits: bool,
    /// Who sets them. Nothing is allowed or refused by it.
    #[serde(skip)]
    pub source: Option<Arc<TargetSource>>,
}

/// Targets for one robot.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RobotTargets {
    /// Its name.
    pub robot: String,
    /// Refuse where the robot's layout is another; 0 for any.
    pub layout_version: u64,
    /// Applied first, to all actuated joints.
    pub whole: Option<WholeTarget>,
    /// Applied after that.
    pub joints: Vec<JointTarget>,
}

/// One mode for all actuated joints. Values are aligned with the robot's
/// velocities in a [`PublishedState`](crate::PublishedState); positions of a spherical joint are its rotation vector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum WholeTarget {
    /// rad or m.
    Position(Vec<f64>),
    /// rad/s or m/s.
    Velocity(Vec<f64>),
    /// N m or N.
    Effort(Vec<f64>),
    /// No actuator.
    Passive,
    /// Stay where they are.
    Hold,
}

/// A target for a joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointTarget {
    /// Its name.
    pub joint: String,
    /// Which axis of a planar joint: 0 x, 1 y, 2 angle. Else 0.
    pub axis: u32,
    /// What to do.
    pub target: Target,
}

/// What a joint is asked to do. SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Target {
    /// Go to a position and stay there.
    Position {
        /// rad or m.
        position: f64,
        /// Velocity that the damper pulls towards.
        velocity: f64,
        /// N m/rad or N/m; `None` is the joint's default.
        stiffness: Option<f64>,
        /// N m s/rad or N s/m; `None` is critical for a given stiffness, else the default.
        damping: Option<f64>,
        /// Added to the actuator's effort.
        feed_forward: f64,
        /// The most effort that is applied for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// How fast the setpoint advances; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
    /// Turn or slide at a velocity.
    Velocity {
        /// rad/s or m/s.
        velocity: f64,
        /// N m s/rad or N s/m; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// Added to the actuator's effort.
        feed_forward: f64,
        /// The most effort that is applied for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
    },
    /// Apply an effort.
    Effort(f64),
    /// No actuator; of all axes of a spherical joint.
    Passive,
    /// Stay where the joint is; of all axes of a spherical joint.
    Hold,
    /// Turn a spherical joint to an orientation and stay there.
    Orientation {
        /// Of the child in the joint's frame, of unit length.
        #[serde(with = "quaternion")]
        orientation: DQuat,
        /// Velocity that the damper pulls towards, in the child's axes, rad/s.
        #[serde(with = "vector3")]
        velocity: DVec3,
        /// N m/rad about each axis; `None` is the joint's default.
        stiffness: Option<f64>,
        /// N m s/rad about each axis; `None` is critical for a given stiffness, else the default.
        damping: Option<f64>,
        /// Added to the actuator's torque, in the child's axes, N m.
        #[serde(with = "vector3")]
        feed_forward: DVec3,
        /// The most torque about each axis that is applied for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// How fast the setpoint turns about each axis; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
    /// Turn a spherical joint at a velocity.
    AngularVelocity {
        /// In the child's axes, rad/s.
        #[serde(with = "vector3")]
        velocity: DVec3,
        /// N m s/rad about each axis; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// Added to the actuator's torque, in the child's axes, N m.
        #[serde(with = "vector3")]
        feed_forward: DVec3,
        /// The most torque about each axis that is applied for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
    },
    /// Apply a torque to a spherical joint, in the child's axes, N m.
    Torque(#[serde(with = "vector3")] DVec3),
}

impl Target {
    /// A position, with the joint's default gains.
    pub fn position(position: f64) -> Self {
        Self::Position {
            position,
            velocity: 0.0,
            stiffness: None,
            damping: None,
            feed_forward: 0.0,
            max_effort: None,
            max_velocity: None,
        }
    }

    /// An orientation, with the joint's default gains.
    pub fn orientation(orientation: DQuat) -> Self {
        Self::Orientation {
            orientation,
            velocity: DVec3::ZERO,
            stiffness: None,
            damping: None,
            feed_forward: DVec3::ZERO,
            max_effort: None,
            max_velocity: None,
        }
    }

    /// A velocity, with the joint's default damping.
    pub fn velocity(velocity: f64) -> Self {
        Self::Velocity { velocity, damping: None, feed_forward: 0.0, max_effort: None }
    }
}

/// A target that lay beyond a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Clamped {
    /// The robot's name.
    pub robot: String,
    /// The joint's name.
    pub joint: String,
    /// What was asked for.
    pub requested: f64,
    /// The limit that is used.
    pub applied: f64,
}

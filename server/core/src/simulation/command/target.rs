//! Targets of joints.

use std::sync::Arc;

use glamx::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::plain::{quaternion, vector3};
use crate::simulation::target_sources::TargetSource;

/// New targets for joints of one or several robots, all or none.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SetTargets {
    /// Targets by robot.
    pub robots: Vec<RobotTargets>,
    /// Whether to refuse a target beyond a limit, and not to clamp it.
    pub refuse_beyond_limits: bool,
    /// Sender, which grants and refuses nothing.
    #[serde(skip)]
    pub source: Option<Arc<TargetSource>>,
}

/// Targets for one robot.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RobotTargets {
    /// Name of the robot.
    pub robot: String,
    /// Required layout version of the robot; 0 means any.
    pub layout_version: u64,
    /// Target for all actuated joints, applied first.
    pub whole: Option<WholeTarget>,
    /// Targets of single joints, applied after that.
    pub joints: Vec<JointTarget>,
}

/// One mode for all actuated joints. Values are aligned with the robot's velocities in a
/// [`PublishedState`](crate::PublishedState); positions of a spherical joint are its rotation vector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum WholeTarget {
    /// Positions, rad or m.
    Position(Vec<f64>),
    /// Velocities, rad/s or m/s.
    Velocity(Vec<f64>),
    /// Efforts, N m or N.
    Effort(Vec<f64>),
    /// No actuator.
    Passive,
    /// Hold the present positions.
    Hold,
}

/// Target for a joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointTarget {
    /// Name of the joint.
    pub joint: String,
    /// Axis of a planar joint: 0 x, 1 y, 2 angle. Else 0.
    pub axis: u32,
    /// Target.
    pub target: Target,
}

/// Target of a joint, in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Target {
    /// Move to a position and hold it.
    Position {
        /// Position, rad or m.
        position: f64,
        /// Velocity that the damper pulls towards.
        velocity: f64,
        /// Stiffness, N m/rad or N/m; `None` is the joint's default.
        stiffness: Option<f64>,
        /// Damping, N m s/rad or N s/m; `None` is critical for a given stiffness, else the default.
        damping: Option<f64>,
        /// Effort that is added to the actuator's.
        feed_forward: f64,
        /// Maximum effort for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// Maximum speed of the setpoint; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
    /// Move at a velocity.
    Velocity {
        /// Velocity, rad/s or m/s.
        velocity: f64,
        /// Damping, N m s/rad or N s/m; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// Effort that is added to the actuator's.
        feed_forward: f64,
        /// Maximum effort for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
    },
    /// Apply an effort.
    Effort(f64),
    /// No actuator; for all axes of a spherical joint.
    Passive,
    /// Hold the joint's present position; for all axes of a spherical joint.
    Hold,
    /// Turn a spherical joint to an orientation and hold it.
    Orientation {
        /// Orientation of the child in the joint's frame, of unit length.
        #[serde(with = "quaternion")]
        orientation: DQuat,
        /// Velocity that the damper pulls towards, in the child's axes, rad/s.
        #[serde(with = "vector3")]
        velocity: DVec3,
        /// Stiffness about each axis, N m/rad; `None` is the joint's default.
        stiffness: Option<f64>,
        /// Damping about each axis, N m s/rad; `None` is critical for a given stiffness, else the default.
        damping: Option<f64>,
        /// Torque that is added to the actuator's, in the child's axes, N m.
        #[serde(with = "vector3")]
        feed_forward: DVec3,
        /// Maximum torque about each axis for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// Maximum speed of the setpoint about each axis; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
    /// Turn a spherical joint at a velocity.
    AngularVelocity {
        /// Angular velocity in the child's axes, rad/s.
        #[serde(with = "vector3")]
        velocity: DVec3,
        /// Damping about each axis, N m s/rad; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// Torque that is added to the actuator's, in the child's axes, N m.
        #[serde(with = "vector3")]
        feed_forward: DVec3,
        /// Maximum torque about each axis for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
    },
    /// Apply a torque to a spherical joint, in the child's axes, N m.
    Torque(#[serde(with = "vector3")] DVec3),
    /// Keep a velocity that depends on where the joint is; see [`Axis::asked_velocity`](crate::dynamics::Axis::asked_velocity).
    Servo {
        /// rad or m; it may lie beyond the joint's limits.
        position: f64,
        /// 1/s; with 0 the position has no effect.
        rate: f64,
        /// rad/s or m/s.
        velocity: f64,
        /// Part of the free velocity that the joint keeps, -1 to 1.
        slip: f64,
        /// N m s/rad or N s/m; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// Added to the actuator's effort.
        feed_forward: f64,
        /// The most effort that is applied for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// The largest velocity to aim at; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
}

impl Target {
    /// Creates a position target with the joint's default gains.
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

    /// Creates an orientation target with the joint's default gains.
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

    /// Creates a velocity target with the joint's default damping.
    pub fn velocity(velocity: f64) -> Self {
        Self::Velocity { velocity, damping: None, feed_forward: 0.0, max_effort: None }
    }
}

/// Target that was beyond a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Clamped {
    /// Name of the robot.
    pub robot: String,
    /// Name of the joint.
    pub joint: String,
    /// Requested value.
    pub requested: f64,
    /// Limit that is used instead.
    pub applied: f64,
}

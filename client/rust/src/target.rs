//! What a joint is asked to do, shorter than the messages.

use simd_proto::v1::{
    EffortTarget, HoldTarget, JointTarget, PassiveTarget, PositionTarget, RobotTargets, VelocityTarget,
    joint_target::Target as Wire,
};

/// What a joint's actuator is to do. Radians, newton metres and seconds for
/// joints that turn; metres, newtons and seconds for joints that slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Go to a position and stay there.
    Position {
        /// rad or m.
        position: f64,
        /// Rate that the damper pulls towards, rad/s or m/s.
        velocity: f64,
        /// N m/rad or N/m; `None` is the joint's default.
        stiffness: Option<f64>,
        /// N m s/rad or N s/m; `None` is critical for a given stiffness, else the default.
        damping: Option<f64>,
        /// Added to the actuator's effort, N m or N.
        feed_forward: f64,
        /// N m or N: the most for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// rad/s or m/s: the most on the way; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
    /// Turn or slide at a rate.
    Velocity {
        /// rad/s or m/s.
        velocity: f64,
        /// N m s/rad or N s/m; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// Added to the actuator's effort, N m or N.
        feed_forward: f64,
        /// N m or N: the most for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
    },
    /// Apply an effort, N m or N, until the next target.
    Effort(f64),
    /// No actuator.
    Passive,
    /// Stay where the joint is when the target takes effect.
    Hold,
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

    /// A rate, with the joint's default damping.
    pub fn velocity(velocity: f64) -> Self {
        Self::Velocity { velocity, damping: None, feed_forward: 0.0, max_effort: None }
    }
}

impl From<Target> for Wire {
    fn from(target: Target) -> Self {
        match target {
            Target::Position {
                position,
                velocity,
                stiffness,
                damping,
                feed_forward: feed_forward_effort,
                max_effort,
                max_velocity,
            } => Self::Position(PositionTarget {
                position,
                velocity,
                stiffness,
                damping,
                feed_forward_effort,
                max_effort,
                max_velocity,
            }),
            Target::Velocity { velocity, damping, feed_forward: feed_forward_effort, max_effort } => {
                Self::Velocity(VelocityTarget { velocity, damping, feed_forward_effort, max_effort })
            }
            Target::Effort(effort) => Self::Effort(EffortTarget { effort }),
            Target::Passive => Self::Passive(PassiveTarget {}),
            Target::Hold => Self::Hold(HoldTarget {}),
        }
    }
}

/// A target for the joint of that name.
pub fn joint_target(joint: impl Into<String>, target: Target) -> JointTarget {
    JointTarget { joint: joint.into(), axis: 0, target: Some(target.into()) }
}

/// Targets for joints of one robot, whatever its layout.
pub fn robot_targets(robot: &str, targets: impl IntoIterator<Item = JointTarget>) -> RobotTargets {
    RobotTargets { robot: robot.to_owned(), joints: targets.into_iter().collect(), ..RobotTargets::default() }
}

//! Targets of joints, in a shorter form than the messages.

use simd_proto::v1::{
    EffortTarget, HoldTarget, JointTarget, PassiveTarget, PositionTarget, Quaternion, RobotTargets,
    SphericalEffortTarget, SphericalPositionTarget, SphericalVelocityTarget, Vector3, VelocityTarget,
    joint_target::Target as Wire,
};

/// Target of a joint's actuator. Radians, newton metres and seconds for joints that turn; metres, newtons and
/// seconds for joints that slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Go to a position and stay there.
    Position {
        /// rad or m.
        position: f64,
        /// Velocity that the damper pulls towards, rad/s or m/s.
        velocity: f64,
        /// N m/rad or N/m; `None` is the joint's default.
        stiffness: Option<f64>,
        /// N m s/rad or N s/m; `None` is critical for a given stiffness, else the default.
        damping: Option<f64>,
        /// Added to the actuator's effort, N m or N.
        feed_forward: f64,
        /// N m or N: maximum for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// rad/s or m/s: maximum of the setpoint; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
    /// Turn or slide at a velocity.
    Velocity {
        /// rad/s or m/s.
        velocity: f64,
        /// N m s/rad or N s/m; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// Added to the actuator's effort, N m or N.
        feed_forward: f64,
        /// N m or N: maximum for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
    },
    /// Apply an effort, N m or N, until the next target.
    Effort(f64),
    /// No actuator.
    Passive,
    /// Stay where the joint is when the target takes effect.
    Hold,
    /// Turn a spherical joint to an orientation and stay there.
    Orientation {
        /// Orientation of the child in the joint's frame: a quaternion x y z w, of any length but zero.
        orientation: [f64; 4],
        /// N m/rad about each axis; `None` is the joint's default.
        stiffness: Option<f64>,
        /// N m s/rad about each axis; `None` is critical for a given stiffness, else the default.
        damping: Option<f64>,
        /// N m: maximum about each axis for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
        /// rad/s: maximum of the setpoint about each axis; `None` is the joint's limit.
        max_velocity: Option<f64>,
    },
    /// Turn a spherical joint at a velocity, in the child's axes.
    AngularVelocity {
        /// rad/s.
        velocity: [f64; 3],
        /// N m s/rad about each axis; `None` is stiff enough for 0.1 % under gravity.
        damping: Option<f64>,
        /// N m: maximum about each axis for this target; `None` is the joint's limit.
        max_effort: Option<f64>,
    },
    /// Apply a torque to a spherical joint, in the child's axes, N m, until the next target.
    Torque([f64; 3]),
}

impl Target {
    /// Targets a position, with the joint's default gains.
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

    /// Targets an orientation of a spherical joint, a quaternion x y z w, with the joint's default gains.
    pub fn orientation(orientation: [f64; 4]) -> Self {
        Self::Orientation {
            orientation,
            stiffness: None,
            damping: None,
            max_effort: None,
            max_velocity: None,
        }
    }

    /// Targets a velocity, with the joint's default damping.
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
            Target::Orientation {
                orientation: [x, y, z, w],
                stiffness,
                damping,
                max_effort,
                max_velocity,
            } => Self::SphericalPosition(SphericalPositionTarget {
                orientation: Some(Quaternion { x, y, z, w }),
                angular_velocity: None,
                stiffness,
                damping,
                feed_forward_torque: None,
                max_effort,
                max_velocity,
            }),
            Target::AngularVelocity { velocity, damping, max_effort } => {
                Self::SphericalVelocity(SphericalVelocityTarget {
                    angular_velocity: Some(vector(velocity)),
                    damping,
                    feed_forward_torque: None,
                    max_effort,
                })
            }
            Target::Torque(torque) => {
                Self::SphericalEffort(SphericalEffortTarget { torque: Some(vector(torque)) })
            }
        }
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

/// Makes a target for the joint of that name.
pub fn joint_target(joint: impl Into<String>, target: Target) -> JointTarget {
    JointTarget { joint: joint.into(), axis: 0, target: Some(target.into()) }
}

/// Makes targets for joints of one robot, for any layout.
pub fn robot_targets(robot: &str, targets: impl IntoIterator<Item = JointTarget>) -> RobotTargets {
    RobotTargets { robot: robot.to_owned(), joints: targets.into_iter().collect(), ..RobotTargets::default() }
}

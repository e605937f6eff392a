//! Events of a world, for watchers.

use super::command::{ReleaseCause, ResetScope};
use super::moment::Moment;
use super::settings::PhysicsSettings;
use super::trajectory::TrajectoryEnd;

/// An event.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Moment of the event.
    pub at: Moment,
    /// Type of event.
    pub kind: EventKind,
}

/// Type of event.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// A robot was added.
    EntitySpawned {
        /// Name of the robot.
        robot: String,
    },
    /// A robot was deleted.
    EntityDeleted {
        /// Name of the robot.
        robot: String,
    },
    /// A robot has a new model.
    EntityReloaded {
        /// Name of the robot.
        robot: String,
        /// New layout version.
        layout_version: u64,
    },
    /// A robot's state was not finite, and the robot was disabled.
    EntityDisabled {
        /// Name of the robot.
        robot: String,
        /// Reason, as a sentence.
        reason: String,
    },
    /// The world was reset.
    Reset(ResetScope),
    /// Gravity, time step, substeps, integrator or the combination of surfaces changed.
    PhysicsChanged(PhysicsSettings),
    /// A client claimed robots, joints or the world.
    JointsClaimed {
        /// Holder of the claim.
        holder: String,
        /// Claimed objects.
        claimed: Claimed,
    },
    /// A claim ended.
    JointsReleased {
        /// Holder of the claim.
        holder: String,
        /// Released objects.
        released: Claimed,
        /// Reason for the end.
        cause: ReleaseCause,
    },
    /// A constraint was created.
    ConstraintCreated {
        /// Name of the constraint.
        constraint: String,
    },
    /// A constraint was deleted.
    ConstraintDeleted {
        /// Name of the constraint.
        constraint: String,
        /// Reason for the deletion.
        cause: ConstraintDeletion,
    },
    /// A client added a sensor to a robot. Sensors of a description come with their robot, without this
    /// event.
    SensorCreated {
        /// Name of the robot.
        robot: String,
        /// Name of the sensor.
        sensor: String,
    },
    /// A client deleted a sensor, or the robot's new model has no place for a client's sensor. Other sensors
    /// are deleted with their robot, without this event.
    SensorDeleted {
        /// Name of the robot.
        robot: String,
        /// Name of the sensor.
        sensor: String,
    },
    /// A trajectory ended.
    TrajectoryEnded {
        /// Name of the robot.
        robot: String,
        /// Identifier of the trajectory.
        id: u64,
        /// Kind of end.
        end: TrajectoryEnd,
    },
    /// A saved state was restored.
    StateRestored {
        /// Name of the saved state.
        name: String,
    },
}

/// Reason for the deletion of a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintDeletion {
    /// A client requested it.
    Asked,
    /// It needed more than its maximum force or torque.
    Broke,
    /// One of its robots was deleted.
    RobotDeleted,
    /// The new model of one of its robots has no such link or joint.
    LinkGone,
}

/// Objects of a claim.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Claimed {
    /// Names of whole robots.
    pub robots: Vec<String>,
    /// Joints as `robot/joint`, including those of whole robots.
    pub joints: Vec<String>,
    /// Whether the world is included.
    pub world: bool,
}

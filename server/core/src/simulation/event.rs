//! What happened in a world, for those who watch it.

use super::command::{ReleaseCause, ResetScope};
use super::moment::Moment;
use super::settings::PhysicsSettings;
use super::trajectory::TrajectoryEnd;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When.
    pub at: Moment,
    /// What.
    pub kind: EventKind,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// A robot came.
    EntitySpawned {
        /// Its name.
        robot: String,
    },
    /// A robot went.
    EntityDeleted {
        /// Its name.
        robot: String,
    },
    /// A robot has a new model.
    EntityReloaded {
        /// Its name.
        robot: String,
        /// Its new layout version.
        layout_version: u64,
    },
    /// A robot's state was not finite; it is out of the simulation.
    EntityDisabled {
        /// Its name.
        robot: String,
        /// Why, as a sentence.
        reason: String,
    },
    /// The world was put back.
    Reset(ResetScope),
    /// Gravity, time step, substeps, integrator or the combination of surfaces changed.
    PhysicsChanged(PhysicsSettings),
    /// Robots, joints or the world were taken for one client.
    JointsClaimed {
        /// Who claims.
        holder: String,
        /// What.
        claimed: Claimed,
    },
    /// They were given back.
    JointsReleased {
        /// Who claimed.
        holder: String,
        /// What.
        released: Claimed,
        /// Why.
        cause: ReleaseCause,
    },
    /// A constraint came.
    ConstraintCreated {
        /// Its name.
        constraint: String,
    },
    /// A constraint went.
    ConstraintDeleted {
        /// Its name.
        constraint: String,
        /// Why.
        cause: ConstraintDeletion,
    },
    /// A client put a sensor on a robot. Those of a description come with their robot.
    SensorCreated {
        /// The robot's name.
        robot: String,
        /// Its name.
        sensor: String,
    },
    /// A client took a sensor off a robot, or the robot's new model has no place for one of a client. Others go with their robot.
    SensorDeleted {
        /// The robot's name.
        robot: String,
        /// Its name.
        sensor: String,
    },
    /// A trajectory is over.
    TrajectoryEnded {
        /// The robot's name.
        robot: String,
        /// Which, as it was called when it was accepted.
        id: u64,
        /// How.
        end: TrajectoryEnd,
    },
    /// The world was put back to a kept state.
    StateRestored {
        /// Its name.
        name: String,
    },
}

/// Why a constraint went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintDeletion {
    /// It was asked for.
    Asked,
    /// It needed more than its maximal force or torque.
    Broke,
    /// One of its robots went.
    RobotDeleted,
    /// The new model of one of its robots has no such link, or no such joint.
    LinkGone,
}

/// What a claim is on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Claimed {
    /// Whole robots.
    pub robots: Vec<String>,
    /// `robot/joint` each, those of whole robots too.
    pub joints: Vec<String>,
    /// The world.
    pub world: bool,
}

//! What can be asked of a world beyond what a snapshot shows.

use simd_model::robot::Limits;

use super::command::SnapshotInfo;
use super::snapshot::Mode;

/// A question; answered between steps.
#[derive(Clone, Debug, PartialEq)]
pub enum Query {
    /// Settings and targets of a robot's joints.
    Joints {
        /// The robot's name.
        robot: String,
    },
    /// The states that are kept, oldest first.
    Snapshots,
}

/// The answer to a [`Query`].
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// To [`Query::Joints`]: one for each joint of the model, in its order, with
    /// the layout version that they belong to.
    Joints {
        /// Of the robot, as in the snapshot's layout.
        layout_version: u64,
        /// One a joint.
        joints: Vec<JointStatus>,
    },
    /// To [`Query::Snapshots`].
    Snapshots(Vec<SnapshotInfo>),
}

/// What holds for a joint at the moment. Of a planar joint's three axes the
/// settings are those of the first.
#[derive(Clone, Debug, PartialEq)]
pub struct JointStatus {
    /// What its actuator does.
    pub mode: Mode,
    /// In force.
    pub limits: Limits,
    /// N m s/rad or N s/m.
    pub damping: f64,
    /// N m or N.
    pub friction: f64,
    /// kg m^2 or kg.
    pub armature: f64,
    /// Stiffness and damping in force.
    pub gains: (f64, f64),
    /// Stiffness and damping of targets that give none.
    pub default_gains: (f64, f64),
    /// Who holds a claim on it.
    pub claimed_by: Option<String>,
}

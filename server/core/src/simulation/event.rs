//! What happened in a world, for those who watch it.

use super::command::ResetScope;
use super::moment::Moment;
use super::settings::PhysicsSettings;

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
    /// Gravity, time step, substeps or integrator changed.
    PhysicsChanged(PhysicsSettings),
    /// Joints were taken for one client.
    JointsClaimed {
        /// Who claims.
        holder: String,
        /// `robot/joint` each.
        joints: Vec<String>,
    },
    /// Joints were given back.
    JointsReleased {
        /// Who claimed.
        holder: String,
        /// `robot/joint` each.
        joints: Vec<String>,
        /// The claim ran out.
        lapsed: bool,
    },
    /// The world was put back to a kept state.
    StateRestored {
        /// Its name.
        name: String,
    },
}

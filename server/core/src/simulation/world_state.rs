//! State of a world: the data that a save copies, a fingerprint reads and a file carries.
//!
//! Descriptions of robots (model, shapes, tree) are immutable, shared, and not part of it; intermediate
//! results of a step are scratch. Claims are agreements between clients, and not state of the world.

use std::hash::{DefaultHasher, Hasher as _};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use simd_model::sensor::MAX_SENSORS_PER_ROBOT;

use super::contact_settings::{ContactSettings, MAX_COLLISION_PAIRS};
pub use super::pull::ActivePull;
pub use super::sensors::SensorState;
use super::settings::PhysicsSettings;
use super::trajectory::MAX_TRAJECTORIES;
pub use super::trajectory::{ActiveTrajectory, TrajectoryJoint};
pub use super::wrench::ActiveWrench;
pub use crate::collision::{Groups, LinkPair, RestPose, RobotLinkPair, Surface};
pub use crate::dynamics::BodyState;
pub use crate::dynamics::constraint::contact::Contact;
pub use crate::dynamics::constraint::link_constraint::LinkConstraint;
use crate::dynamics::constraint::link_constraint::MAX_CONSTRAINTS;
use crate::dynamics::link_damping::LinkDamping;
use crate::plain::{bounded_list, optional_text, shared, shared_list};

/// Complete state of a world at a moment. Worlds in equal states continue equally to the bit, on the same
/// build and machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WorldState {
    /// Number of steps since the epoch began.
    pub step: u64,
    /// Sim time since the epoch began, seconds.
    pub sim_time: f64,
    /// Origin of sim time: step and time at which the time step last changed.
    pub time_base: (u64, f64),
    /// Physics settings.
    pub settings: PhysicsSettings,
    /// Robots in the order of their spawning. Each is written separately, with the parts it is made from.
    #[serde(skip)]
    pub robots: Vec<RobotState>,
    /// Contacts of the last step, in the order of their robots and colliders.
    pub contacts: Vec<Contact>,
    /// Initial overlaps that are ignored until the colliders have separated, in order.
    pub ignored_overlaps: Vec<Pair>,
    /// Enabled and disabled pairs of links of different robots, in order. Shared, since copies of the state
    /// are made while the world plays.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_COLLISION_PAIRS, _, _>"
    )]
    pub collision_pairs: Arc<Vec<RobotLinkPair>>,
    /// Constraints between links, in the order of their creation.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_CONSTRAINTS, _, _>")]
    pub constraints: Vec<LinkConstraint>,
}

impl WorldState {
    /// Returns [`Simulation::fingerprint`](crate::Simulation::fingerprint) of a world in this state.
    pub fn fingerprint(&self) -> u64 {
        let Self {
            step,
            sim_time,
            time_base,
            settings,
            robots,
            contacts,
            ignored_overlaps,
            collision_pairs,
            constraints,
        } = self;
        let mut bytes = encoded(&(step, sim_time, time_base, settings));
        for RobotState { entity, body } in robots {
            bytes.extend(encoded(entity));
            bytes.extend(encoded(body));
        }
        bytes.extend(encoded(contacts));
        bytes.extend(encoded(ignored_overlaps));
        bytes.extend(encoded(&**collision_pairs));
        bytes.extend(encoded(constraints));
        hash(&bytes)
    }
}

/// Returns the encoded bytes. Encoding fails only for lists of unknown length, which no state has.
pub(crate) fn encoded(value: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap_or_default()
}

/// Returns a hash, which is equal for equal bytes on one build.
pub(super) fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    hasher.finish()
}

/// State of one robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RobotState {
    /// State outside of its dynamics.
    pub entity: EntityState,
    /// State of its dynamics.
    pub body: BodyState,
}

/// State of a robot outside of its dynamics.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EntityState {
    /// Name, unique in the world; `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Whether it stays at a reset of scope `spawned`.
    pub loaded_at_start: bool,
    /// Whether its root link cannot move.
    pub fixed_base: bool,
    /// Contact settings.
    pub contact_settings: ContactSettings,
    /// Surface of each collider, with later changes.
    pub surfaces: Vec<Surface>,
    /// Groups of each link.
    pub groups: Vec<Groups>,
    /// Damping of each link; empty without any.
    pub link_damping: Vec<LinkDamping>,
    /// Enabled and disabled pairs of the robot's links, in order. Shared like the state that it was spawned
    /// with.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_COLLISION_PAIRS, _, _>"
    )]
    pub collision_pairs: Arc<Vec<LinkPair>>,
    /// Whether it sleeps, so that steps skip it.
    pub asleep: bool,
    /// Pose of each collider while it sleeps; else empty.
    pub rest_poses: Vec<RestPose>,
    /// Whether a command has moved it since the last step.
    pub teleported: bool,
    /// Time for which it has hardly moved, seconds.
    pub still_for: f64,
    /// Reason, while it is disabled.
    #[serde(with = "optional_text")]
    pub disabled: Option<Arc<str>>,
    /// State that a reset of scope `state` restores. Shared, since copies of the state are made while the
    /// world plays.
    #[serde(with = "shared")]
    pub spawned: Arc<BodyState>,
    /// Positions and velocities before the last step, to restore if it is not finite; empty before the first
    /// one.
    pub last_good: (Vec<f64>, Vec<f64>),
    /// Wrenches that commands applied to links.
    pub applied_wrenches: Vec<ActiveWrench>,
    /// Wrenches that acted over the last step and have expired.
    pub expired_wrenches: Vec<ActiveWrench>,
    /// Springs that pull links, at most one for each link.
    pub pulls: Vec<ActivePull>,
    /// Running and waiting trajectories, in the order of their acceptance.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORIES, _, _>")]
    pub trajectories: Vec<ActiveTrajectory>,
    /// Sensors in the order of their creation.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_SENSORS_PER_ROBOT, _, _>")]
    pub sensors: Vec<SensorState>,
}

/// Reason why a state is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidState {
    /// Fault of one robot.
    #[error("robot {robot:?} has {what}")]
    Robot {
        /// Name of the robot.
        robot: String,
        /// Fault, as "3 positions; its model has 4".
        what: String,
    },
    /// Fault of the world as a whole.
    #[error("{0}")]
    World(String),
}

/// Indices of two robots, the smaller first, and of a collider of each.
pub type Pair = ([usize; 2], [usize; 2]);

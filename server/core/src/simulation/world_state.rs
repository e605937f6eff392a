//! The state of a world: what a save copies, a fingerprint reads and a file carries, and nothing else.
//!
//! What robots are (model, shapes, tree) is immutable and shared beside it; what a step computes on
//! the way is scratch. Claims are agreements between clients, and not state of the world.

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
use crate::plain::{bounded_list, optional_text, shared, shared_list};

/// Everything that a world is at a moment: a world in an equal state runs on equal to the bit, on
/// the same build and machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WorldState {
    /// Steps since the epoch began.
    pub step: u64,
    /// Seconds since the epoch began.
    pub sim_time: f64,
    /// Where sim time is counted from: the step and the time at which the time step last changed.
    pub time_base: (u64, f64),
    /// How it is stepped.
    pub settings: PhysicsSettings,
    /// In the order of their spawning. Written one by one, beside what each is made from.
    #[serde(skip)]
    pub robots: Vec<RobotState>,
    /// As the last step had them, in the order of their robots and colliders.
    pub contacts: Vec<Contact>,
    /// Initial overlaps that are ignored until the colliders have separated, in order.
    pub ignored_overlaps: Vec<Pair>,
    /// Links of different robots that were switched off or on, in order. Shared, since copies of the state are made
    /// while the world plays.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_COLLISION_PAIRS, _, _>"
    )]
    pub collision_pairs: Arc<Vec<RobotLinkPair>>,
    /// Between links, in the order in which they were made.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_CONSTRAINTS, _, _>")]
    pub constraints: Vec<LinkConstraint>,
}

impl WorldState {
    /// [`Simulation::fingerprint`](crate::Simulation::fingerprint) of a world in this state.
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

/// As bytes. That fails for lists of unknown length only, and no state has one.
pub(crate) fn encoded(value: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap_or_default()
}

/// The same for equal bytes on one build.
pub(super) fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    hasher.finish()
}

/// One robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RobotState {
    /// What is beside its dynamics.
    pub entity: EntityState,
    /// Where it is, how it moves, what drives it.
    pub body: BodyState,
}

/// The state of a robot beside its dynamics.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EntityState {
    /// Unique in the world; `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Stays at a reset of scope `spawned`.
    pub loaded_at_start: bool,
    /// Its root link cannot move.
    pub fixed_base: bool,
    /// How its contacts were configured.
    pub contact_settings: ContactSettings,
    /// Of each collider, as it was set since.
    pub surfaces: Vec<Surface>,
    /// Of each link.
    pub groups: Vec<Groups>,
    /// Its own links that were switched off or on, in order. Shared like the state that it was spawned with.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_COLLISION_PAIRS, _, _>"
    )]
    pub collision_pairs: Arc<Vec<LinkPair>>,
    /// It rests, and no step looks at it.
    pub asleep: bool,
    /// Where each collider of one that sleeps rests; else empty.
    pub rest_poses: Vec<RestPose>,
    /// A command has moved it since the last step.
    pub teleported: bool,
    /// For how long it has hardly moved, seconds.
    pub still_for: f64,
    /// Set while it is out of the simulation: why.
    #[serde(with = "optional_text")]
    pub disabled: Option<Arc<str>>,
    /// What a reset of scope `state` puts back. Shared, since copies of the state are made while the world plays.
    #[serde(with = "shared")]
    pub spawned: Arc<BodyState>,
    /// Positions and velocities before the last step, to go back to if it is not finite; empty before the
    /// first one.
    pub last_good: (Vec<f64>, Vec<f64>),
    /// Wrenches that commands applied to links.
    pub applied_wrenches: Vec<ActiveWrench>,
    /// Wrenches that acted over the last step and have expired.
    pub expired_wrenches: Vec<ActiveWrench>,
    /// Springs that pull links, one a link at the most.
    pub pulls: Vec<ActivePull>,
    /// That are carried out or wait, in the order in which they were accepted.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORIES, _, _>")]
    pub trajectories: Vec<ActiveTrajectory>,
    /// In the order in which they were made.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_SENSORS_PER_ROBOT, _, _>")]
    pub sensors: Vec<SensorState>,
}

/// Why a state is not one that a world can be in.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidState {
    /// One of its robots.
    #[error("robot {robot:?} has {what}")]
    Robot {
        /// Which.
        robot: String,
        /// "3 positions, where its model has 4".
        what: String,
    },
    /// The world as a whole.
    #[error("{0}")]
    World(String),
}

/// Indices of two robots, the smaller first, and of a collider of each.
pub type Pair = ([usize; 2], [usize; 2]);

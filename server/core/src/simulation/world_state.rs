//! A saved state of a world as plain data, to be written to a file and read again.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use simd_model::RobotModel;

use super::PhysicsSettings;
use super::command::ContactSettings;
pub use super::contacts::Pair;
pub use super::entity::ActiveWrench;
use crate::collision::{Shapes, Surface};
pub use crate::dynamics::BodyState;

/// Everything that a world is at a moment: a world in an equal state runs on equal to the bit, on
/// the same build and machine. Claims are agreements between clients, and no part of it.
#[derive(Clone, Debug)]
pub struct WorldState {
    /// Steps since the epoch began.
    pub step: u64,
    /// Seconds since the epoch began.
    pub sim_time: f64,
    /// Where sim time is counted from: the step and the time at which the time step last changed.
    pub time_base: (u64, f64),
    /// How it is stepped.
    pub settings: PhysicsSettings,
    /// In the order of their spawning.
    pub robots: Vec<RobotState>,
    /// As the last step had them, in the order of their robots and colliders.
    pub contacts: Vec<ContactState>,
    /// Initial overlaps that are ignored until the colliders have separated, in order.
    pub ignored_overlaps: Vec<Pair>,
}

/// One robot.
#[derive(Clone, Debug)]
pub struct RobotState {
    /// Unique in the world; `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Stays at a reset of scope `spawned`.
    pub loaded_at_start: bool,
    /// What it is.
    pub model: Arc<RobotModel>,
    /// What it touches with.
    pub shapes: Arc<Shapes>,
    /// Its root link cannot move.
    pub fixed_base: bool,
    /// How its contacts were configured.
    pub contact_settings: ContactSettings,
    /// Of each collider, as it was set since.
    pub surfaces: Vec<Surface>,
    /// Set while it sleeps: the saved pose of each collider (`world_from_shape`), and how far around it
    /// contacts are looked for, metres.
    pub asleep: Option<Vec<(DPose3, f64)>>,
    /// A command has moved it since the last step.
    pub teleported: bool,
    /// For how long it has hardly moved, seconds.
    pub still_for: f64,
    /// Set while it is out of the simulation: why.
    pub disabled: Option<String>,
    /// Where it is, how it moves, what drives it.
    pub body: BodyState,
    /// What a reset of scope `state` puts back.
    pub spawned: BodyState,
    /// Positions and velocities before the last step, to go back to; empty before the first one.
    pub last_good: (Vec<f64>, Vec<f64>),
    /// Wrenches that commands applied to links.
    pub applied_wrenches: Vec<ActiveWrench>,
    /// Wrenches that acted over the last step and have expired.
    pub expired_wrenches: Vec<ActiveWrench>,
}

/// A point of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState {
    /// Indices of the two robots, the smaller first.
    pub robots: [usize; 2],
    /// Index of each robot's collider.
    pub colliders: [usize; 2],
    /// On each one's surface, in its shape's axes.
    pub on: [DVec3; 2],
    /// In the middle between the surfaces, world.
    pub point: DVec3,
    /// From the first to the second, world.
    pub normal: DVec3,
    /// Between the surfaces; negative inside. Metres.
    pub distance: f64,
    /// Of the two together.
    pub surface: Surface,
    /// On the second, world, N s: of the last part of the last step.
    pub impulse: DVec3,
    /// The sum of the impulses of the parts of the last step.
    pub total: DVec3,
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

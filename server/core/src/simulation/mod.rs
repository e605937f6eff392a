//! The world: commands that change it, the step, its published state.
//!
//! From the bottom to the top; a file imports only from those above it in this list:
//!
//! * `moment`, [`error`], [`settings`], [`contact_settings`], `wrench`, `pull`, `claim`, [`target_sources`],
//!   [`trajectory`]: small types.
//! * `check`: validation of numbers. [`free_place`]: a free place for a robot. [`sensors`]: definitions of sensors, their samples and their noise.
//! * [`world_state`]: the state as plain data.
//! * `entity`: one robot. `constraints`, `sleep`, `groups`, `group_memory`, `contacts`: its constraints, its
//!   sleep, its group and its contacts.
//! * [`saved`]: saved states. [`robot_settings`]: settings by commands.
//! * [`published_state`]: the published state; [`joint_status`], [`rays`], [`queries`], [`spawn_overlaps`],
//!   [`terrain_penetration`], `reactions`, [`measure`]: what follows from the published state, on any thread.
//! * [`command`], [`event`]: commands, and events.
//! * [`Simulation`]: the world.
//! * `operations`: operations on the world.

pub(crate) mod check;
mod claim;
pub mod command;
mod constraints;
pub mod contact_settings;
mod contacts;
mod entity;
pub mod error;
pub mod event;
pub mod free_place;
mod group_memory;
mod groups;
pub mod joint_status;
pub mod measure;
mod moment;
pub mod obstructions;
mod operations;
pub mod published_state;
mod pull;
pub mod queries;
pub mod rays;
mod reactions;
pub mod robot_settings;
pub mod saved;
pub mod sensors;
pub mod settings;
mod sleep;
pub mod spawn_overlaps;
pub mod target_sources;
pub mod terrain_penetration;
#[cfg(test)]
mod tests;
pub mod trajectory;
pub mod world_state;
mod wrench;

use std::collections::BTreeMap;
use std::sync::Arc;

use claim::{Claim, ClaimId};
pub use command::{Applied, Command, Reply};
use constraints::LinkConstraints;
use contacts::Contacts;
use entity::Entity;
pub use error::Error;
pub use event::{Event, EventKind};
use group_memory::GroupMemories;
use groups::Groups;
pub use moment::Moment;
pub use published_state::PublishedState;
use published_state::WorldLayout;
use robot_settings::RobotSettings;
pub use saved::{NamedSavedState, RobotParts, Saved};
use sensors::WorldSensors;
pub use settings::{BulletContacts, Integrator, PhysicsSettings, SetpointProfiles, SurfaceCombination};
use sleep::Busy;
use target_sources::RobotTargetSources;
use world_state::{encoded, hash};

use crate::collision::ColliderPose;
pub use crate::dynamics::island::SolverChoice;
use crate::pool::Pool;

/// A world of robots.
#[derive(Debug)]
pub struct Simulation {
    settings: PhysicsSettings,
    limits: WorldLimits,
    now: Moment,
    /// Origin of sim time: step and time at which the time step last changed.
    time_base: (u64, f64),
    /// Robots in the order of their spawning.
    entities: Vec<Entity>,
    /// Contacts of the last step.
    contacts: Contacts,
    constraints: LinkConstraints,
    step_memory: StepMemory,
    pool: Option<Arc<dyn Pool>>,
    claims: BTreeMap<ClaimId, Arc<Claim>>,
    /// Claim of the world, in addition to those of its robots and joints.
    world_claim: Option<Arc<Claim>>,
    /// Saved states, oldest first. Shared with what is published.
    saved: Arc<Vec<NamedSavedState>>,
    /// Settings of each robot. Shared with what is published.
    robot_settings: Arc<Vec<Arc<RobotSettings>>>,
    /// Target sources of each robot. Shared with what is published.
    target_sources: Arc<Vec<RobotTargetSources>>,
    /// Published data of sensors, and the samples of the last step.
    sensors: WorldSensors,
    /// Version of the next robot or model.
    next_version: u64,
    layout: Arc<WorldLayout>,
    events: Vec<Event>,
}

/// Memory of a step, reused by the next one.
#[derive(Debug, Default)]
struct StepMemory {
    /// Memories, one for each piece of work at a time.
    solvers: GroupMemories,
    groups: Groups,
    busy: Busy,
}

/// Limits set by the world's owner.
#[derive(Clone, Copy, Debug)]
pub struct WorldLimits {
    /// Maximum number of robots at one time.
    pub robots: usize,
    /// Maximum number of saved states.
    pub saved_states: usize,
}

impl Default for WorldLimits {
    fn default() -> Self {
        Self { robots: 1_000, saved_states: 32 }
    }
}

impl Simulation {
    /// Creates an empty world.
    pub fn new(settings: PhysicsSettings, limits: WorldLimits) -> Self {
        Self {
            settings,
            limits,
            now: Moment::default(),
            time_base: (0, 0.0),
            entities: Vec::new(),
            contacts: Contacts::default(),
            constraints: LinkConstraints::default(),
            step_memory: StepMemory::default(),
            pool: None,
            claims: BTreeMap::new(),
            world_claim: None,
            saved: Arc::default(),
            robot_settings: Arc::default(),
            target_sources: Arc::default(),
            sensors: WorldSensors::default(),
            next_version: 1,
            layout: Arc::default(),
            events: Vec::new(),
        }
    }

    /// Applies a command whose sender holds no claim: see [`Simulation::apply_for`].
    ///
    /// # Errors
    /// As [`Simulation::apply_for`].
    pub fn apply(&mut self, command: &Command) -> Result<Applied, Error> {
        self.apply_for(command, None)
    }

    /// Applies a command: whole or, if it is refused, not at all. It takes effect in the next step.
    ///
    /// # Errors
    /// Returns an error if the command cannot be done, what it changes is claimed by another client, or there
    /// is no such claim.
    pub fn apply_for(&mut self, command: &Command, claim: Option<ClaimId>) -> Result<Applied, Error> {
        self.allow(command, claim)?;
        if !self.leaves_what_is_fixed(command) {
            self.step_memory.busy.forget();
        }
        let reply = match command {
            Command::Spawn(spawn) => self.spawn(spawn),
            Command::SpawnAll(spawns) => self.spawn_all(spawns),
            Command::Reload(reload) => self.reload(reload),
            Command::Delete { robot } => self.delete(robot),
            Command::CreateConstraint(create) => self.create_constraint(create),
            Command::ChangeConstraint(change) => self.change_constraint(change),
            Command::DeleteConstraint { name } => self.delete_constraint(name),
            Command::CreateSensor(create) => self.create_sensor(create),
            Command::DeleteSensor { robot, name } => self.delete_sensor(robot, name),
            Command::SetTargets(targets) => self.set_targets(targets, claim),
            Command::FollowTrajectory(trajectory) => self.follow_trajectory(trajectory, claim),
            Command::CancelTrajectory { robot, id } => self.cancel_trajectory(robot, *id, claim),
            Command::ResetJoints { robots } => self.reset_joints(robots),
            Command::SetJointProperties { robot, joints } => self.set_joint_properties(robot, joints),
            Command::SetLinkProperties { robot, links, stays_awake } => {
                self.set_link_properties(robot, links, *stays_awake)
            }
            Command::SetCollisionFilter(change) => self.set_collision_filter(change),
            Command::Claim(request) => self.claim(request),
            Command::Release { claim, cause } => self.release(*claim, cause.clone()),
            Command::SetEntityState { robot, pose, twist } => self.set_entity_state(robot, *pose, *twist),
            Command::ApplyWrench(wrench) => self.apply_wrench(wrench),
            Command::PullLink(pull) => self.pull_link(pull),
            Command::SetPhysics(change) => self.set_physics(change),
            Command::Reset(scope) => self.reset(*scope),
            Command::SaveState { name } => self.save(name),
            Command::RestoreState { name } => self.restore(name),
            Command::DeleteSavedState { name } => self.forget(name),
            Command::ImportSavedState { name, saved } => self.import(name, saved),
        }?;
        Ok(Applied { at: self.now, reply })
    }

    /// Returns whether a command changes no immovable robot, no robot in the lists of [`Busy`], and no
    /// robot's pose.
    fn leaves_what_is_fixed(&self, command: &Command) -> bool {
        match command {
            Command::SetTargets(_)
            | Command::FollowTrajectory(_)
            | Command::CancelTrajectory { .. }
            | Command::CreateSensor(_)
            | Command::DeleteSensor { .. }
            | Command::Claim(_)
            | Command::Release { .. } => true,
            Command::ApplyWrench(wrench) => {
                self.robot_index(&wrench.robot).is_ok_and(|robot| self.entities[robot].moves())
            }
            Command::PullLink(pull) => {
                self.robot_index(&pull.robot).is_ok_and(|robot| self.entities[robot].moves())
            }
            _ => false,
        }
    }

    /// Returns the present moment of the world.
    pub fn now(&self) -> Moment {
        self.now
    }

    /// Returns a fingerprint. It is equal if the state is equal to the bit, for comparing runs of one build
    /// on one machine. It reads what a save copies.
    pub fn fingerprint(&self) -> u64 {
        let Moment { epoch: _, step, sim_time } = self.now;
        let mut bytes = encoded(&(step, sim_time, self.time_base, self.settings));
        for entity in &self.entities {
            bytes.extend(encoded(&entity.state));
            bytes.extend(encoded(entity.body.state()));
        }
        bytes.extend(encoded(&self.contacts.list));
        bytes.extend(encoded(&self.contacts.ignored_overlaps().collect::<Vec<_>>()));
        bytes.extend(encoded(&*self.contacts.collision_pairs));
        bytes.extend(encoded(&self.constraints.list));
        hash(&bytes)
    }

    /// Returns the settings in force.
    pub fn settings(&self) -> &PhysicsSettings {
        &self.settings
    }

    /// Returns the robots, and the location of their values in a published state.
    pub fn layout(&self) -> &Arc<WorldLayout> {
        &self.layout
    }

    /// Returns and clears the events since the last call.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Returns the poses of a robot's colliders at its present pose, in the order of its shapes.
    ///
    /// # Errors
    /// Returns an error if there is no such robot.
    pub fn collider_poses(&self, robot: &str) -> Result<Vec<ColliderPose>, Error> {
        Ok(self.entities[self.robot_index(robot)?].placed_colliders().poses())
    }

    /// Returns the number of colliders.
    pub fn collider_count(&self) -> usize {
        self.entities.iter().map(|entity| entity.colliders.len()).sum()
    }

    /// Returns the number of pairs of colliders whose bounds were compared in the last part of a step. The
    /// cost of finding contacts grows with it.
    pub fn compared_colliders(&self) -> u64 {
        self.contacts.compared()
    }

    /// Returns the index of a robot.
    fn robot_index(&self, robot: &str) -> Result<usize, Error> {
        self.layout.index_of(robot).ok_or_else(|| Error::RobotNotFound {
            robot: robot.to_owned(),
            known: self.entities.iter().map(|entity| entity.state.name.clone()).collect(),
        })
    }

    /// Wakes a robot, the robots that it touches or is constrained to, and those that they touch.
    fn wake_around(&mut self, robot_index: usize) {
        let (contacts, constraints) = (&self.contacts.list, &self.constraints.list);
        sleep::wake_around(&mut self.entities, contacts, constraints, robot_index);
    }

    fn entity_mut(&mut self, robot: &str) -> Result<&mut Entity, Error> {
        let robot_index = self.robot_index(robot)?;
        Ok(&mut self.entities[robot_index])
    }

    fn happened(&mut self, kind: EventKind) {
        self.events.push(Event { at: self.now, kind });
    }

    fn take_version(&mut self) -> u64 {
        self.next_version += 1;
        self.next_version - 1
    }
}

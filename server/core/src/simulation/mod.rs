//! The world: commands that change it, the step, what it looks like.
//!
//! From the bottom to the top; a file imports only from those above it in this list:
//!
//! * `moment`, [`error`], [`settings`], [`contact_settings`], `wrench`, `pull`, `claim`, [`target_sources`], [`trajectory`]: small types.
//! * `check`: which numbers can be. [`sensors`]: what sensors are, their samples and their noise.
//! * [`world_state`]: the state as plain data.
//! * `entity`: one robot. `constraints`, `sleep`, `groups`, `group_memory`, `contacts`: what it is constrained to, whether it rests, what is solved with it, and
//!   what it touches.
//! * [`saved`]: states that are kept. [`robot_settings`]: what commands set.
//! * [`published_state`]: what it shows; [`joint_status`], [`rays`], [`queries`], [`spawn_overlaps`], [`terrain_penetration`], `reactions`, [`measure`]: what follows from that alone, on any
//!   thread.
//! * [`command`], [`event`]: what can be asked of it, and what happens.
//! * [`Simulation`]: the world.
//! * `operations`: what can be done with it.

pub(crate) mod check;
mod claim;
pub mod command;
mod constraints;
pub mod contact_settings;
mod contacts;
mod entity;
pub mod error;
pub mod event;
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
pub use settings::{Integrator, PhysicsSettings, SurfaceCombination};
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
    /// Where sim time is counted from: the step and the time at which the time step last changed.
    time_base: (u64, f64),
    /// In the order of their spawning.
    entities: Vec<Entity>,
    /// As the last step had them.
    contacts: Contacts,
    constraints: LinkConstraints,
    step_memory: StepMemory,
    pool: Option<Arc<dyn Pool>>,
    claims: BTreeMap<ClaimId, Arc<Claim>>,
    /// Whose the world is, beside its robots and joints.
    world_claim: Option<Arc<Claim>>,
    /// Oldest first. Shared with what is published.
    saved: Arc<Vec<NamedSavedState>>,
    /// One a robot. Shared with what is published.
    robot_settings: Arc<Vec<Arc<RobotSettings>>>,
    /// One a robot. Shared with what is published.
    target_sources: Arc<Vec<RobotTargetSources>>,
    /// What is published of sensors, and the samples of the last step.
    sensors: WorldSensors,
    /// Of the next robot or model.
    next_version: u64,
    layout: Arc<WorldLayout>,
    events: Vec<Event>,
}

/// The memory of a step, kept for the next one.
#[derive(Debug, Default)]
struct StepMemory {
    /// One for each piece of work that may be done at one time.
    solvers: GroupMemories,
    groups: Groups,
    busy: Busy,
}

/// What the world's owner allows.
#[derive(Clone, Copy, Debug)]
pub struct WorldLimits {
    /// Robots at one time.
    pub robots: usize,
    /// Kept states.
    pub saved_states: usize,
}

impl Default for WorldLimits {
    fn default() -> Self {
        Self { robots: 1_000, saved_states: 32 }
    }
}

impl Simulation {
    /// An empty world.
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
    /// Those of [`Simulation::apply_for`].
    pub fn apply(&mut self, command: &Command) -> Result<Applied, Error> {
        self.apply_for(command, None)
    }

    /// Applies a command: whole or, where it is refused, not at all. The next step
    /// is the first that it has an effect on.
    ///
    /// # Errors
    /// Returns an error if the command cannot be done, what it changes is claimed by another client, or there is no such claim.
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
            Command::SetLinkProperties { robot, links } => self.set_link_properties(robot, links),
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

    /// Whether a command changes nothing of what cannot move, nor of other robots what [`Busy`] has in its lists, and puts none
    /// elsewhere.
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

    /// The moment that the world is at.
    pub fn now(&self) -> Moment {
        self.now
    }

    /// A number that is equal where the state is equal to the bit, for comparing runs of one build on one
    /// machine. It reads what a save copies.
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

    /// The settings in force.
    pub fn settings(&self) -> &PhysicsSettings {
        &self.settings
    }

    /// The robots that there are, and where their values lie in a published state.
    pub fn layout(&self) -> &Arc<WorldLayout> {
        &self.layout
    }

    /// Takes what happened since the last call.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Where the colliders of a robot are, in the order of its shapes: where its links are now.
    ///
    /// # Errors
    /// Returns an error if there is no such robot.
    pub fn collider_poses(&self, robot: &str) -> Result<Vec<ColliderPose>, Error> {
        Ok(self.entities[self.robot_index(robot)?].placed_colliders().poses())
    }

    /// How many colliders there are.
    pub fn collider_count(&self) -> usize {
        self.entities.iter().map(|entity| entity.colliders.len()).sum()
    }

    /// Pairs of colliders whose bounds were compared in the last part of a step: what the work of finding contacts
    /// grows with.
    pub fn compared_colliders(&self) -> u64 {
        self.contacts.compared()
    }

    /// The index of a robot.
    fn robot_index(&self, robot: &str) -> Result<usize, Error> {
        self.layout.index_of(robot).ok_or_else(|| Error::RobotNotFound {
            robot: robot.to_owned(),
            known: self.entities.iter().map(|entity| entity.state.name.clone()).collect(),
        })
    }

    /// Wakes what a robot touches or is constrained to, and what that touches, and itself.
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

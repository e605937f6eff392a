//! The world: commands that change it, the step, what it looks like.
//!
//! * [`command`]: what can be asked of it; [`error`]: why it refuses.
//! * `check`: which numbers can be.
//! * `robots`, `links`, `joints`, `targets`, `world`: how commands are applied.
//! * `entity`: one robot. `contacts`, `sleep`: what it touches, and whether it rests.
//! * `step`: how they move on.
//! * [`saved`]: states that are kept; [`world_state`]: one of them as plain data.
//! * [`published_state`], [`event`]: what it shows; [`robot_settings`], [`target_sources`], [`rays`], `reactions`: what follows from that
//!   alone, on any thread.

mod check;
pub mod command;
mod contacts;
mod entity;
pub mod error;
pub mod event;
mod joints;
pub mod links;
pub mod published_state;
pub mod rays;
mod reactions;
pub mod robot_settings;
mod robots;
pub mod saved;
pub mod settings;
mod sleep;
mod step;
pub mod target_sources;
mod targets;
#[cfg(test)]
mod tests;
mod world;
pub mod world_state;

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher as _};
use std::sync::Arc;

use command::ClaimId;
pub use command::{Applied, Command, Reply};
use contacts::Contacts;
use entity::{Claim, Entity};
pub use error::Error;
pub use event::{Event, EventKind};
use published_state::{EntityLayout, WorldLayout};
pub use published_state::{Moment, PublishedState};
use robot_settings::RobotSettings;
pub use saved::{Kept, RobotParts, Saved};
use serde::Serialize;
pub use settings::PhysicsSettings;
use step::StepMemory;
use target_sources::RobotTargetSources;

use crate::collision::ColliderPose;

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
    step_memory: StepMemory,
    claims: BTreeMap<ClaimId, Arc<Claim>>,
    /// Oldest first. Shared with what is published.
    saved: Arc<Vec<Kept>>,
    /// One a robot. Shared with what is published.
    robot_settings: Arc<Vec<Arc<RobotSettings>>>,
    /// One a robot. Shared with what is published.
    target_sources: Arc<Vec<RobotTargetSources>>,
    /// Of the next robot or model.
    next_version: u64,
    layout: Arc<WorldLayout>,
    events: Vec<Event>,
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
            step_memory: StepMemory::default(),
            claims: BTreeMap::new(),
            saved: Arc::default(),
            robot_settings: Arc::default(),
            target_sources: Arc::default(),
            next_version: 1,
            layout: Arc::default(),
            events: Vec::new(),
        }
    }

    /// Applies a command: whole or, where it is refused, not at all. The next step
    /// is the first that it has an effect on.
    pub fn apply(&mut self, command: &Command) -> Result<Applied, Error> {
        let reply = match command {
            Command::Spawn(spawn) => self.spawn(spawn),
            Command::Reload(reload) => self.reload(reload),
            Command::Delete { robot } => self.delete(robot),
            Command::SetTargets(targets) => self.set_targets(targets),
            Command::ResetJoints { robots } => self.reset_joints(robots),
            Command::SetJointProperties { robot, joints } => self.set_joint_properties(robot, joints),
            Command::SetLinkProperties { robot, links } => self.set_link_properties(robot, links),
            Command::Claim { claim, holder, joints } => self.claim(*claim, holder, joints),
            Command::Release { claim, lapsed } => self.release(*claim, *lapsed),
            Command::SetEntityState { robot, pose, twist } => self.set_entity_state(robot, *pose, *twist),
            Command::ApplyWrench(wrench) => self.apply_wrench(wrench),
            Command::SetPhysics(change) => self.set_physics(change),
            Command::Reset(scope) => self.reset(*scope),
            Command::SaveState { name } => self.save(name),
            Command::RestoreState { name } => self.restore(name),
            Command::DeleteSavedState { name } => self.forget(name),
            Command::ImportSavedState { name, saved } => self.import(name, saved),
        }?;
        Ok(Applied { at: self.now, reply })
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
        let mut hasher = DefaultHasher::new();
        hasher.write(&bytes);
        hasher.finish()
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

    /// Writes the state of the world into a published state, reusing its memory.
    pub fn observe(&self, state: &mut PublishedState) {
        state.at = self.now;
        share(&mut state.world, &self.layout);
        state.roots.clear();
        for values in [&mut state.positions, &mut state.velocities, &mut state.efforts, &mut state.targets] {
            values.clear();
        }
        state.modes.clear();
        state.gains.clear();
        state.accelerations.clear();
        state.flags.clear();
        let PhysicsSettings { time_step, substeps, .. } = self.settings;
        let h = time_step / f64::from(substeps);
        for entity in &self.entities {
            entity.observe(state, time_step, h);
        }
        state.contacts.clear();
        state.contacts.extend(self.contacts.reports(time_step, h));
        state.applied_wrenches.clear();
        state.applied_wrenches.extend(self.applied_wrenches());
        share(&mut state.settings, &self.robot_settings);
        share(&mut state.target_sources, &self.target_sources);
        share(&mut state.saved, &self.saved);
    }

    /// Where the colliders of a robot are, in the order of its shapes: where its links are now.
    ///
    /// # Errors
    /// Where there is no such robot.
    pub fn collider_poses(&self, robot: &str) -> Result<Vec<ColliderPose>, Error> {
        Ok(self.entities[self.robot_index(robot)?].placed_colliders().poses())
    }

    /// How many colliders there are.
    pub fn collider_count(&self) -> usize {
        self.entities.iter().map(|entity| entity.colliders.len()).sum()
    }

    /// The index of a robot.
    fn robot_index(&self, robot: &str) -> Result<usize, Error> {
        self.entities.iter().position(|entity| entity.state.name == robot).ok_or_else(|| {
            Error::RobotNotFound {
                robot: robot.to_owned(),
                known: self.entities.iter().map(|entity| entity.state.name.clone()).collect(),
            }
        })
    }

    /// Wakes what a robot touches, and what that touches, and itself.
    fn wake_around(&mut self, robot_index: usize) {
        sleep::wake_around(&mut self.entities, &self.contacts.list, robot_index);
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

    /// To be called when robots came, went or changed their model.
    fn lay_out(&mut self) {
        let (mut position, mut velocity) = (0, 0);
        let entities = self.entities.iter().enumerate().map(|(robot_index, entity)| {
            let tree = entity.body.tree();
            let (positions, velocities) =
                (tree.position_count - tree.root_positions(), tree.velocity_count - tree.root_velocities());
            let (first_position, first_velocity) = (position, velocity);
            position += positions;
            velocity += velocities;
            // Of hundreds of robots one more leaves the others as they are. A version is of one robot and model.
            let known = self.layout.entities.get(robot_index).filter(|known| {
                known.version == entity.version
                    && (known.positions.start, known.velocities.start) == (first_position, first_velocity)
            });
            if let Some(known) = known {
                return Arc::clone(known);
            }
            let (joint_positions, joint_velocities) = entity.joint_ranges();
            Arc::new(EntityLayout {
                name: entity.state.name.clone(),
                version: entity.version,
                model: Arc::clone(&entity.model),
                tree: Arc::clone(tree),
                shapes: Arc::clone(entity.colliders.shapes()),
                fixed_base: tree.fixed_base,
                loaded_at_start: entity.state.loaded_at_start,
                positions: first_position..position,
                velocities: first_velocity..velocity,
                joint_positions,
                joint_velocities,
            })
        });
        let layout = Arc::new(WorldLayout { entities: entities.collect() });
        let before = std::mem::replace(&mut self.layout, layout);
        self.keep_target_sources(&before);
        let settings = self.entities.iter().map(|entity| Arc::new(entity.robot_settings()));
        self.robot_settings = Arc::new(settings.collect());
    }
}

/// As bytes. That fails for lists of unknown length only, and no state has one.
fn encoded(value: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap_or_default()
}

/// Makes one what the other is. Both mostly are already, and then no reference is counted.
fn share<T>(one: &mut Arc<T>, other: &Arc<T>) {
    if !Arc::ptr_eq(one, other) {
        *one = Arc::clone(other);
    }
}

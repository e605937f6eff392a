//! States of the world that are kept: under a name, and as plain data.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::command::{MAX_WRENCH_DURATION, SavedStateInfo, WrenchDuration};
use super::contacts::Pair;
use super::entity::Entity;
use super::error::Error;
use super::links::check_surface;
use super::robots::is_robot_name;
use super::world::{SUBSTEPS, TIME_STEP};
use super::world_state::{ActiveWrench, InvalidState, RobotState, WorldState};
use super::{Moment, PhysicsSettings, PublishedState, Reply, Simulation};
use crate::dynamics::articulation::{finite, sizes};
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::{Articulation, Tree};

/// A state of a world. Cheap to share; two are equal where they are the same.
#[derive(Clone, Debug)]
pub struct Saved(Arc<State>);

/// What is kept: all that a step reads and changes.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) at: Moment,
    pub(super) time_base: (u64, f64),
    pub(super) settings: PhysicsSettings,
    pub(super) entities: Vec<Entity>,
    pub(super) contacts: Vec<Contact>,
    pub(super) ignored_overlaps: Vec<Pair>,
}

/// One that a world keeps, under a name. Cheap to copy.
#[derive(Clone, Debug)]
pub struct Kept {
    name: String,
    saved: Saved,
    /// The first of the versions that its robots have here, where the state came from elsewhere: their
    /// versions there may be those of others here.
    versions: Option<u64>,
}

/// Steps of a world at the most, so that counting on from there does not end: half a million years of
/// milliseconds would not reach it.
const MOST_STEPS: u64 = 1 << 53;

impl PartialEq for Saved {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Simulation {
    pub(super) fn save(&mut self, name: &str) -> Result<Reply, Error> {
        let mut state = self.state();
        state.entities.iter_mut().for_each(|entity| entity.claims.fill(None));
        self.keep(name, Saved(Arc::new(state)), false)
    }

    /// A copy of the state, claims included.
    pub(super) fn state(&self) -> State {
        State {
            at: self.now,
            time_base: self.time_base,
            settings: self.settings,
            entities: self.entities.clone(),
            contacts: self.contacts.list.clone(),
            ignored_overlaps: self.contacts.ignored_overlaps().collect(),
        }
    }

    /// Makes a state the present one.
    pub(super) fn go_back(&mut self, state: State) {
        let State { at, time_base, settings, entities, contacts, ignored_overlaps } = state;
        (self.now, self.time_base, self.settings) = (at, time_base, settings);
        self.entities = entities;
        self.contacts.replace(contacts, &ignored_overlaps);
    }

    /// Keeps a state that came from elsewhere.
    pub(super) fn import(&mut self, name: &str, saved: &Saved) -> Result<Reply, Error> {
        let (robots, limit) = (saved.0.entities.len(), self.limits.robots);
        if robots > limit {
            let what = "the number of robots in the saved state".into();
            return Err(Error::LimitExceeded { what, value: robots as u64, limit: limit as u64 });
        }
        self.keep(name, saved.clone(), true)
    }

    fn keep(&mut self, name: &str, saved: Saved, foreign: bool) -> Result<Reply, Error> {
        let name = if name.is_empty() { self.unused_saved_state_name() } else { name.to_owned() };
        let limit = self.limits.saved_states;
        let replaces = self.saved.iter().any(|kept| kept.name == name);
        if !replaces && self.saved.len() >= limit {
            return Err(Error::LimitExceeded {
                what: "the number of saved states".into(),
                value: limit as u64 + 1,
                limit: limit as u64,
            });
        }
        let list = Arc::make_mut(&mut self.saved);
        list.retain(|kept| kept.name != name);
        let versions = foreign.then_some(self.next_version);
        if foreign {
            self.next_version += saved.0.entities.len() as u64;
        }
        let kept = Kept { name, saved, versions };
        let info = kept.info();
        list.push(kept);
        Ok(Reply::SavedState(info))
    }

    pub(super) fn kept(&self, name: &str) -> Result<&Kept, Error> {
        self.saved.iter().find(|kept| kept.name == name).ok_or_else(|| self.no_saved_state(name))
    }

    pub(super) fn forget(&mut self, name: &str) -> Result<Reply, Error> {
        let index = self.saved.iter().position(|kept| kept.name == name);
        let index = index.ok_or_else(|| self.no_saved_state(name))?;
        Arc::make_mut(&mut self.saved).remove(index);
        Ok(Reply::Done)
    }

    fn no_saved_state(&self, name: &str) -> Error {
        no_saved_state(&self.saved, name)
    }

    fn unused_saved_state_name(&self) -> String {
        let mut number = self.saved.len() + 1;
        loop {
            let name = format!("state-{number}");
            if !self.saved.iter().any(|kept| kept.name == name) {
                return name;
            }
            number += 1;
        }
    }
}

fn no_saved_state(saved: &[Kept], name: &str) -> Error {
    let known = saved.iter().map(|kept| kept.name.clone()).collect();
    Error::SavedStateNotFound { name: name.to_owned(), known }
}

impl PublishedState {
    /// A state that the world can go back to, by name.
    ///
    /// # Errors
    /// Where there is no such state.
    pub fn saved(&self, name: &str) -> Result<&Kept, Error> {
        self.saved.iter().find(|kept| kept.name == name).ok_or_else(|| no_saved_state(&self.saved, name))
    }
}

impl Kept {
    /// The state.
    pub fn saved(&self) -> &Saved {
        &self.saved
    }

    /// What is said of it.
    pub fn info(&self) -> SavedStateInfo {
        let State { at, entities, .. } = &*self.saved.0;
        SavedStateInfo { name: self.name.clone(), at: *at, robots: entities.len() }
    }

    /// The state, with the versions that its robots have here.
    pub(super) fn state(&self) -> State {
        let mut state = (*self.saved.0).clone();
        if let Some(first) = self.versions {
            state.entities.iter_mut().zip(first..).for_each(|(entity, version)| entity.version = version);
        }
        state
    }
}

impl Saved {
    /// As plain data.
    pub fn world_state(&self) -> WorldState {
        let State { at, time_base, settings, entities, contacts, ignored_overlaps } = &*self.0;
        WorldState {
            step: at.step,
            sim_time: at.sim_time,
            time_base: *time_base,
            settings: *settings,
            robots: entities.iter().map(robot_state).collect(),
            contacts: contacts.iter().map(super::contacts::contact_state).collect(),
            ignored_overlaps: ignored_overlaps.clone(),
        }
    }

    /// The robots' models, in the order of their spawning.
    pub fn models(&self) -> impl Iterator<Item = &Arc<simd_model::RobotModel>> {
        self.0.entities.iter().map(|entity| &entity.model)
    }

    /// From plain data, every number of which is checked: what is accepted can be stepped.
    ///
    /// # Errors
    /// Where no world can be in such a state.
    pub fn new(state: WorldState) -> Result<Self, InvalidState> {
        let WorldState { step, sim_time, time_base, settings, robots, contacts, ignored_overlaps } = state;
        check_world(step, sim_time, time_base, settings).map_err(InvalidState::World)?;
        let mut names = BTreeSet::new();
        let mut entities = Vec::with_capacity(robots.len());
        for robot in robots {
            let name = robot.name.clone();
            if !is_robot_name(&name) {
                return Err(InvalidState::World(format!("{name:?} is not a valid name of a robot")));
            }
            if !names.insert(name.clone()) {
                return Err(InvalidState::World(format!("there are two robots {name:?}")));
            }
            let invalid = |what| InvalidState::Robot { robot: name, what };
            entities.push(entity(robot).map_err(invalid)?);
        }
        let contacts = super::contacts::contacts(&entities, &contacts).map_err(InvalidState::World)?;
        super::contacts::check_ignored_overlaps(&entities, &ignored_overlaps).map_err(InvalidState::World)?;
        let at = Moment { epoch: 0, step, sim_time };
        Ok(Self(Arc::new(State { at, time_base, settings, entities, contacts, ignored_overlaps })))
    }
}

fn check_world(
    step: u64,
    sim_time: f64,
    time_base: (u64, f64),
    PhysicsSettings { gravity, time_step, substeps }: PhysicsSettings,
) -> Result<(), String> {
    if step > MOST_STEPS || time_base.0 > step {
        return Err(format!("it is at step {step}, with time counted from step {}", time_base.0));
    }
    sizes("the time has numbers", [sim_time, time_base.1])?;
    finite("gravity has numbers", gravity.to_array())?;
    if !TIME_STEP.contains(&time_step) || !SUBSTEPS.contains(&substeps) {
        return Err(format!("its time step of {time_step} s in {substeps} parts cannot be"));
    }
    Ok(())
}

fn robot_state(entity: &Entity) -> RobotState {
    RobotState {
        name: entity.name.clone(),
        loaded_at_start: entity.loaded_at_start,
        model: Arc::clone(&entity.model),
        shapes: Arc::clone(entity.colliders.shapes()),
        fixed_base: entity.is_fixed(),
        contact_settings: entity.contact_settings.clone(),
        surfaces: entity.colliders.surfaces().collect(),
        asleep: entity.asleep.then(|| entity.colliders.save_poses()),
        teleported: entity.teleported,
        still_for: entity.still_for,
        disabled: entity.disabled.as_deref().map(str::to_owned),
        body: entity.body.body_state(),
        spawned: entity.spawned.body_state(),
        last_good: entity.last_good.clone(),
        applied_wrenches: entity.applied_wrenches.clone(),
        expired_wrenches: entity.expired_wrenches.clone(),
    }
}

/// A robot in this state; or what is wrong with it, as a fragment of a sentence.
fn entity(state: RobotState) -> Result<Entity, String> {
    let RobotState {
        name,
        loaded_at_start,
        model,
        shapes,
        fixed_base,
        contact_settings,
        surfaces,
        asleep,
        teleported,
        still_for,
        disabled,
        body,
        spawned,
        last_good,
        applied_wrenches,
        expired_wrenches,
    } = state;
    let mut entity = Entity::new(name, 0, model, fixed_base, body.base, true);
    let tree = Arc::clone(entity.body.tree());
    check_last_good(&tree, &last_good)?;
    check_wrenches(&entity, applied_wrenches.iter().chain(&expired_wrenches))?;
    sizes("a time of rest", [still_for])?;
    entity.body = Articulation::from_body_state(&tree, body)?;
    let in_spawned = |what| format!("{what}, in the state that it was spawned with");
    entity.spawned = Arc::new(Articulation::from_body_state(&tree, spawned).map_err(in_spawned)?);
    entity.contact_settings = contact_settings;
    entity.make_colliders(&shapes).map_err(|error| format!("a surface that cannot be: {error}"))?;
    surfaces.iter().try_for_each(check_surface)?;
    entity.colliders.set_surfaces(&surfaces)?;
    if let Some(poses) = &asleep {
        if !entity.may_sleep() {
            return Err("a sleep that only a single free body can be in".into());
        }
        entity.colliders.restore_poses(poses)?;
    }
    // One that sleeps may wake within a step, and then needs a state to go back to.
    let last_good = if asleep.is_some() && last_good.0.is_empty() {
        (entity.body.positions().to_vec(), entity.body.velocities().to_vec())
    } else {
        last_good
    };
    let (asleep, disabled) = (asleep.is_some(), disabled.map(Arc::from));
    Ok(Entity {
        loaded_at_start,
        teleported,
        still_for,
        asleep,
        disabled,
        applied_wrenches,
        expired_wrenches,
        last_good,
        ..entity
    })
}

fn check_last_good(tree: &Tree, (positions, velocities): &(Vec<f64>, Vec<f64>)) -> Result<(), String> {
    let none = positions.is_empty() && velocities.is_empty();
    if !none && (positions.len(), velocities.len()) != (tree.position_count, tree.velocity_count) {
        return Err(format!(
            "{} positions and {} velocities before the last step, where its model has {} and {}",
            positions.len(),
            velocities.len(),
            tree.position_count,
            tree.velocity_count
        ));
    }
    finite("a state before the last step", positions.iter().chain(velocities).copied())
}

fn check_wrenches<'a>(
    entity: &Entity,
    mut wrenches: impl Iterator<Item = &'a ActiveWrench>,
) -> Result<(), String> {
    wrenches.try_for_each(|wrench| {
        let ActiveWrench { link, force, torque, point, duration, .. } = wrench;
        if *link >= entity.model.links.len() {
            return Err(format!("a wrench on its link {link}, of {}", entity.model.links.len()));
        }
        if let WrenchDuration::For(left) = duration
            && !(0.0..=MAX_WRENCH_DURATION).contains(left)
        {
            return Err(format!("a wrench for {left} s, which is not 0 to {MAX_WRENCH_DURATION}"));
        }
        finite("wrenches", [force, torque, point].into_iter().flat_map(|vector| vector.to_array()))
    })
}

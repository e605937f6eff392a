//! Saving, restoring and deleting states.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::simulation::entity::{Description, Entity};
use crate::simulation::error::Error;
use crate::simulation::saved::{NamedSavedState, Saved, no_saved_state};
use crate::simulation::world_state::{RobotState, WorldState};
use crate::simulation::{Reply, Simulation};

impl Simulation {
    pub(in crate::simulation) fn save(&mut self, name: &str) -> Result<Reply, Error> {
        let (state, robots) = self.state();
        self.keep(name, Saved::of_world(state, robots), false)
    }

    /// Returns the present state, as a save stores it, without a name.
    pub fn to_saved(&self) -> Saved {
        let (state, robots) = self.state();
        Saved::of_world(state, robots)
    }

    /// Returns a copy of the state, and the descriptions of its robots.
    pub(in crate::simulation) fn state(&self) -> (WorldState, Vec<Description>) {
        let state = WorldState {
            step: self.now.step,
            sim_time: self.now.sim_time,
            time_base: self.time_base,
            settings: self.settings,
            robots: self.entities.iter().map(Entity::robot_state).collect(),
            contacts: self.contacts.list.clone(),
            ignored_overlaps: self.contacts.ignored_overlaps().collect(),
            collision_pairs: Arc::clone(&self.contacts.collision_pairs),
            constraints: self.constraints.list.clone(),
        };
        (state, self.entities.iter().map(Entity::description).collect())
    }

    /// Restores a state. Present robots of the same version keep their claims and their scratch.
    pub(in crate::simulation) fn go_back(&mut self, state: &WorldState, robots: &[Description]) {
        let WorldState {
            step,
            sim_time,
            time_base,
            settings,
            robots: states,
            contacts,
            ignored_overlaps,
            collision_pairs,
            constraints,
        } = state;
        (self.now.step, self.now.sim_time) = (*step, *sim_time);
        (self.time_base, self.settings) = (*time_base, *settings);
        let versions = self.entities.iter().map(|entity| entity.version);
        if versions.eq(robots.iter().map(|robot| robot.version)) {
            let entities = self.entities.iter_mut().zip(states);
            entities.for_each(|(entity, state)| entity.set_robot_state(state));
        } else {
            let present = std::mem::take(&mut self.entities).into_iter();
            let mut present: BTreeMap<u64, Entity> = present.map(|entity| (entity.version, entity)).collect();
            let entity = |(state, robot): (&RobotState, &Description)| match present.remove(&robot.version) {
                Some(mut entity) => {
                    entity.set_robot_state(state);
                    entity
                }
                None => Entity::from_state(robot, state.clone()),
            };
            self.entities = states.iter().zip(robots).map(entity).collect();
        }
        self.step_memory.busy.forget();
        self.contacts.replace(contacts.clone(), ignored_overlaps);
        self.contacts.collision_pairs = Arc::clone(collision_pairs);
        self.constraints.replace(constraints.clone());
    }

    /// Makes sensors get new ids: those of a state from elsewhere belong to another world.
    pub(in crate::simulation) fn forget_sensor_ids(&mut self) {
        let sensors = self.entities.iter_mut().flat_map(|entity| &mut entity.state.sensors);
        sensors.for_each(|sensor| sensor.id = 0);
    }

    /// Adds a saved state from elsewhere.
    pub(in crate::simulation) fn import(&mut self, name: &str, saved: &Saved) -> Result<Reply, Error> {
        let (robots, limit) = (saved.robot_count(), self.limits.robots);
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
            self.next_version += saved.robot_count() as u64;
        }
        let kept = NamedSavedState { name, saved, versions };
        let info = kept.info();
        list.push(kept);
        Ok(Reply::SavedState(info))
    }

    pub(in crate::simulation) fn kept(&self, name: &str) -> Result<&NamedSavedState, Error> {
        self.saved.iter().find(|kept| kept.name == name).ok_or_else(|| self.no_saved_state(name))
    }

    pub(in crate::simulation) fn forget(&mut self, name: &str) -> Result<Reply, Error> {
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

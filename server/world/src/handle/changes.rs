//! Tracks since when each robot is unchanged, so that pollers receive deltas.
//!
//! States are compared only when a client asks, and never on the physics thread.

use std::collections::{HashMap, HashSet};
use std::sync::{Arc, Mutex, PoisonError};

use simd_core::simulation::published_state::{EntityLayout, Flags, Mode, PublishedState, RootState};

use super::SimHandle;
use crate::driver::Published;

/// Tolerance of positions of joints and poses of roots: metres, radians and components of quaternions. Here
/// and below, it is half of the schema's: a client may have values that differ by as much from the compared
/// ones.
const POSITION: f64 = 5e-8;
/// Tolerance of velocities, m/s and rad/s.
const VELOCITY: f64 = 5e-5;
/// Tolerance of efforts, N and N m.
const EFFORT: f64 = 5e-4;

impl SimHandle {
    /// Returns the newest state. Also returns, by index, which of its robots are unchanged since this
    /// method's answer with the state of sequence `since`.
    pub fn newest_with_unchanged(&self, since: u64) -> (Arc<Published>, Vec<bool>) {
        self.inner.changes.look(since, || self.newest())
    }
}

/// Values of robots at their last change.
#[derive(Debug, Default)]
pub(super) struct ChangeTracker(Mutex<Known>);

#[derive(Debug, Default)]
struct Known {
    /// Sequence of the last compared state.
    sequence: u64,
    /// Values by layout version.
    robots: HashMap<u64, Values>,
}

/// Values of a robot with one layout version.
#[derive(Debug)]
struct Values {
    /// Sequence of the state with these values.
    changed_at: u64,
    root: Option<RootState>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    efforts: Vec<f64>,
    targets: Vec<f64>,
    modes: Vec<Mode>,
    flags: Vec<Flags>,
}

impl ChangeTracker {
    /// Takes the newest state while no other call looks, so that the compared states never go back.
    fn look(&self, since: u64, newest: impl FnOnce() -> Arc<Published>) -> (Arc<Published>, Vec<bool>) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let published = newest();
        if known.sequence != published.sequence {
            known.compare(&published);
        }
        // A number from before a restart of the daemon may be larger.
        let is_known = since <= published.sequence;
        let is_unchanged = |entity: &Arc<EntityLayout>| {
            known.robots.get(&entity.version).is_some_and(|values| values.changed_at <= since)
        };
        let entities = &published.state.world.entities;
        let unchanged = entities.iter().map(|entity| is_known && is_unchanged(entity)).collect();
        drop(known);
        (published, unchanged)
    }
}

impl Known {
    fn compare(&mut self, published: &Published) {
        self.sequence = published.sequence;
        let entities = &published.state.world.entities;
        for (index, entity) in entities.iter().enumerate() {
            match self.robots.get_mut(&entity.version) {
                Some(values) if values.are_close(&published.state, index, entity) => {}
                Some(values) => *values = Values::of(published, index, entity),
                None => drop(self.robots.insert(entity.version, Values::of(published, index, entity))),
            }
        }
        if self.robots.len() > entities.len() {
            let there: HashSet<u64> = entities.iter().map(|entity| entity.version).collect();
            self.robots.retain(|version, _| there.contains(version));
        }
    }
}

impl Values {
    fn of(published: &Published, index: usize, entity: &EntityLayout) -> Self {
        let state = &published.state;
        let (positions, velocities) = (entity.positions.clone(), entity.velocities.clone());
        Self {
            changed_at: published.sequence,
            root: state.roots.get(index).cloned(),
            positions: state.positions[positions].to_vec(),
            velocities: state.velocities[velocities.clone()].to_vec(),
            efforts: state.efforts[velocities.clone()].to_vec(),
            targets: state.targets[velocities.clone()].to_vec(),
            modes: state.modes[velocities.clone()].to_vec(),
            flags: state.flags[velocities].to_vec(),
        }
    }

    fn are_close(&self, state: &PublishedState, index: usize, entity: &EntityLayout) -> bool {
        let (positions, velocities) = (entity.positions.clone(), entity.velocities.clone());
        let is_root_close = match (&self.root, state.roots.get(index)) {
            (Some(root), Some(now)) => are_roots_close(root, now),
            (root, now) => root.is_none() && now.is_none(),
        };
        is_root_close
            && are_close(&self.positions, &state.positions[positions], POSITION)
            && are_close(&self.velocities, &state.velocities[velocities.clone()], VELOCITY)
            && are_close(&self.efforts, &state.efforts[velocities.clone()], EFFORT)
            && are_close(&self.targets, &state.targets[velocities.clone()], 0.0)
            && self.modes == state.modes[velocities.clone()]
            && self.flags == state.flags[velocities]
    }
}

fn are_roots_close(one: &RootState, other: &RootState) -> bool {
    let values = |root: &RootState| {
        [root.pose.translation.to_array(), root.linear.to_array(), root.angular.to_array()]
    };
    let rotation = |root: &RootState| root.pose.rotation.to_array();
    let [position, linear, angular] = values(one);
    let [other_position, other_linear, other_angular] = values(other);
    one.disabled == other.disabled
        && are_close(&position, &other_position, POSITION)
        && are_close(&rotation(one), &rotation(other), POSITION)
        && are_close(&linear, &other_linear, VELOCITY)
        && are_close(&angular, &other_angular, VELOCITY)
}

/// Returns whether two lists are equal within a tolerance. NaN is never close to anything.
fn are_close(one: &[f64], other: &[f64], least: f64) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(one, other)| (one - other).abs() <= least)
}

//! Samples of cameras: of each that is wanted the newest, with the state that it is of. What is not wanted holds no state.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::SensorKind;

use super::scans::{CountedSample, DueSamples};
use crate::driver::published::Published;

/// A sample of a camera.
#[derive(Clone, Debug)]
pub(crate) struct CameraSample {
    /// What is to be seen.
    pub(crate) state: Arc<Published>,
    /// Samples before it that were never taken from here.
    pub(crate) missed: u64,
}

/// The samples of cameras.
#[derive(Debug, Default)]
pub(super) struct CameraSamples {
    /// The ids of the cameras that there are.
    cameras: BTreeSet<u64>,
    /// By the ids of those that are wanted the count of the last sample that was taken from here; of the one before the first
    /// where none was.
    wanted: BTreeMap<u64, Option<u64>>,
    /// Each with its count of those of its sensor.
    newest: BTreeMap<u64, (u64, CameraSample)>,
}

impl CameraSamples {
    /// Keeps those of the sensors that there are.
    pub(super) fn follow(&mut self, sensors: &[WorldSensor]) {
        let is_camera = |sensor: &&WorldSensor| matches!(sensor.definition.kind, SensorKind::Camera(_));
        self.cameras = sensors.iter().filter(is_camera).map(|sensor| sensor.id).collect();
        let Self { cameras, wanted, newest } = self;
        wanted.retain(|id, _| cameras.contains(id));
        newest.retain(|id, _| cameras.contains(id));
    }

    /// Takes the samples of cameras out of those of a state.
    pub(super) fn take_from(&mut self, due: &mut DueSamples) {
        let DueSamples { state, samples } = due;
        for CountedSample { count, sample } in samples.extract_if(.., |of| of.sample.is_of_camera()) {
            let Some(taken) = self.wanted.get_mut(&sample.id) else { continue };
            let taken = *taken.get_or_insert(count - 1);
            let missed = (count - 1).saturating_sub(taken);
            self.newest.insert(sample.id, (count, CameraSample { state: Arc::clone(state), missed }));
        }
    }

    /// Those that came.
    pub(super) fn take(&mut self) -> Vec<(u64, CameraSample)> {
        let newest = std::mem::take(&mut self.newest);
        for (id, (count, _)) in &newest {
            self.wanted.insert(*id, Some(*count));
        }
        newest.into_iter().map(|(id, (_, sample))| (id, sample)).collect()
    }

    /// The cameras whose samples count from now on, by their ids.
    pub(super) fn want(&mut self, ids: impl Iterator<Item = u64>) {
        let Self { cameras, wanted, newest } = self;
        let now = ids.filter(|id| cameras.contains(id));
        *wanted = now.map(|id| (id, wanted.get(&id).copied().flatten())).collect();
        newest.retain(|id, _| wanted.contains_key(id));
    }
}

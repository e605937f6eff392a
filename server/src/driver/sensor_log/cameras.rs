//! Samples of cameras: of each that is wanted the newest, with the state that it is of. What is not wanted holds no state.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::SensorKind;

use super::scans::DueSamples;
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
    /// The ids of those that are wanted.
    wanted: BTreeSet<u64>,
    newest: BTreeMap<u64, CameraSample>,
}

impl CameraSamples {
    /// Keeps those of the sensors that there are.
    pub(super) fn follow(&mut self, sensors: &[WorldSensor]) {
        let is_camera = |sensor: &&WorldSensor| matches!(sensor.definition.kind, SensorKind::Camera(_));
        self.cameras = sensors.iter().filter(is_camera).map(|sensor| sensor.id).collect();
        let Self { cameras, wanted, newest } = self;
        wanted.retain(|id| cameras.contains(id));
        newest.retain(|id, _| cameras.contains(id));
    }

    /// Takes the samples of cameras out of those of a state.
    pub(super) fn take_from(&mut self, due: &mut DueSamples) {
        let DueSamples { state, samples } = due;
        for sample in samples.extract_if(.., |sample| sample.is_of_camera()) {
            if !self.wanted.contains(&sample.id) {
                continue;
            }
            let new = CameraSample { state: Arc::clone(state), missed: 0 };
            let older = self.newest.insert(sample.id, new);
            if let (Some(older), Some(new)) = (older, self.newest.get_mut(&sample.id)) {
                new.missed = older.missed + 1;
            }
        }
    }

    /// So many samples found no room. Whether they are a camera's.
    pub(super) fn lose(&mut self, id: u64, count: u64) -> bool {
        if let Some(sample) = self.newest.get_mut(&id) {
            sample.missed += count;
        }
        self.cameras.contains(&id)
    }

    /// Those that came.
    pub(super) fn take(&mut self) -> Vec<(u64, CameraSample)> {
        std::mem::take(&mut self.newest).into_iter().collect()
    }

    /// The cameras whose samples count from now on, by their ids.
    pub(super) fn want(&mut self, ids: impl Iterator<Item = u64>) {
        self.wanted = ids.filter(|id| self.cameras.contains(id)).collect();
        let Self { cameras: _, wanted, newest } = self;
        newest.retain(|id, _| wanted.contains(id));
    }
}

//! Samples of cameras: the newest sample of each wanted camera, with its state. Unwanted cameras hold no
//! state.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::SensorKind;

use super::scans::{CountedSample, DueSamples};
use crate::driver::published::Published;

/// A sample of a camera.
#[derive(Clone, Debug)]
pub(crate) struct CameraSample {
    /// State to draw.
    pub(crate) state: Arc<Published>,
    /// Number of earlier samples that were never taken from here.
    pub(crate) missed: u64,
}

/// Samples of cameras.
#[derive(Debug, Default)]
pub(super) struct CameraSamples {
    /// Ids of the present cameras.
    cameras: BTreeSet<u64>,
    /// Wanted cameras by id, with the count of the last taken sample; before the first one, the count
    /// preceding it.
    wanted: BTreeMap<u64, Option<u64>>,
    /// Newest samples, each with its count within its sensor.
    newest: BTreeMap<u64, (u64, CameraSample)>,
}

impl CameraSamples {
    /// Drops samples of sensors that no longer exist.
    pub(super) fn follow(&mut self, sensors: &[WorldSensor]) {
        let is_camera = |sensor: &&WorldSensor| matches!(sensor.definition.kind, SensorKind::Camera(_));
        self.cameras = sensors.iter().filter(is_camera).map(|sensor| sensor.id).collect();
        let Self { cameras, wanted, newest } = self;
        wanted.retain(|id, _| cameras.contains(id));
        newest.retain(|id, _| cameras.contains(id));
    }

    /// Takes the samples of cameras out of a state's samples.
    pub(super) fn take_from(&mut self, due: &mut DueSamples) {
        let DueSamples { state, samples } = due;
        for CountedSample { count, sample } in samples.extract_if(.., |of| of.sample.is_of_camera()) {
            let Some(taken) = self.wanted.get_mut(&sample.id) else { continue };
            let taken = *taken.get_or_insert(count - 1);
            let missed = (count - 1).saturating_sub(taken);
            self.newest.insert(sample.id, (count, CameraSample { state: Arc::clone(state), missed }));
        }
    }

    /// Takes the samples that arrived.
    pub(super) fn take(&mut self) -> Vec<(u64, CameraSample)> {
        let newest = std::mem::take(&mut self.newest);
        for (id, (count, _)) in &newest {
            self.wanted.insert(*id, Some(*count));
        }
        newest.into_iter().map(|(id, (_, sample))| (id, sample)).collect()
    }

    /// Sets the wanted cameras, by their ids.
    pub(super) fn want(&mut self, ids: impl Iterator<Item = u64>) {
        let Self { cameras, wanted, newest } = self;
        let now = ids.filter(|id| cameras.contains(id));
        *wanted = now.map(|id| (id, wanted.get(&id).copied().flatten())).collect();
        newest.retain(|id, _| wanted.contains_key(id));
    }
}

//! Samples whose measurement takes long: those that wait, and those that are being measured. Of each sensor the newest waits
//! and one is measured at a time, so that its readings come in order. The sensor of which none was begun for longest is next:
//! where there is more to measure than time, each is measured less often, and none is left out.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use simd_core::simulation::sensors::DueSample;

use crate::driver::published::Published;

/// States that are held for samples which wait.
const MOST_STATES: usize = 16;

/// The samples of one state.
#[derive(Debug)]
pub(super) struct DueSamples {
    pub(super) state: Arc<Published>,
    pub(super) samples: Vec<CountedSample>,
}

/// A sample with its count of those of its sensor, from 1.
#[derive(Debug)]
pub(super) struct CountedSample {
    pub(super) count: u64,
    pub(super) sample: DueSample,
}

/// Samples that wait or are being measured.
#[derive(Debug, Default)]
pub(super) struct Scans {
    /// Oldest first. A sensor is in it once.
    waiting: VecDeque<DueSamples>,
    /// The sequence of the state, by sensor.
    under_way: BTreeMap<u64, u64>,
    /// When the last sample of a sensor was begun, counted in samples.
    begun: BTreeMap<u64, u64>,
    /// Samples that were begun.
    count: u64,
}

impl Scans {
    /// Adds samples. Older ones of the same sensors that wait are not going to be measured.
    pub(super) fn add(&mut self, due: DueSamples) {
        let newer: BTreeSet<u64> = due.samples.iter().map(|counted| counted.sample.id).collect();
        self.retain_waiting(|id| !newer.contains(&id));
        if !due.samples.is_empty() {
            self.waiting.push_back(due);
        }
        let many = self.waiting.len().saturating_sub(MOST_STATES);
        self.waiting.drain(..many);
    }

    /// Takes a sample of a sensor of which none is being measured: of those the one whose last was begun first, and of sensors
    /// of which none ever was the oldest.
    pub(super) fn begin(&mut self) -> Option<(Arc<Published>, CountedSample)> {
        let samples = self.waiting.iter().enumerate().flat_map(|(group, due)| {
            due.samples.iter().enumerate().map(move |(index, counted)| (group, index, counted.sample.id))
        });
        let (group, index, id) = samples
            .filter(|(_, _, id)| !self.under_way.contains_key(id))
            .min_by_key(|(_, _, id)| self.begun.get(id).copied())?;
        let due = self.waiting.get_mut(group)?;
        let sample = due.samples.remove(index);
        let state = Arc::clone(&due.state);
        if due.samples.is_empty() {
            self.waiting.remove(group);
        }
        self.count += 1;
        self.begun.insert(id, self.count);
        self.under_way.insert(id, state.sequence);
        Some((state, sample))
    }

    /// The sample of a sensor that was being measured is no longer.
    pub(super) fn end(&mut self, id: u64) {
        self.under_way.remove(&id);
    }

    /// Whether a sample waits that can be measured now.
    pub(super) fn is_ready(&self) -> bool {
        let is_free = |counted: &CountedSample| !self.under_way.contains_key(&counted.sample.id);
        self.waiting.iter().any(|due| due.samples.iter().any(is_free))
    }

    /// The sequence of the newest state of which a sample of this sensor waits or is being measured.
    pub(super) fn due_by(&self, id: u64) -> Option<u64> {
        let waits = |due: &&DueSamples| due.samples.iter().any(|counted| counted.sample.id == id);
        let waiting = self.waiting.iter().rev().find(waits).map(|due| due.state.sequence);
        waiting.or_else(|| self.under_way.get(&id).copied())
    }

    /// Keeps the samples of sensors that are still there.
    pub(super) fn retain(&mut self, is_there: impl Fn(u64) -> bool) {
        self.retain_waiting(&is_there);
        self.begun.retain(|id, _| is_there(*id));
    }

    fn retain_waiting(&mut self, stays: impl Fn(u64) -> bool) {
        for due in &mut self.waiting {
            due.samples.retain(|counted| stays(counted.sample.id));
        }
        self.waiting.retain(|due| !due.samples.is_empty());
    }
}

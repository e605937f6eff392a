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
    pub(super) samples: Vec<DueSample>,
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
    /// Adds samples; says of which sensors one is not going to be measured for it, once for each.
    pub(super) fn add(&mut self, due: DueSamples) -> Vec<u64> {
        let mut lost = Vec::new();
        let newer: BTreeSet<u64> = due.samples.iter().map(|sample| sample.id).collect();
        for older in &mut self.waiting {
            lost.extend(
                older.samples.extract_if(.., |sample| newer.contains(&sample.id)).map(|gone| gone.id),
            );
        }
        self.waiting.push_back(due);
        self.waiting.retain(|due| !due.samples.is_empty());
        while self.waiting.len() > MOST_STATES {
            let gone = self.waiting.pop_front();
            lost.extend(gone.into_iter().flat_map(|gone| gone.samples).map(|sample| sample.id));
        }
        lost
    }

    /// Takes a sample of a sensor of which none is being measured: of those the one whose last was begun first, and of sensors
    /// of which none ever was the oldest.
    pub(super) fn begin(&mut self) -> Option<(Arc<Published>, DueSample)> {
        let samples = self.waiting.iter().enumerate().flat_map(|(group, due)| {
            due.samples.iter().enumerate().map(move |(place, sample)| (group, place, sample.id))
        });
        let (group, place, id) = samples
            .filter(|(_, _, id)| !self.under_way.contains_key(id))
            .min_by_key(|(_, _, id)| self.begun.get(id).copied())?;
        let due = self.waiting.get_mut(group)?;
        let sample = due.samples.remove(place);
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
        let is_free = |sample: &DueSample| !self.under_way.contains_key(&sample.id);
        self.waiting.iter().any(|due| due.samples.iter().any(is_free))
    }

    /// The sequence of the newest state of which a sample of this sensor waits or is being measured.
    pub(super) fn due_by(&self, id: u64) -> Option<u64> {
        let waits = |due: &&DueSamples| due.samples.iter().any(|sample| sample.id == id);
        let waiting = self.waiting.iter().rev().find(waits).map(|due| due.state.sequence);
        waiting.or_else(|| self.under_way.get(&id).copied())
    }

    /// Keeps the samples of sensors that are still there.
    pub(super) fn retain(&mut self, is_there: impl Fn(u64) -> bool) {
        for due in &mut self.waiting {
            due.samples.retain(|sample| is_there(sample.id));
        }
        self.waiting.retain(|due| !due.samples.is_empty());
        self.begun.retain(|id, _| is_there(*id));
    }
}

//! Samples whose measurement takes long: waiting ones, and those being measured.
//!
//! For each sensor, only the newest sample waits and one is measured at a time, so that its readings are in
//! order. The sensor whose last measurement began longest ago is next. Under overload, each sensor is
//! measured less often, and none is left out.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use simd_core::simulation::sensors::DueSample;

use crate::driver::published::Published;

/// Maximum number of states that waiting samples hold.
const MAX_STATES: usize = 16;

/// Samples of one state.
#[derive(Debug)]
pub(super) struct DueSamples {
    pub(super) state: Arc<Published>,
    pub(super) samples: Vec<CountedSample>,
}

/// A sample with its count within its sensor, from 1.
#[derive(Debug)]
pub(super) struct CountedSample {
    pub(super) count: u64,
    pub(super) sample: DueSample,
}

/// Samples that wait or are being measured.
#[derive(Debug, Default)]
pub(super) struct Scans {
    /// Waiting samples, oldest first. Each sensor occurs once.
    waiting: VecDeque<DueSamples>,
    /// Sequence of the state being measured, by sensor.
    under_way: BTreeMap<u64, u64>,
    /// Value of `count` when the last measurement of a sensor began.
    begun: BTreeMap<u64, u64>,
    /// Number of begun measurements.
    count: u64,
}

impl Scans {
    /// Adds samples. They replace older waiting samples of the same sensors.
    pub(super) fn add(&mut self, due: DueSamples) {
        let newer: BTreeSet<u64> = due.samples.iter().map(|counted| counted.sample.id).collect();
        self.retain_waiting(|id| !newer.contains(&id));
        if !due.samples.is_empty() {
            self.waiting.push_back(due);
        }
        let many = self.waiting.len().saturating_sub(MAX_STATES);
        self.waiting.drain(..many);
    }

    /// Takes a sample of a sensor that is not being measured. The sensor whose last measurement began first
    /// is preferred. Sensors without any measurement come before it, oldest sample first.
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

    /// Notes that the sensor's measurement ended.
    pub(super) fn end(&mut self, id: u64) {
        self.under_way.remove(&id);
    }

    /// Returns whether a waiting sample can be measured now.
    pub(super) fn is_ready(&self) -> bool {
        let is_free = |counted: &CountedSample| !self.under_way.contains_key(&counted.sample.id);
        self.waiting.iter().any(|due| due.samples.iter().any(is_free))
    }

    /// Returns the sequence of the newest state with a sample of this sensor that waits or is being measured.
    pub(super) fn due_by(&self, id: u64) -> Option<u64> {
        let waits = |due: &&DueSamples| due.samples.iter().any(|counted| counted.sample.id == id);
        let waiting = self.waiting.iter().rev().find(waits).map(|due| due.state.sequence);
        waiting.or_else(|| self.under_way.get(&id).copied())
    }

    /// Keeps only the samples of present sensors.
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

//! The driver's end of the log of readings: measures cheap samples, and hands readings over without waiting
//! for a reader.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use simd_core::simulation::measure::SensorReading;
use simd_core::simulation::sensors::{DueSample, WorldSensor};

use super::reading::OfState;
use super::scans::{CountedSample, DueSamples};
use super::{Batch, MAX_WAITING, SensorLog};

/// The driver's end of a [`SensorLog`].
#[derive(Debug)]
pub(in crate::driver) struct SensorWriter {
    log: Arc<SensorLog>,
    /// Sensors of the last published state.
    sensors: Arc<Vec<WorldSensor>>,
    /// Due samples, kept for their memory.
    due: Vec<DueSample>,
    /// Measured readings, kept for their memory.
    measured: Vec<SensorReading>,
    /// Number of expected readings since a sensor was created, by its id. A reading lost on the way shows as
    /// a gap.
    counts: BTreeMap<u64, u64>,
}

impl SensorWriter {
    pub(super) fn new(log: Arc<SensorLog>) -> Self {
        Self { log, sensors: Arc::default(), due: Vec::new(), measured: Vec::new(), counts: BTreeMap::new() }
    }

    /// Notifies readers if the published state has new sensors, or lacks deleted ones.
    pub(in crate::driver) fn published(&mut self) {
        let newest = self.log.state_cell.newest();
        if !Arc::ptr_eq(&self.sensors, &newest.state.sensors) {
            self.sensors = Arc::clone(&newest.state.sensors);
            let ids: BTreeSet<u64> = self.sensors.iter().map(|sensor| sensor.id).collect();
            self.counts.retain(|id, _| ids.contains(id));
            self.announce();
        }
    }

    /// Measures the samples that a step has taken; their state is the newest published one. Samples that take
    /// long are left to threads of lower priority.
    pub(in crate::driver) fn measure(&mut self, take: impl FnOnce(&mut Vec<DueSample>)) {
        take(&mut self.due);
        if self.due.is_empty() {
            return;
        }
        let state = self.log.state_cell.newest();
        let counts = &mut self.counts;
        let long = self.due.extract_if(.., |due| due.takes_long());
        let samples: Vec<CountedSample> =
            long.map(|sample| CountedSample { count: count(counts, sample.id), sample }).collect();
        if !self.due.is_empty() {
            state.state.readings(&self.due, &mut self.measured);
            self.due.clear();
            let of = OfState { wall_time: state.wall_time, sequence: state.sequence };
            self.hand_over(of);
        }
        if !samples.is_empty() {
            drop(self.log.due.force_push(DueSamples { state, samples }));
        }
        self.announce();
    }

    /// Passes on these readings of a state.
    #[cfg(test)]
    pub(super) fn put(&mut self, of: OfState, readings: Vec<SensorReading>) {
        self.measured = readings;
        self.hand_over(of);
    }

    /// Passes on the measured readings. If the queue is full, the oldest are dropped.
    fn hand_over(&mut self, of: OfState) {
        let mut readings = self.log.emptied.pop().unwrap_or_default();
        let counts = &mut self.counts;
        readings.extend(self.measured.drain(..).map(|reading| (count(counts, reading.id), reading)));
        self.log.waiting.fetch_add(readings.len(), Ordering::Relaxed);
        let mut gone = self.log.arrived.force_push(Batch { of, readings });
        loop {
            if let Some(Batch { of: _, readings }) = gone {
                self.log.waiting.fetch_sub(readings.len(), Ordering::Relaxed);
            }
            if self.log.waiting.load(Ordering::Relaxed) <= MAX_WAITING {
                return;
            }
            gone = self.log.arrived.pop();
            if gone.is_none() {
                return;
            }
        }
    }

    pub(super) fn announce(&self) {
        self.log.announcer.hand_over();
    }
}

/// Returns the count of a sensor's next reading.
fn count(counts: &mut BTreeMap<u64, u64>, id: u64) -> u64 {
    let count = counts.entry(id).or_default();
    *count += 1;
    *count
}

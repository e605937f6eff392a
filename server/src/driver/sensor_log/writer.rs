//! The driver's end of the log of readings: measures what is cheap, and hands it over without waiting for a reader.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use simd_core::simulation::sensors::{DueSample, WorldSensor};

use super::reading::OfState;
use super::scans::DueSamples;
use super::{Batch, MOST_WAITING, SensorLog};

/// The driver's end of a [`SensorLog`].
#[derive(Debug)]
pub(in crate::driver) struct SensorWriter {
    log: Arc<SensorLog>,
    /// The sensors that there were in the last published state.
    sensors: Arc<Vec<WorldSensor>>,
    /// For its memory.
    due: Vec<DueSample>,
    /// Readings that found no room, by sensor.
    pub(super) lost: BTreeMap<u64, u64>,
}

impl SensorWriter {
    pub(super) fn new(log: Arc<SensorLog>) -> Self {
        Self { log, sensors: Arc::default(), due: Vec::new(), lost: BTreeMap::new() }
    }

    /// A state was published: readers are to know where a sensor came or went.
    pub(in crate::driver) fn published(&mut self) {
        let newest = self.log.board.newest();
        if !Arc::ptr_eq(&self.sensors, &newest.state.sensors) {
            self.sensors = Arc::clone(&newest.state.sensors);
            self.announce();
        }
    }

    /// Measures what a step has taken samples of, whose state is the newest published one. What takes long is left to
    /// threads that give way to this one.
    pub(in crate::driver) fn measure(&mut self, take: impl FnOnce(&mut Vec<DueSample>)) {
        take(&mut self.due);
        if self.due.is_empty() {
            return;
        }
        let state = self.log.board.newest();
        let samples: Vec<DueSample> = self.due.extract_if(.., |due| due.takes_long()).collect();
        if !self.due.is_empty() || !self.lost.is_empty() {
            let mut readings = self.log.emptied.pop().unwrap_or_default();
            state.state.readings(&self.due, &mut readings);
            self.due.clear();
            let of = OfState { wall_time: state.wall_time, sequence: state.sequence };
            let lost = std::mem::take(&mut self.lost);
            self.hand_over(Batch { of, readings, lost });
        }
        if !samples.is_empty()
            && let Some(gone) = self.log.due.force_push(DueSamples { state, samples })
        {
            gone.samples.iter().for_each(|sample| self.lose(sample.id, 1));
        }
        self.announce();
    }

    /// What is older gives way where there is no room.
    pub(super) fn hand_over(&mut self, batch: Batch) {
        self.log.waiting.fetch_add(batch.readings.len(), Ordering::Relaxed);
        let mut gone = self.log.arrived.force_push(batch);
        loop {
            if let Some(Batch { of: _, readings, lost }) = gone {
                self.log.waiting.fetch_sub(readings.len(), Ordering::Relaxed);
                readings.iter().for_each(|reading| self.lose(reading.id, 1));
                lost.into_iter().for_each(|(id, count)| self.lose(id, count));
            }
            if self.log.waiting.load(Ordering::Relaxed) <= MOST_WAITING {
                return;
            }
            gone = self.log.arrived.pop();
            if gone.is_none() {
                return;
            }
        }
    }

    fn lose(&mut self, id: u64, count: u64) {
        *self.lost.entry(id).or_default() += count;
    }

    pub(super) fn announce(&self) {
        self.log.handed_over.fetch_add(1, Ordering::Release);
        self.log.announcer.wake();
    }
}

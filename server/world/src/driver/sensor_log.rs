//! Log of sensor readings for any number of readers: the last readings of each sensor, numbered.
//!
//! The driver hands readings over through a queue without a lock, and waits for no reader: see `writer`.
//! Readers lock the kept readings, and first move the queued ones to them. So each sees everything that was
//! handed over before its call. One task does the same for waiting readers, and wakes them.
//!
//! * `reading`: a kept reading. `ring`: the last readings of one sensor.
//! * `scans`: samples whose measurement takes long. `cameras`: samples of cameras. `writer`: the driver's
//!   end.

mod cameras;
mod reading;
mod ring;
mod scans;
#[cfg(test)]
mod tests;
mod writer;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crossbeam_queue::ArrayQueue;
use simd_core::simulation::measure::SensorReading;
use simd_core::simulation::sensors::WorldSensor;
use tokio::sync::Notify;
use tokio::sync::futures::Notified;

use super::announcer::Announcer;
use super::published::Published;
use super::published_state_cell::PublishedStateCell;
pub(crate) use cameras::CameraSample;
use cameras::CameraSamples;
use reading::OfState;
pub use reading::{ContactReading, LoggedReading, Measured, NamedContactPartner};
pub use ring::ReadingBatch;
use ring::Ring;
use scans::{CountedSample, DueSamples, Scans};
pub(super) use writer::SensorWriter;

/// Maximum bytes of all kept readings.
const MAX_BYTES: usize = 64 << 20;
/// Maximum bytes of one sensor's kept readings.
const MAX_BYTES_PER_SENSOR: usize = 4 << 20;
/// Capacity of the queue, steps.
const MAX_STEPS: usize = 4_096;
/// Capacity of the queue, readings.
const MAX_WAITING: usize = 65_536;
/// Maximum number of empty lists kept for reuse.
const EMPTIED: usize = 16;
/// Maximum number of queued steps with samples that take long.
const MAX_SLOW_STEPS: usize = 16;

/// Readings of a step.
#[derive(Debug)]
struct Batch {
    of: OfState,
    /// Readings, each with its count within its sensor.
    readings: Vec<(u64, SensorReading)>,
}

/// Log of the last readings of each sensor.
#[derive(Debug)]
pub(crate) struct SensorLog {
    /// Published states, which list the sensors.
    state_cell: Arc<PublishedStateCell>,
    arrived: ArrayQueue<Batch>,
    /// Number of readings in `arrived`.
    waiting: AtomicUsize,
    /// Empty lists for the driver to fill.
    emptied: ArrayQueue<Vec<(u64, SensorReading)>>,
    due: ArrayQueue<DueSamples>,
    announcer: Announcer,
    /// Locked for a look, never by the driver.
    kept: Mutex<Kept>,
    grown: Notify,
    scan_is_due: Notify,
}

#[derive(Debug)]
struct Kept {
    /// Kept readings by sensor.
    rings: BTreeMap<u64, Ring>,
    /// Sensors that have a ring.
    sensors: Arc<Vec<WorldSensor>>,
    /// Maximum bytes of each ring.
    share: usize,
    /// Largest number of any reading.
    last_sequence: u64,
    scans: Scans,
    cameras: CameraSamples,
}

/// A sample to measure. While it exists, no other sample of its sensor is measured.
#[derive(Debug)]
pub(crate) struct Scan {
    log: Arc<SensorLog>,
    state: Arc<Published>,
    sample: CountedSample,
    reading: Option<SensorReading>,
}

impl SensorLog {
    /// Makes a log for the sensors of published states, and the driver's end.
    pub(super) fn new(state_cell: Arc<PublishedStateCell>) -> (Arc<Self>, SensorWriter) {
        let kept = Kept {
            rings: BTreeMap::new(),
            sensors: Arc::default(),
            share: MAX_BYTES_PER_SENSOR,
            last_sequence: 0,
            scans: Scans::default(),
            cameras: CameraSamples::default(),
        };
        let log = Arc::new(Self {
            state_cell,
            arrived: ArrayQueue::new(MAX_STEPS),
            waiting: AtomicUsize::new(0),
            emptied: ArrayQueue::new(EMPTIED),
            due: ArrayQueue::new(MAX_SLOW_STEPS),
            announcer: Announcer::default(),
            kept: Mutex::new(kept),
            grown: Notify::new(),
            scan_is_due: Notify::new(),
        });
        (Arc::clone(&log), SensorWriter::new(log))
    }

    /// Locks the kept readings, after adding all queued ones.
    fn collected(&self) -> MutexGuard<'_, Kept> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.follow(&self.state_cell);
        while let Some(Batch { of, mut readings }) = self.arrived.pop() {
            self.waiting.fetch_sub(readings.len(), Ordering::Relaxed);
            // Its sensors were published before the reading arrived.
            kept.follow(&self.state_cell);
            readings.drain(..).for_each(|(count, reading)| kept.push(reading, count, of));
            drop(self.emptied.push(readings));
        }
        while let Some(mut due) = self.due.pop() {
            kept.follow(&self.state_cell);
            kept.cameras.take_from(&mut due);
            kept.scans.add(due);
        }
        kept
    }

    pub(super) fn announcer(&self) -> &Announcer {
        &self.announcer
    }

    /// Wakes readers and measuring threads while it is polled, by one task.
    pub(crate) async fn announce(&self) {
        let mut announced = 0;
        loop {
            self.announcer.next(&mut announced).await;
            if self.collected().scans.is_ready() {
                self.scan_is_due.notify_waiters();
            }
            self.grown.notify_waiters();
            // A world that runs as fast as possible would otherwise occupy this thread all the time.
            tokio::task::yield_now().await;
        }
    }

    /// Returns a future that is ready once there may be news. Callers create it before a look that finds
    /// none.
    pub(crate) fn grown(&self) -> Notified<'_> {
        self.grown.notified()
    }

    /// Returns the newest reading of each of these sensors.
    pub(crate) fn newest(&self, ids: impl IntoIterator<Item = u64>) -> Vec<ReadingBatch> {
        let kept = self.collected();
        ids.into_iter().map(|id| kept.rings.get(&id).map(Ring::newest).unwrap_or_default()).collect()
    }

    /// Returns the number of the newest reading of each of these sensors.
    pub(crate) fn last_sequences(&self, ids: impl IntoIterator<Item = u64>) -> Vec<u64> {
        let kept = self.collected();
        ids.into_iter().map(|id| kept.rings.get(&id).map_or(0, Ring::last)).collect()
    }

    /// Returns the readings of each of these sensors after a number. Each sensor gets an equal part of
    /// `bytes`, and at least one reading if it has one.
    pub(crate) fn after(&self, wanted: &[(u64, u64)], bytes: usize) -> Vec<ReadingBatch> {
        let kept = self.collected();
        let share = bytes / wanted.len().max(1);
        let of = |&(id, after): &(u64, u64)| match kept.rings.get(&id) {
            Some(ring) => ring.after(after, share),
            None => ReadingBatch { after, ..ReadingBatch::default() },
        };
        wanted.iter().map(of).collect()
    }

    /// Returns the samples of these sensors that wait or are being measured: sensor, and sequence of the
    /// state.
    pub(crate) fn scans_due(&self, ids: impl IntoIterator<Item = u64>) -> Vec<(u64, u64)> {
        let kept = self.collected();
        ids.into_iter().filter_map(|id| Some((id, kept.scans.due_by(id)?))).collect()
    }

    /// Returns whether each of these samples, or a newer one of its sensor, was measured or given up.
    pub(crate) fn are_measured(&self, scans: &[(u64, u64)]) -> bool {
        let kept = self.collected();
        scans.iter().all(|&(id, sequence)| {
            let newest = kept.rings.get(&id).and_then(Ring::newest_state);
            newest.is_some_and(|newest| newest >= sequence) || kept.scans.due_by(id).is_none()
        })
    }

    /// Returns the newest sample of each wanted camera since the last call, by its id.
    pub(crate) fn camera_samples(&self) -> Vec<(u64, CameraSample)> {
        self.collected().cameras.take()
    }

    /// Keeps samples of the cameras with these ids from now on, and no others.
    pub(crate) fn want_cameras(&self, ids: impl Iterator<Item = u64>) {
        self.collected().cameras.want(ids);
    }

    /// Drops readings of deleted sensors.
    pub(crate) fn tidy(&self) {
        drop(self.collected());
    }

    /// Waits for the next sample to measure.
    pub(crate) async fn next_scan(self: &Arc<Self>) -> Scan {
        loop {
            let is_due = self.scan_is_due.notified();
            let begun = self.collected().scans.begin();
            if let Some((state, sample)) = begun {
                return Scan { log: Arc::clone(self), state, sample, reading: None };
            }
            is_due.await;
        }
    }
}

impl Kept {
    /// Keeps one ring for each present sensor, and no others.
    fn follow(&mut self, state_cell: &PublishedStateCell) {
        let newest = state_cell.newest();
        let sensors = &newest.state.sensors;
        if Arc::ptr_eq(&self.sensors, sensors) {
            return;
        }
        self.sensors = Arc::clone(sensors);
        let ids: BTreeSet<u64> = sensors.iter().map(|sensor| sensor.id).collect();
        self.rings.retain(|id, _| ids.contains(id));
        self.scans.retain(|id| ids.contains(&id));
        self.cameras.follow(sensors);
        self.share = (MAX_BYTES / ids.len().max(1)).min(MAX_BYTES_PER_SENSOR);
        for ring in self.rings.values_mut() {
            ring.trim(self.share);
        }
        for id in ids {
            self.rings.entry(id).or_insert_with(|| Ring::new(self.last_sequence));
        }
    }

    /// Adds a reading; readings of deleted sensors are dropped.
    fn push(&mut self, reading: SensorReading, count: u64, of: OfState) {
        let Some(ring) = self.rings.get_mut(&reading.id) else { return };
        ring.push(LoggedReading::new(reading, of), count, self.share);
        self.last_sequence = self.last_sequence.max(ring.last());
    }
}

impl Scan {
    /// Measures, and gives up when cancelled. Dropping this hands the result over, which locks the log: a
    /// thread of low priority must not hold that lock while it measures.
    pub(crate) fn measure(&mut self, is_cancelled: &dyn Fn() -> bool) {
        self.reading = self.state.state.reading(&self.sample.sample, is_cancelled);
    }
}

impl Drop for Scan {
    fn drop(&mut self) {
        let of = OfState { wall_time: self.state.wall_time, sequence: self.state.sequence };
        let mut kept = self.log.collected();
        kept.scans.end(self.sample.sample.id);
        // Empty if the measurement was cancelled or panicked.
        if let Some(reading) = self.reading.take() {
            kept.push(reading, self.sample.count, of);
        }
        let is_ready = kept.scans.is_ready();
        drop(kept);
        if is_ready {
            self.log.scan_is_due.notify_waiters();
        }
        self.log.grown.notify_waiters();
    }
}

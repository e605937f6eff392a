//! What sensors measured, for any number of readers: the last readings of each, numbered.
//!
//! The driver hands readings over through a queue without a lock, and waits for no reader: see `writer`. Readers hold the
//! lock of what is kept, and move to it what waits in the queue before they look: so each sees all that was handed
//! over before it asked. One task does the same for readers that wait, and wakes them.
//!
//! * `reading`: a reading as it is kept. `ring`: the last readings of one sensor.
//! * `scans`: samples whose measurement takes long. `cameras`: those of cameras. `writer`: the driver's end.

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

/// Bytes of what is kept of all sensors.
const MOST_BYTES: usize = 64 << 20;
/// Bytes of what is kept of one sensor.
const MOST_BYTES_OF_ONE: usize = 4 << 20;
/// Steps whose readings may wait in the queue.
const MOST_STEPS: usize = 4_096;
/// Readings that may wait in the queue.
const MOST_WAITING: usize = 65_536;
/// Lists of readings that are kept for their memory.
const EMPTIED: usize = 16;
/// Steps whose samples that take long may wait in the queue.
const MOST_DUE: usize = 16;

/// The readings of a step.
#[derive(Debug)]
struct Batch {
    of: OfState,
    /// Each with its count of those of its sensor.
    readings: Vec<(u64, SensorReading)>,
}

/// The last readings of each sensor.
#[derive(Debug)]
pub(crate) struct SensorLog {
    /// Says which sensors there are.
    state_cell: Arc<PublishedStateCell>,
    arrived: ArrayQueue<Batch>,
    /// Readings in `arrived`.
    waiting: AtomicUsize,
    /// Lists for the driver to fill.
    emptied: ArrayQueue<Vec<(u64, SensorReading)>>,
    due: ArrayQueue<DueSamples>,
    announcer: Announcer,
    /// Held for a look, never by the driver.
    kept: Mutex<Kept>,
    grown: Notify,
    scan_is_due: Notify,
}

#[derive(Debug)]
struct Kept {
    /// By sensor.
    rings: BTreeMap<u64, Ring>,
    /// The sensors that have one.
    sensors: Arc<Vec<WorldSensor>>,
    /// Bytes of each ring.
    share: usize,
    /// The largest number that a reading has had.
    last_sequence: u64,
    scans: Scans,
    cameras: CameraSamples,
}

/// A sample that its holder is to measure. Of this sensor no other is measured as long as this is kept.
#[derive(Debug)]
pub(crate) struct Scan {
    log: Arc<SensorLog>,
    state: Arc<Published>,
    sample: CountedSample,
    reading: Option<SensorReading>,
}

impl SensorLog {
    /// Keeps readings of the sensors that published states have; and the driver's end.
    pub(super) fn new(state_cell: Arc<PublishedStateCell>) -> (Arc<Self>, SensorWriter) {
        let kept = Kept {
            rings: BTreeMap::new(),
            sensors: Arc::default(),
            share: MOST_BYTES_OF_ONE,
            last_sequence: 0,
            scans: Scans::default(),
            cameras: CameraSamples::default(),
        };
        let log = Arc::new(Self {
            state_cell,
            arrived: ArrayQueue::new(MOST_STEPS),
            waiting: AtomicUsize::new(0),
            emptied: ArrayQueue::new(EMPTIED),
            due: ArrayQueue::new(MOST_DUE),
            announcer: Announcer::default(),
            kept: Mutex::new(kept),
            grown: Notify::new(),
            scan_is_due: Notify::new(),
        });
        (Arc::clone(&log), SensorWriter::new(log))
    }

    /// What is kept, with all that was handed over by now.
    fn collected(&self) -> MutexGuard<'_, Kept> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.follow(&self.state_cell);
        while let Some(Batch { of, mut readings }) = self.arrived.pop() {
            self.waiting.fetch_sub(readings.len(), Ordering::Relaxed);
            // Its sensors were published before it came.
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

    /// Wakes readers and those who measure, as long as it is polled. One task does so.
    pub(crate) async fn announce(&self) {
        let mut announced = 0;
        loop {
            self.announcer.next(&mut announced).await;
            if self.collected().scans.is_ready() {
                self.scan_is_due.notify_waiters();
            }
            self.grown.notify_waiters();
            // A world that runs as fast as it can would leave this thread to nothing else.
            tokio::task::yield_now().await;
        }
    }

    /// Ready once there may be news. It is asked for before the look that finds none.
    pub(crate) fn grown(&self) -> Notified<'_> {
        self.grown.notified()
    }

    /// The newest reading of each of these sensors.
    pub(crate) fn newest(&self, ids: impl IntoIterator<Item = u64>) -> Vec<ReadingBatch> {
        let kept = self.collected();
        ids.into_iter().map(|id| kept.rings.get(&id).map(Ring::newest).unwrap_or_default()).collect()
    }

    /// The number of the newest reading of each of these sensors.
    pub(crate) fn last_sequences(&self, ids: impl IntoIterator<Item = u64>) -> Vec<u64> {
        let kept = self.collected();
        ids.into_iter().map(|id| kept.rings.get(&id).map_or(0, Ring::last)).collect()
    }

    /// Of each of these sensors the readings after a number. Each has its part of so many bytes, and at least one reading
    /// where there is one.
    pub(crate) fn after(&self, wanted: &[(u64, u64)], bytes: usize) -> Vec<ReadingBatch> {
        let kept = self.collected();
        let share = bytes / wanted.len().max(1);
        let of = |&(id, after): &(u64, u64)| match kept.rings.get(&id) {
            Some(ring) => ring.after(after, share),
            None => ReadingBatch { after, ..ReadingBatch::default() },
        };
        wanted.iter().map(of).collect()
    }

    /// The samples of these sensors that wait or are being measured: the sensor, and the sequence of the state.
    pub(crate) fn scans_due(&self, ids: impl IntoIterator<Item = u64>) -> Vec<(u64, u64)> {
        let kept = self.collected();
        ids.into_iter().filter_map(|id| Some((id, kept.scans.due_by(id)?))).collect()
    }

    /// Whether each of these samples, or one of a newer state, was measured or given up.
    pub(crate) fn are_measured(&self, scans: &[(u64, u64)]) -> bool {
        let kept = self.collected();
        scans.iter().all(|&(id, sequence)| {
            let newest = kept.rings.get(&id).and_then(Ring::newest_state);
            newest.is_some_and(|newest| newest >= sequence) || kept.scans.due_by(id).is_none()
        })
    }

    /// The newest sample of each camera that is wanted, by its id, that came since the last time.
    pub(crate) fn camera_samples(&self) -> Vec<(u64, CameraSample)> {
        self.collected().cameras.take()
    }

    /// From now on the samples of these cameras are kept, by their ids, and no others.
    pub(crate) fn want_cameras(&self, ids: impl Iterator<Item = u64>) {
        self.collected().cameras.want(ids);
    }

    /// Drops what is kept of sensors that are gone.
    pub(crate) fn tidy(&self) {
        drop(self.collected());
    }

    /// The next sample to measure, once there is one.
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
    /// Has a ring for each sensor that there is now, and for no other.
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
        self.share = (MOST_BYTES / ids.len().max(1)).min(MOST_BYTES_OF_ONE);
        for ring in self.rings.values_mut() {
            ring.trim(self.share);
        }
        for id in ids {
            self.rings.entry(id).or_insert_with(|| Ring::new(self.last_sequence));
        }
    }

    /// A reading of a sensor that went meanwhile is dropped.
    fn push(&mut self, reading: SensorReading, count: u64, of: OfState) {
        let Some(ring) = self.rings.get_mut(&reading.id) else { return };
        ring.push(LoggedReading::new(reading, of), count, self.share);
        self.last_sequence = self.last_sequence.max(ring.last());
    }
}

impl Scan {
    /// Measures; gives up as soon as it is not wanted any more. What it comes to is handed over where this is dropped, which
    /// takes the lock of the log: a thread that gives way to others must not hold that.
    pub(crate) fn measure(&mut self, is_cancelled: &dyn Fn() -> bool) {
        self.reading = self.state.state.reading(&self.sample.sample, is_cancelled);
    }
}

impl Drop for Scan {
    fn drop(&mut self) {
        let of = OfState { wall_time: self.state.wall_time, sequence: self.state.sequence };
        let mut kept = self.log.collected();
        kept.scans.end(self.sample.sample.id);
        // None where it was cancelled, or where what measures failed.
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

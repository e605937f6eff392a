//! Cell with the newest published state, for any number of readers. The driver never waits for a reader, and
//! no reader waits for the driver.
//!
//! The driver wakes one task, [`PublishedStateCell::announce`], and the task wakes the readers: each wake
//! from outside of the runtime takes the runtime's lock. Without waiting readers it wakes none: a wake costs
//! as much as a step of an arm.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering, fence};
use std::time::{Duration, Instant, SystemTime};

use arc_swap::ArcSwap;
use simd_core::{PhysicsSettings, PublishedState};
use tokio::sync::Notify;

use super::announcer::Announcer;
use super::published::{Published, Statistics};
use crate::histogram::Histogram;

/// Maximum number of old states kept for reuse. If stalled readers hold more, the driver allocates.
const RETIRED: usize = 16;

/// Capacity of a list that is kept in any case, values.
const SMALL: usize = 1024;

/// The newest state, for readers.
#[derive(Debug)]
pub(crate) struct PublishedStateCell {
    newest: ArcSwap<Published>,
    announcer: Announcer,
    /// Wakes waiting readers.
    changed: Notify,
    /// Number of readers that wait or are about to.
    readers: AtomicUsize,
    /// Origin of step times.
    epoch: Instant,
    /// Start of the present step, nanoseconds after the epoch and at least 1; 0 between steps.
    step_began: AtomicU64,
    /// Start of the driver's present step or command, in the same form; 0 while it waits.
    work_began: AtomicU64,
    /// Durations of steps.
    pub(crate) step_durations: Histogram,
    /// Delays of steps after their due time, in a world with a pace.
    pub(crate) step_lateness: Histogram,
}

/// The only writer of a [`PublishedStateCell`].
#[derive(Debug)]
pub(crate) struct Publisher {
    state_cell: Arc<PublishedStateCell>,
    /// Old states for reuse, with and without readers.
    retired: Vec<Arc<Published>>,
    sequence: u64,
}

impl PublishedStateCell {
    /// Returns the newest state, at once.
    pub(crate) fn newest(&self) -> Arc<Published> {
        self.newest.load_full()
    }

    /// Returns the newest state once it is newer than `sequence`.
    pub(crate) async fn newer_than(&self, sequence: u64) -> Arc<Published> {
        let _reader = Reader::of(&self.readers);
        loop {
            // Created before the look, so that a state published in between wakes it.
            let changed = self.changed.notified();
            let newest = self.newest();
            if newest.sequence > sequence {
                return newest;
            }
            changed.await;
        }
    }

    /// Returns the announcer of states that readers wait for.
    pub(super) fn announcer(&self) -> &Announcer {
        &self.announcer
    }

    /// Wakes readers that wait for a newer state while it is polled, by one task.
    pub(crate) async fn announce(&self) {
        let mut announced = 0;
        loop {
            self.announcer.next(&mut announced).await;
            self.changed.notify_waiters();
        }
    }
}

/// Counts a reader for as long as it lives.
struct Reader<'a>(&'a AtomicUsize);

impl<'a> Reader<'a> {
    fn of(readers: &'a AtomicUsize) -> Self {
        readers.fetch_add(1, Ordering::Relaxed);
        fence(Ordering::SeqCst);
        Self(readers)
    }
}

impl Drop for Reader<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl PublishedStateCell {
    /// Returns how long the present step has run at `now`; zero between steps.
    pub(crate) fn present_step(&self, now: Instant) -> Duration {
        self.since(&self.step_began, now)
    }

    /// Returns how long the driver's present step or command has run at `now`; zero while it waits.
    pub(crate) fn present_work(&self, now: Instant) -> Duration {
        self.since(&self.work_began, now)
    }

    fn since(&self, began: &AtomicU64, now: Instant) -> Duration {
        match began.load(Ordering::Relaxed) {
            0 => Duration::ZERO,
            began => now.saturating_duration_since(self.epoch).saturating_sub(Duration::from_nanos(began)),
        }
    }

    fn begins(&self, began: &AtomicU64, now: Instant) {
        let nanos = now.saturating_duration_since(self.epoch).as_nanos();
        began.store(u64::try_from(nanos).unwrap_or(u64::MAX).max(1), Ordering::Relaxed);
    }
}

impl Publisher {
    /// Notes that a step begins `now`.
    pub(crate) fn step_begins(&self, now: Instant) {
        self.state_cell.begins(&self.state_cell.step_began, now);
    }

    /// Notes that the step ended.
    pub(crate) fn step_ends(&self) {
        self.state_cell.step_began.store(0, Ordering::Relaxed);
    }

    /// Notes that the driver works from `now` on.
    pub(crate) fn work_begins(&self, now: Instant) {
        self.state_cell.begins(&self.state_cell.work_began, now);
    }

    /// Notes that the driver waits.
    pub(crate) fn work_ends(&self) {
        self.state_cell.work_began.store(0, Ordering::Relaxed);
    }

    /// Makes a cell with a first state, sequence 1, and its writer.
    pub(crate) fn new(state: PublishedState, physics: PhysicsSettings, statistics: Statistics) -> Self {
        let first = Published { sequence: 1, wall_time: SystemTime::now(), state, physics, statistics };
        let state_cell = PublishedStateCell {
            newest: ArcSwap::from_pointee(first),
            announcer: Announcer::default(),
            changed: Notify::new(),
            readers: AtomicUsize::new(0),
            epoch: Instant::now(),
            step_began: AtomicU64::new(0),
            work_began: AtomicU64::new(0),
            step_durations: Histogram::fine(),
            step_lateness: Histogram::fine(),
        };
        Self { state_cell: Arc::new(state_cell), retired: Vec::with_capacity(RETIRED), sequence: 1 }
    }

    /// For readers.
    pub(crate) fn state_cell(&self) -> &Arc<PublishedStateCell> {
        &self.state_cell
    }

    /// Returns the sequence of the newest state.
    pub(crate) fn sequence(&self) -> u64 {
        self.sequence
    }

    /// Publishes the state that `fill` writes over an old one; sequence and time are set here.
    pub(crate) fn publish(&mut self, fill: impl FnOnce(&mut Published)) -> SystemTime {
        let mut next = self.unread();
        self.sequence += 1;
        let wall_time = SystemTime::now();
        // The state has no reader, so this does not copy.
        let state = Arc::make_mut(&mut next);
        state.sequence = self.sequence;
        state.wall_time = wall_time;
        fill(state);
        let old = self.state_cell.newest.swap(next);
        if self.retired.len() == RETIRED {
            self.retired.remove(0);
        }
        self.retired.push(old);
        // Other states would keep deleted robots or saved states in memory. Those without a reader are
        // updated and kept for the next states, since this thread would have to allocate others.
        let newest = self.state_cell.newest.load();
        self.retired.retain_mut(|old| {
            shares_what_is_large(&old.state, &newest.state)
                || Arc::get_mut(old).is_some_and(|old| {
                    old.state.share_with(&newest.state);
                    is_of_use(&old.state, &newest.state)
                })
        });
        // A reader is counted before it looks, and this looks after the state is stored: one of the two sees
        // the other.
        fence(Ordering::SeqCst);
        if self.state_cell.readers.load(Ordering::Relaxed) > 0 {
            self.state_cell.announcer.hand_over();
        }
        wall_time
    }

    /// Returns a state without another holder: an old one, or a copy of the newest.
    fn unread(&mut self) -> Arc<Published> {
        match self.retired.iter_mut().position(|old| Arc::get_mut(old).is_some()) {
            Some(index) => self.retired.swap_remove(index),
            None => Arc::new(Published::clone(&self.state_cell.newest.load())),
        }
    }
}

/// Returns whether an old state uses not much more memory than the newest one needs. So the memory of a
/// thousand deleted robots is freed.
fn is_of_use(old: &PublishedState, newest: &PublishedState) -> bool {
    let fits = |capacity: usize, len: usize| capacity <= SMALL.max(4 * len);
    fits(old.velocities.capacity(), newest.velocities.len())
        && fits(old.roots.capacity(), newest.roots.len())
        && fits(old.contacts.capacity(), newest.contacts.len())
}

/// Returns whether two states share all their large shared parts.
fn shares_what_is_large(one: &PublishedState, other: &PublishedState) -> bool {
    Arc::ptr_eq(&one.world, &other.world)
        && Arc::ptr_eq(&one.settings, &other.settings)
        && Arc::ptr_eq(&one.saved, &other.saved)
        && Arc::ptr_eq(&one.sensors, &other.sensors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::published::Pace;
    use crate::run_state::RunState;

    fn publisher() -> Publisher {
        let statistics = Statistics::at_start(RunState::Paused, Pace::default());
        Publisher::new(PublishedState::default(), PhysicsSettings::default(), statistics)
    }

    #[test]
    fn a_steady_publisher_reuses_two_states() {
        let mut publisher = publisher();
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..1000 {
            publisher.publish(|state| state.state.positions.resize(100, 0.0));
            let newest = publisher.state_cell().newest();
            seen.insert((Arc::as_ptr(&newest) as usize, newest.state.positions.as_ptr() as usize));
        }
        assert_eq!(seen.len(), 2);
        assert_eq!(publisher.state_cell().newest().sequence, 1001);
    }

    #[test]
    fn a_state_that_is_read_never_changes() {
        let mut publisher = publisher();
        let held: Vec<_> = (0..100_u64)
            .map(|n| {
                publisher.publish(|state| state.state.at.step = n);
                publisher.state_cell().newest()
            })
            .collect();
        for (n, state) in held.iter().enumerate() {
            assert_eq!((state.state.at.step, state.sequence), (n as u64, n as u64 + 2));
        }
        assert!(publisher.retired.len() <= RETIRED);
    }

    #[test]
    fn old_states_keep_nothing_that_is_gone() {
        let mut publisher = publisher();
        let held: Vec<_> = (0..4)
            .map(|_| {
                publisher.publish(|_| ());
                publisher.state_cell().newest()
            })
            .collect();
        let gone = Arc::downgrade(&held[0].state.world);
        drop(held);
        publisher.publish(|state| state.state.world = Arc::default());
        assert!(gone.upgrade().is_none());
    }

    /// A newly allocated state is a copy, whose capacity is exactly its length.
    #[test]
    fn spawns_and_targets_reuse_allocated_memory() {
        const VALUES: usize = 100;
        let mut publisher = publisher();
        let mut held = Vec::new();
        let mut publish = |step: usize| {
            publisher.publish(|state| {
                state.state.positions.resize(VALUES, 0.0);
                if step < 20 {
                    state.state.positions.reserve(VALUES);
                }
                state.state.target_sources = Arc::default();
                if step.is_multiple_of(2) {
                    state.state.world = Arc::default();
                }
            });
            publisher.state_cell().newest()
        };
        for step in 0..200 {
            let newest = publish(step);
            assert!(newest.state.positions.capacity() >= 2 * VALUES, "step {step}");
            // A reader that is one state behind while only targets change.
            held.push(newest);
            if step % 2 == 1 {
                held.clear();
            }
        }
    }

    #[test]
    fn memory_of_robots_that_are_gone_is_given_back() {
        let mut publisher = publisher();
        let mut resize = |robots: usize| {
            publisher.publish(|state| {
                let values = &mut state.state.velocities;
                values.clear();
                values.resize(robots, 0.0);
                state.state.world = Arc::default();
            });
            publisher.retired.iter().map(|old| old.state.velocities.capacity()).max().unwrap_or_default()
        };
        for _ in 0..20 {
            resize(100_000);
        }
        assert!((0..20).map(|_| resize(10)).last().unwrap() <= SMALL);
    }

    #[tokio::test]
    async fn a_reader_that_waits_gets_the_newest_and_skips_what_was_between() {
        let mut publisher = publisher();
        let state_cell = publisher.state_cell().clone();
        let write = async {
            for _ in 0..3 {
                publisher.publish(|_| ());
            }
        };
        let read = async {
            tokio::select! {
                read = state_cell.newer_than(1) => read,
                () = state_cell.announce() => unreachable!("it goes on"),
            }
        };
        let (read, ()) = tokio::join!(read, write);
        assert_eq!(read.sequence, 4);
        assert_eq!(state_cell.newer_than(3).await.sequence, 4, "it does not wait for what is there");
    }
}

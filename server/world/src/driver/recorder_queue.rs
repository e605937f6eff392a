//! The queue to a recorder. It carries the whole world at first and on request, every applied command, and
//! every step.
//!
//! The physics thread never waits for it: the queue is bounded in bytes, and an entry that does not fit ends
//! it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::simulation::Saved;
use simd_core::simulation::command::{ClaimId, ClaimRequest, TrajectoryPoint};
use simd_core::{Command, Moment};
use simd_model::LoadReport;

use super::event_log::LoggedEvent;
use super::published::Published;

/// Name of a command's sender, as the client calls itself; `None` if it gives none.
pub(crate) type Sender = Option<Arc<str>>;

/// An entry for a recorder, in chronological order.
#[derive(Debug)]
pub(crate) enum Entry {
    /// Whole world, between two steps.
    World(Box<WorldEntry>),
    /// Applied command.
    Applied(Box<AppliedCommand>),
    /// State after a step.
    Step(Arc<Published>),
    /// Event.
    Event(Arc<LoggedEvent>),
    /// Report about a spawned robot.
    Report(Box<ReportEntry>),
}

/// The whole world.
#[derive(Debug)]
pub(crate) struct WorldEntry {
    /// Moment of the state.
    pub(crate) at: Moment,
    /// Saved state.
    pub(crate) state: Saved,
    /// Active claims.
    pub(crate) claims: Vec<ClaimRequest>,
    /// Published state, with the saved states of the world.
    pub(crate) published: Arc<Published>,
}

/// A command that was applied.
#[derive(Debug)]
pub(crate) struct AppliedCommand {
    /// Moment from which it holds.
    pub(crate) at: Moment,
    /// Command.
    pub(crate) command: Command,
    /// Claim of the sender.
    pub(crate) claim: Option<ClaimId>,
    /// Sender.
    pub(crate) sender: Sender,
}

/// Report of a robot's loading.
#[derive(Debug)]
pub(crate) struct ReportEntry {
    /// Name of the robot.
    pub(crate) robot: String,
    /// Report.
    pub(crate) report: LoadReport,
    /// Summary in one line.
    pub(crate) summary: String,
}

/// Cause of the queue's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RecorderQueueEnd {
    /// The recorder stopped, or reads no more.
    Stopped,
    /// An entry did not fit.
    Full,
    /// The physics thread ended.
    DriverEnded,
}

/// Queue from the driver to a recorder.
#[derive(Debug)]
pub(crate) struct RecorderQueue {
    /// Name of the recording.
    pub(crate) name: Arc<str>,
    /// Capacity, bytes.
    capacity: usize,
    /// Locked for a push or a swap.
    waiting: Mutex<Waiting>,
    arrived: Condvar,
    wants_world: AtomicBool,
}

#[derive(Debug, Default)]
struct Waiting {
    entries: Vec<Entry>,
    bytes: usize,
    end: Option<RecorderQueueEnd>,
}

impl RecorderQueue {
    /// Makes an empty queue for at most `capacity` bytes.
    pub(crate) fn new(name: Arc<str>, capacity: usize) -> Self {
        let (waiting, arrived, wants_world) = Default::default();
        Self { name, capacity, waiting, arrived, wants_world }
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an entry.
    ///
    /// # Errors
    /// Returns an error if the queue is full, or its reader has ended.
    pub(crate) fn push(&self, entry: Entry) -> Result<(), RecorderQueueEnd> {
        let bytes = entry.bytes();
        let mut waiting = self.lock();
        if let Some(end) = waiting.end {
            return Err(end);
        }
        if waiting.bytes.saturating_add(bytes) > self.capacity && !waiting.entries.is_empty() {
            waiting.end = Some(RecorderQueueEnd::Full);
            drop(waiting);
            self.arrived.notify_one();
            return Err(RecorderQueueEnd::Full);
        }
        waiting.bytes += bytes;
        waiting.entries.push(entry);
        Ok(())
    }

    /// Ends the queue. Queued entries are still read.
    pub(crate) fn end(&self, why: RecorderQueueEnd) {
        self.lock().end.get_or_insert(why);
        self.arrived.notify_one();
    }

    /// Requests the whole world, which follows the next step or command.
    pub(crate) fn ask_for_world(&self) {
        self.wants_world.store(true, Ordering::Relaxed);
    }

    /// Returns whether the whole world was requested since the last call.
    pub(crate) fn takes_world(&self) -> bool {
        self.wants_world.load(Ordering::Relaxed) && self.wants_world.swap(false, Ordering::Relaxed)
    }

    /// Moves all queued entries to an empty list, after `wait` or at the queue's end; also returns the cause
    /// of the end, if any. New entries do not end the wait: a reader that each step wakes costs more than one
    /// that polls.
    pub(crate) fn take_after(&self, wait: Duration, into: &mut Vec<Entry>) -> Option<RecorderQueueEnd> {
        let waiting = self.lock();
        let waited = self.arrived.wait_timeout_while(waiting, wait, |waiting| waiting.end.is_none());
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::swap(&mut waiting.entries, into);
        waiting.bytes = 0;
        waiting.end
    }
}

impl Entry {
    /// Returns its approximate memory, bytes.
    fn bytes(&self) -> usize {
        /// Bytes of a number, or of an element in a list of small ones.
        const NUMBER: usize = 8;
        /// Bytes of an object with names and lists.
        const THING: usize = 256;
        match self {
            // Models of its robots are shared with the world.
            Self::World(world) => THING + world.state.world_state().robots.len() * 64 * THING,
            Self::Applied(applied) => match &applied.command {
                Command::SetTargets(targets) => {
                    let joints: usize = targets.robots.iter().map(|robot| robot.joints.len()).sum();
                    THING * (1 + targets.robots.len() + joints)
                }
                Command::ResetJoints { robots } => {
                    let joints: usize = robots.iter().map(|robot| robot.joints.len()).sum();
                    THING * (1 + robots.len() + joints)
                }
                Command::FollowTrajectory(follow) => {
                    let numbers = |point: &TrajectoryPoint| {
                        let TrajectoryPoint { positions, velocities, accelerations, efforts, time: _ } =
                            point;
                        positions.len() + velocities.len() + accelerations.len() + efforts.len()
                    };
                    let numbers: usize = follow.points.iter().map(numbers).sum();
                    THING * (1 + follow.joints.len() + follow.points.len()) + NUMBER * numbers
                }
                Command::SetJointProperties { joints, .. } => THING * (1 + joints.len()),
                Command::SetLinkProperties { links, .. } => THING * (1 + links.len()),
                Command::SetCollisionFilter(change) => THING * (1 + change.pairs.len()),
                Command::Claim(request) => THING * (1 + request.joints.len()),
                // Models and states are shared with the world.
                _ => 16 * THING,
            },
            Self::Step(state) => {
                let state = &state.state;
                let numbers =
                    20 * state.roots.len() + 10 * state.velocities.len() + 16 * state.contacts.len();
                THING + NUMBER * numbers
            }
            Self::Event(_) => THING,
            Self::Report(report) => THING * (1 + report.report.findings.len()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied() -> Entry {
        let command = Command::SaveState { name: "a".into() };
        Entry::Applied(Box::new(AppliedCommand { at: Moment::default(), command, claim: None, sender: None }))
    }

    fn queue(capacity: usize) -> RecorderQueue {
        RecorderQueue::new("it".into(), capacity)
    }

    #[test]
    fn an_entry_that_does_not_fit_ends_the_queue_and_earlier_ones_are_still_read() {
        let queue = queue(2 * applied().bytes());
        assert_eq!(queue.push(applied()), Ok(()));
        assert_eq!(queue.push(applied()), Ok(()));
        assert_eq!(queue.push(applied()), Err(RecorderQueueEnd::Full));
        assert_eq!(queue.push(applied()), Err(RecorderQueueEnd::Full));
        let mut entries = Vec::new();
        assert_eq!(queue.take_after(Duration::from_secs(600), &mut entries), Some(RecorderQueueEnd::Full));
        assert_eq!(entries.len(), 2);
        assert_eq!(
            queue.push(applied()),
            Err(RecorderQueueEnd::Full),
            "room that comes later does not restart it"
        );
    }

    #[test]
    fn read_entries_make_room() {
        let queue = queue(2 * applied().bytes());
        for _ in 0..100 {
            assert_eq!(queue.push(applied()), Ok(()));
            let mut entries = Vec::new();
            assert_eq!(queue.take_after(Duration::ZERO, &mut entries), None);
            assert_eq!(entries.len(), 1);
        }
    }

    #[test]
    fn the_world_is_asked_for_once() {
        let queue = queue(1);
        assert!(!queue.takes_world());
        queue.ask_for_world();
        assert!(queue.takes_world());
        assert!(!queue.takes_world());
    }
}

//! What a recorder gets: the whole world at first and whenever it asks, every command that was applied, every step.
//!
//! The physics thread never waits for it: entries wait in a queue that is bounded in bytes, and one that does not fit
//! ends it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::simulation::Saved;
use simd_core::simulation::command::{ClaimId, ClaimRequest, TrajectoryPoint};
use simd_core::{Command, Moment};
use simd_model::LoadReport;

use super::event_log::LoggedEvent;
use super::published::Published;

/// Who sends a command, as the client calls itself; `None` where it does not say.
pub(crate) type Sender = Option<Arc<str>>;

/// An entry for a recorder, in the order in which it happened.
#[derive(Debug)]
pub(crate) enum Entry {
    /// The whole world, between two steps.
    World(Box<WorldEntry>),
    /// A command was applied.
    Applied(Box<AppliedCommand>),
    /// A step was done, and this is what the world looks like.
    Step(Arc<Published>),
    /// Something happened.
    Event(Arc<LoggedEvent>),
    /// A robot came.
    Report(Box<ReportEntry>),
}

/// The whole world.
#[derive(Debug)]
pub(crate) struct WorldEntry {
    /// When.
    pub(crate) at: Moment,
    /// Its state.
    pub(crate) state: Saved,
    /// The claims that hold.
    pub(crate) claims: Vec<ClaimRequest>,
    /// What is published, with the states that the world can go back to.
    pub(crate) published: Arc<Published>,
}

/// A command that was applied.
#[derive(Debug)]
pub(crate) struct AppliedCommand {
    /// From when it holds.
    pub(crate) at: Moment,
    /// What was done.
    pub(crate) command: Command,
    /// That it came with.
    pub(crate) claim: Option<ClaimId>,
    /// Who sent it.
    pub(crate) sender: Sender,
}

/// What was found while a robot was read.
#[derive(Debug)]
pub(crate) struct ReportEntry {
    /// Its name.
    pub(crate) robot: String,
    /// What was found.
    pub(crate) report: LoadReport,
    /// The same in one line.
    pub(crate) summary: String,
}

/// Why no more comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RecorderQueueEnd {
    /// The recorder asked for it, or reads no more.
    Stopped,
    /// An entry did not fit.
    Full,
    /// The physics thread ended.
    DriverEnded,
}

/// The queue from the driver to a recorder.
#[derive(Debug)]
pub(crate) struct RecorderQueue {
    /// What the recording is called.
    pub(crate) name: Arc<str>,
    /// Bytes that may wait.
    capacity: usize,
    /// Held for a push or a swap.
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
    /// An empty queue in which so many bytes may wait.
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
    /// Returns an error if there is no room, or no more is read.
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

    /// No more comes. What waits is still read.
    pub(crate) fn end(&self, why: RecorderQueueEnd) {
        self.lock().end.get_or_insert(why);
        self.arrived.notify_one();
    }

    /// Asks for the whole world, which comes after the next step or command.
    pub(crate) fn ask_for_world(&self) {
        self.wants_world.store(true, Ordering::Relaxed);
    }

    /// Whether the whole world was asked for since the last call.
    pub(crate) fn takes_world(&self) -> bool {
        self.wants_world.load(Ordering::Relaxed) && self.wants_world.swap(false, Ordering::Relaxed)
    }

    /// Takes all that waits into an empty list, after so long a time or the end; says why no more comes, if so. What comes is
    /// not waited for: a reader that is woken by each step costs more than one that looks now and then.
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
    /// About how much memory it takes.
    fn bytes(&self) -> usize {
        /// Of one number, or one of a list of small things.
        const NUMBER: usize = 8;
        /// Of a thing with names and lists.
        const THING: usize = 256;
        match self {
            // What its robots are made of is shared with the world.
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
    fn what_does_not_fit_ends_the_queue_and_what_waited_is_still_read() {
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
            "room that comes later does not begin it anew"
        );
    }

    #[test]
    fn what_was_read_makes_room() {
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

//! Log of events, numbered without gaps. It keeps the last 1,024, or fewer if they are long.
//!
//! Events arrive through a queue without a lock, so their writers, above all the driver, wait for no reader.
//! Readers lock the kept events, and first move the queued events to them. One task does the same for waiting
//! readers, and wakes them.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use crossbeam_queue::ArrayQueue;
use simd_core::simulation::EventKind;
use simd_core::simulation::trajectory::TrajectoryEnd;
use simd_core::{Event, Moment, PhysicsSettings};
use tokio::sync::Notify;

use super::announcer::Announcer;
use super::published::Pace;
use crate::run_state::RunState;

/// Maximum bytes of names and sentences in all kept events, so that they fit in one message.
const MAX_BYTES: usize = 2 << 20;
/// Capacity of the queue, events: more than one command causes.
const MAX_WAITING: usize = 4_096;

/// An event with its number.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedEvent {
    /// Number, from 1 without gaps.
    pub sequence: u64,
    /// Wall time at which it was logged.
    pub wall_time: SystemTime,
    /// Sequence of the newest state published by then.
    pub state_sequence: u64,
    /// Event.
    pub what: LogEvent,
}

/// Kinds of events.
#[derive(Clone, Debug, PartialEq)]
pub enum LogEvent {
    /// Event in the world. Never `EventKind::PhysicsChanged`; see [`LogEvent::PhysicsChanged`].
    World(Event),
    /// Settings or pace changed, by the world or by the driver.
    PhysicsChanged {
        /// Moment of the change.
        at: Moment,
        /// Settings in force from then on.
        settings: PhysicsSettings,
        /// Pace in force from then on.
        pace: Pace,
    },
    /// The run state changed.
    StateChanged {
        /// Moment of the change.
        at: Moment,
        /// State from then on.
        state: RunState,
    },
    /// The members of the lockstep changed.
    LockstepChanged {
        /// Moment of the change.
        at: Moment,
        /// Name of the member as it calls itself; empty if it gives none.
        client: Arc<str>,
        /// Cause of the change.
        change: LockstepChange,
        /// Number of members from then on.
        members: usize,
    },
    /// The world could not keep up.
    Overrun {
        /// Moment of the report.
        at: Moment,
        /// Dropped lag since the previous event of this kind, wall seconds.
        dropped_lag: f64,
    },
    /// A contact keeps a driven joint from its target.
    JointBlocked {
        /// Moment of the report.
        at: Moment,
        /// The joint, and the link that blocks it.
        blocked: Box<BlockedJoint>,
    },
    /// A recording began.
    RecordingStarted {
        /// Moment of its start.
        at: Moment,
        /// Name of the recording.
        recording: String,
    },
    /// A recording ended.
    RecordingEnded {
        /// Moment of its end.
        at: Moment,
        /// Name of the recording.
        recording: String,
        /// Cause.
        cause: RecordingEnd,
        /// Cause as a sentence.
        message: String,
    },
    /// A client called a method that changes something.
    Called {
        /// Moment of the call.
        at: Moment,
        /// The call, its caller and its outcome.
        call: Box<AuditedCall>,
    },
}

/// A joint that a contact keeps from its target.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockedJoint {
    /// Robot of the joint.
    pub robot: String,
    /// Name of the joint.
    pub joint: String,
    /// Robot that blocks it, which may be the same one.
    pub by_robot: String,
    /// Link that blocks it; empty if that robot has only one.
    pub by_link: String,
}

/// A call with its caller and outcome.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AuditedCall {
    /// Name of the caller's token.
    pub token: String,
    /// Name of the client as it calls itself; empty if it gives none.
    pub client: String,
    /// Address of the client.
    pub peer: String,
    /// Name of the transport.
    pub transport: &'static str,
    /// `SERVICE/METHOD`.
    pub method: String,
    /// Robots that the call concerns.
    pub robots: Vec<String>,
    /// Status code of gRPC; 0 is OK.
    pub code: i32,
    /// Reason as the schema names it, without its prefix; empty for none.
    pub reason: &'static str,
}

/// Cause of a recording's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingEnd {
    /// A client stopped it.
    Stopped,
    /// The recording, or all recordings together, reached a limit.
    LimitReached,
    /// It could not be written, for instance because the disk is full.
    WriteFailed,
    /// The disk was slower than the world.
    TooSlow,
    /// The daemon ends.
    DaemonEnded,
}

/// Cause of a change of the lockstep's members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LockstepChange {
    /// The client joined.
    Joined,
    /// The client left.
    Left,
    /// The client did not ask for its next step in time.
    TimedOut,
    /// The client's connection ended.
    Disconnected,
}

/// Events after a number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EventBatch {
    /// Events, in order.
    pub events: Vec<LoggedEvent>,
    /// Number of events after the requested number that are no longer kept.
    pub missed: u64,
    /// Number of the newest event.
    pub last_sequence: u64,
}

/// Log of the last events, for any number of readers.
#[derive(Debug)]
pub(crate) struct EventLog {
    /// Maximum number of kept events.
    limit: usize,
    /// Last assigned number.
    numbered: AtomicU64,
    arrived: ArrayQueue<Arc<LoggedEvent>>,
    announcer: Announcer,
    /// Locked for a look, but never while an event is logged or copied.
    kept: Mutex<Kept>,
    grown: Notify,
}

#[derive(Debug, Default)]
struct Kept {
    events: VecDeque<Arc<LoggedEvent>>,
    /// Events that arrived before the event with the preceding number, which is still on its way.
    early: BTreeMap<u64, Arc<LoggedEvent>>,
    /// Bytes of all kept events.
    bytes: usize,
    last_sequence: u64,
}

impl EventLog {
    /// Makes a log that keeps the last `limit` events.
    pub(crate) fn new(limit: usize) -> Self {
        Self {
            limit,
            numbered: AtomicU64::new(0),
            arrived: ArrayQueue::new(MAX_WAITING),
            announcer: Announcer::default(),
            kept: Mutex::default(),
            grown: Notify::new(),
        }
    }

    pub(super) fn announcer(&self) -> &Announcer {
        &self.announcer
    }

    /// Appends an event, and returns it with its number.
    pub(crate) fn push(
        &self,
        wall_time: SystemTime,
        state_sequence: u64,
        what: LogEvent,
    ) -> Arc<LoggedEvent> {
        let sequence = self.numbered.fetch_add(1, Ordering::Relaxed) + 1;
        let event = Arc::new(LoggedEvent { sequence, wall_time, state_sequence, what });
        let mut waiting = Arc::clone(&event);
        // The queue is full only if the announcer has not run for thousands of events.
        while let Err(full) = self.arrived.push(waiting) {
            waiting = full;
            drop(self.collected());
        }
        self.announcer.hand_over();
        event
    }

    /// Locks the kept events, after adding all queued ones.
    fn collected(&self) -> MutexGuard<'_, Kept> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(event) = self.arrived.pop() {
            kept.early.insert(event.sequence, event);
            kept.append(self.limit);
        }
        kept
    }

    /// Wakes readers while it is polled, by one task.
    pub(crate) async fn announce(&self) {
        let mut announced = 0;
        loop {
            self.announcer.next(&mut announced).await;
            drop(self.collected());
            self.grown.notify_waiters();
            // A world with an event at each step would otherwise occupy this thread all the time.
            tokio::task::yield_now().await;
        }
    }

    /// Returns the events after a number, at once.
    pub(crate) fn after(&self, sequence: u64) -> EventBatch {
        let kept = self.collected();
        // A number from before a restart of the daemon may be larger.
        let wanted = kept.last_sequence.saturating_sub(sequence);
        let there = wanted.min(kept.events.len() as u64);
        let skipped = kept.events.len() - there as usize;
        let events: Vec<Arc<LoggedEvent>> = kept.events.iter().skip(skipped).cloned().collect();
        let (missed, last_sequence) = (wanted - there, kept.last_sequence);
        drop(kept);
        EventBatch { events: events.into_iter().map(Arc::unwrap_or_clone).collect(), missed, last_sequence }
    }

    /// Returns the events after a number, waiting for the first one.
    pub(crate) async fn next(&self, after: u64, timeout: Duration) -> EventBatch {
        let wait = async {
            loop {
                let grown = self.grown.notified();
                let batch = self.after(after);
                if !batch.events.is_empty() || batch.missed > 0 {
                    return batch;
                }
                grown.await;
            }
        };
        match tokio::time::timeout(timeout, wait).await {
            Ok(batch) => batch,
            Err(_elapsed) => self.after(after),
        }
    }
}

impl Kept {
    /// Appends the next events in order, and drops the oldest beyond the limits.
    fn append(&mut self, limit: usize) {
        while let Some(event) = self.early.remove(&(self.last_sequence + 1)) {
            self.last_sequence = event.sequence;
            self.bytes += bytes_of(&event.what);
            self.events.push_back(event);
            // The newest stays, whatever its length.
            while self.events.len() > limit || (self.bytes > MAX_BYTES && self.events.len() > 1) {
                self.bytes -= self.events.pop_front().map_or(0, |gone| bytes_of(&gone.what));
            }
        }
    }
}

/// Returns the bytes of names and sentences, whose length clients and descriptions determine.
fn bytes_of(what: &LogEvent) -> usize {
    let event = match what {
        LogEvent::World(event) => event,
        LogEvent::LockstepChanged { client, .. } => return client.len(),
        LogEvent::Called { call, .. } => {
            let AuditedCall { token, client, peer, transport: _, method, robots, code: _, reason: _ } =
                &**call;
            let robots: usize = robots.iter().map(|name| name.len() + size_of::<String>()).sum();
            return token.len() + client.len() + peer.len() + method.len() + robots;
        }
        LogEvent::JointBlocked { blocked, .. } => {
            let BlockedJoint { robot, joint, by_robot, by_link } = &**blocked;
            return robot.len() + joint.len() + by_robot.len() + by_link.len();
        }
        LogEvent::RecordingStarted { recording, .. } => return recording.len(),
        LogEvent::RecordingEnded { recording, message, .. } => return recording.len() + message.len(),
        LogEvent::PhysicsChanged { .. } | LogEvent::StateChanged { .. } | LogEvent::Overrun { .. } => {
            return 0;
        }
    };
    match &event.kind {
        EventKind::EntitySpawned { robot }
        | EventKind::EntityDeleted { robot }
        | EventKind::EntityReloaded { robot, .. } => robot.len(),
        EventKind::EntityDisabled { robot, reason } => robot.len() + reason.len(),
        EventKind::JointsClaimed { holder, claimed: of }
        | EventKind::JointsReleased { holder, released: of, cause: _ } => {
            let names = of.joints.iter().chain(&of.robots);
            holder.len() + names.map(|name| name.len() + size_of::<String>()).sum::<usize>()
        }
        EventKind::TrajectoryEnded { robot, id: _, end } => {
            let of_end = match end {
                TrajectoryEnd::PathToleranceViolated(violation)
                | TrajectoryEnd::GoalToleranceViolated(violation) => violation.joint.len(),
                TrajectoryEnd::Cancelled { by } => by.len(),
                TrajectoryEnd::Succeeded | TrajectoryEnd::Superseded => 0,
            };
            robot.len() + of_end
        }
        EventKind::StateRestored { name } => name.len(),
        EventKind::ConstraintCreated { constraint }
        | EventKind::ConstraintDeleted { constraint, cause: _ } => constraint.len(),
        EventKind::SensorCreated { robot, sensor } | EventKind::SensorDeleted { robot, sensor } => {
            robot.len() + sensor.len()
        }
        EventKind::Reset(_) | EventKind::PhysicsChanged(_) => 0,
    }
}

#[cfg(test)]
mod tests;

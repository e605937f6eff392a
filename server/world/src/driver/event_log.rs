//! What happened, numbered without holes; the last 1,024 are kept, or fewer where they are long.
//!
//! Events come through a queue without a lock: who logs one, the driver before all, waits for no reader. Readers hold the
//! lock of what is kept, and move to it what waits in the queue before they look. One task does the same for readers that
//! wait, and wakes them.

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

/// Bytes of names and sentences in all of them: so many fit in one message.
const MAX_BYTES: usize = 2 << 20;
/// Events that may wait in the queue: more than one command makes happen.
const MOST_WAITING: usize = 4_096;

/// Something that happened, with its number.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedEvent {
    /// From 1, without holes.
    pub sequence: u64,
    /// When it was logged.
    pub wall_time: SystemTime,
    /// Of the newest state that was published by then.
    pub state_sequence: u64,
    /// What it was.
    pub what: LogEvent,
}

/// What can happen.
#[derive(Clone, Debug, PartialEq)]
pub enum LogEvent {
    /// In the world. Never `EventKind::PhysicsChanged`; see [`LogEvent::PhysicsChanged`].
    World(Event),
    /// To how it is stepped, by the world or by the driver.
    PhysicsChanged {
        /// When.
        at: Moment,
        /// In force from then on.
        settings: PhysicsSettings,
        /// In force from then on.
        pace: Pace,
    },
    /// To whether it runs.
    StateChanged {
        /// When.
        at: Moment,
        /// From then on.
        state: RunState,
    },
    /// To who steps it together.
    LockstepChanged {
        /// When.
        at: Moment,
        /// As the member calls itself; empty where it does not.
        client: Arc<str>,
        /// Whether it came or went, and why.
        change: LockstepChange,
        /// From then on.
        members: usize,
    },
    /// It could not keep up.
    Overrun {
        /// When.
        at: Moment,
        /// Wall seconds, since the event of this kind before.
        dropped_lag: f64,
    },
    /// A contact keeps a driven joint from its target.
    JointBlocked {
        /// When.
        at: Moment,
        /// Which joint, and what blocks it.
        blocked: Box<BlockedJoint>,
    },
    /// A recording began.
    RecordingStarted {
        /// When.
        at: Moment,
        /// What it is called.
        recording: String,
    },
    /// A recording ended.
    RecordingEnded {
        /// When.
        at: Moment,
        /// What it is called.
        recording: String,
        /// Why.
        cause: RecordingEnd,
        /// The same, as a sentence.
        message: String,
    },
    /// A client called a method that does not only read.
    Called {
        /// When.
        at: Moment,
        /// Who called what, and what became of it.
        call: Box<AuditedCall>,
    },
}

/// A joint that a contact keeps from its target.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockedJoint {
    /// The joint's robot.
    pub robot: String,
    /// The joint.
    pub joint: String,
    /// The robot that blocks it, which may be the same one.
    pub by_robot: String,
    /// That robot's link; empty if it has one alone.
    pub by_link: String,
}

/// Who did what.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AuditedCall {
    /// Whose token it was.
    pub token: String,
    /// As the client calls itself; empty where it does not.
    pub client: String,
    /// The other end of its way.
    pub peer: String,
    /// By its name.
    pub transport: &'static str,
    /// `SERVICE/METHOD`.
    pub method: String,
    /// That it concerns.
    pub robots: Vec<String>,
    /// Of gRPC; 0 is OK.
    pub code: i32,
    /// As the schema names it without its prefix; empty for none.
    pub reason: &'static str,
}

/// Why a recording ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingEnd {
    /// A client stopped it.
    Stopped,
    /// It, or all of them together, reached a limit.
    LimitReached,
    /// It could not be written, for instance because the disk is full.
    WriteFailed,
    /// The disk was slower than the world.
    TooSlow,
    /// The daemon ends.
    DaemonEnded,
}

/// Why a client came to those that step the world together, or went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LockstepChange {
    /// It joined.
    Joined,
    /// It left.
    Left,
    /// It did not ask for its next step in its time.
    TimedOut,
    /// Its connection ended.
    Disconnected,
}

/// Events after a number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EventBatch {
    /// In order.
    pub events: Vec<LoggedEvent>,
    /// Events after that number that are gone.
    pub missed: u64,
    /// Of the newest event there is.
    pub last_sequence: u64,
}

/// The last events, for any number of readers.
#[derive(Debug)]
pub(crate) struct EventLog {
    /// How many are kept.
    limit: usize,
    /// The last number that was given.
    numbered: AtomicU64,
    arrived: ArrayQueue<Arc<LoggedEvent>>,
    announcer: Announcer,
    /// Held for a look, never while an event is logged or copied.
    kept: Mutex<Kept>,
    grown: Notify,
}

#[derive(Debug, Default)]
struct Kept {
    events: VecDeque<Arc<LoggedEvent>>,
    /// Those that came before the event that has the number before theirs, which is on its way.
    early: BTreeMap<u64, Arc<LoggedEvent>>,
    /// Of all events that are kept.
    bytes: usize,
    last_sequence: u64,
}

impl EventLog {
    /// Keeps the last so many.
    pub(crate) fn new(limit: usize) -> Self {
        Self {
            limit,
            numbered: AtomicU64::new(0),
            arrived: ArrayQueue::new(MOST_WAITING),
            announcer: Announcer::default(),
            kept: Mutex::default(),
            grown: Notify::new(),
        }
    }

    pub(super) fn announcer(&self) -> &Announcer {
        &self.announcer
    }

    /// Appends an event; gives it with its number.
    pub(crate) fn push(
        &self,
        wall_time: SystemTime,
        state_sequence: u64,
        what: LogEvent,
    ) -> Arc<LoggedEvent> {
        let sequence = self.numbered.fetch_add(1, Ordering::Relaxed) + 1;
        let event = Arc::new(LoggedEvent { sequence, wall_time, state_sequence, what });
        let mut waiting = Arc::clone(&event);
        // There is no room only where the announcer has had no turn for thousands of events.
        while let Err(full) = self.arrived.push(waiting) {
            waiting = full;
            drop(self.collected());
        }
        self.announcer.hand_over();
        event
    }

    /// What is kept, with all that was handed over by now.
    fn collected(&self) -> MutexGuard<'_, Kept> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(event) = self.arrived.pop() {
            kept.early.insert(event.sequence, event);
            kept.append(self.limit);
        }
        kept
    }

    /// Wakes readers, as long as it is polled. One task does so.
    pub(crate) async fn announce(&self) {
        let mut announced = 0;
        loop {
            self.announcer.next(&mut announced).await;
            drop(self.collected());
            self.grown.notify_waiters();
            // A world in which something happens at each step would leave this thread to nothing else.
            tokio::task::yield_now().await;
        }
    }

    /// Events after a number, at once.
    pub(crate) fn after(&self, sequence: u64) -> EventBatch {
        let kept = self.collected();
        // A number from before a restart of the daemon may lie ahead.
        let wanted = kept.last_sequence.saturating_sub(sequence);
        let there = wanted.min(kept.events.len() as u64);
        let skipped = kept.events.len() - there as usize;
        let events: Vec<Arc<LoggedEvent>> = kept.events.iter().skip(skipped).cloned().collect();
        let (missed, last_sequence) = (wanted - there, kept.last_sequence);
        drop(kept);
        EventBatch { events: events.into_iter().map(Arc::unwrap_or_clone).collect(), missed, last_sequence }
    }

    /// Events after a number, waiting for the first.
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
    /// Appends those that come next, and drops the oldest beyond the limits.
    fn append(&mut self, limit: usize) {
        while let Some(event) = self.early.remove(&(self.last_sequence + 1)) {
            self.last_sequence = event.sequence;
            self.bytes += bytes_of(&event.what);
            self.events.push_back(event);
            // The newest stays, however long it is.
            while self.events.len() > limit || (self.bytes > MAX_BYTES && self.events.len() > 1) {
                self.bytes -= self.events.pop_front().map_or(0, |gone| bytes_of(&gone.what));
            }
        }
    }
}

/// Of what is as long as clients and descriptions make it.
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

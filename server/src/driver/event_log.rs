//! What happened, numbered without holes; the last 1,024 are kept, or fewer where they are long.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use simd_core::simulation::EventKind;
use simd_core::simulation::trajectory::TrajectoryEnd;
use simd_core::{Event, Moment, PhysicsSettings};
use tokio::sync::Notify;

use super::published::Pace;
use crate::run_state::RunState;

/// Bytes of names and sentences in all of them: so many fit in one message.
const MAX_BYTES: usize = 2 << 20;

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
    pub what: Happened,
}

/// What can happen.
#[derive(Clone, Debug, PartialEq)]
pub enum Happened {
    /// In the world. Never `EventKind::PhysicsChanged`; see [`Happened::PhysicsChanged`].
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
    /// Held for a push or a copy, never across a step.
    kept: Mutex<Kept>,
    grown: Notify,
}

#[derive(Debug, Default)]
struct Kept {
    events: VecDeque<LoggedEvent>,
    /// Of all of them.
    bytes: usize,
    last_sequence: u64,
}

impl EventLog {
    /// Keeps the last so many.
    pub(crate) fn new(limit: usize) -> Self {
        Self { limit, kept: Mutex::default(), grown: Notify::new() }
    }

    /// Appends an event; gives its number.
    pub(crate) fn push(&self, wall_time: SystemTime, state_sequence: u64, what: Happened) -> u64 {
        let sequence = {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.last_sequence += 1;
            let sequence = kept.last_sequence;
            kept.bytes += bytes_of(&what);
            kept.events.push_back(LoggedEvent { sequence, wall_time, state_sequence, what });
            // The newest stays, however long it is.
            while kept.events.len() > self.limit || (kept.bytes > MAX_BYTES && kept.events.len() > 1) {
                kept.bytes -= kept.events.pop_front().map_or(0, |gone| bytes_of(&gone.what));
            }
            sequence
        };
        self.grown.notify_waiters();
        sequence
    }

    /// Events after a number, at once.
    pub(crate) fn after(&self, sequence: u64) -> EventBatch {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        // A number from before a restart of the daemon may lie ahead.
        let wanted = kept.last_sequence.saturating_sub(sequence);
        let there = wanted.min(kept.events.len() as u64);
        let skipped = kept.events.len() - there as usize;
        EventBatch {
            events: kept.events.iter().skip(skipped).cloned().collect(),
            missed: wanted - there,
            last_sequence: kept.last_sequence,
        }
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

/// Of what is as long as clients and descriptions make it.
fn bytes_of(what: &Happened) -> usize {
    let event = match what {
        Happened::World(event) => event,
        Happened::LockstepChanged { client, .. } => return client.len(),
        Happened::Called { call, .. } => {
            let AuditedCall { token, client, peer, transport: _, method, robots, code: _, reason: _ } =
                &**call;
            let robots: usize = robots.iter().map(|name| name.len() + size_of::<String>()).sum();
            return token.len() + client.len() + peer.len() + method.len() + robots;
        }
        Happened::RecordingStarted { recording, .. } => return recording.len(),
        Happened::RecordingEnded { recording, message, .. } => return recording.len() + message.len(),
        Happened::PhysicsChanged { .. } | Happened::StateChanged { .. } | Happened::Overrun { .. } => {
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
mod tests {
    use simd_core::simulation::event::Claimed;

    use super::*;

    const KEPT: usize = 1024;

    fn overrun(log: &EventLog) {
        log.push(SystemTime::UNIX_EPOCH, 0, Happened::Overrun { at: Moment::default(), dropped_lag: 1.0 });
    }

    #[test]
    fn events_are_numbered_from_one_and_read_after_a_number() {
        let log = EventLog::new(KEPT);
        assert_eq!(log.after(0), EventBatch::default());
        (0..3).for_each(|_| overrun(&log));
        let batch = log.after(1);
        assert_eq!(batch.events.iter().map(|e| e.sequence).collect::<Vec<_>>(), [2, 3]);
        assert_eq!((batch.missed, batch.last_sequence), (0, 3));
    }

    #[test]
    fn a_slow_reader_learns_how_many_it_missed() {
        let log = EventLog::new(KEPT);
        (0..KEPT + 10).for_each(|_| overrun(&log));
        let batch = log.after(4);
        assert_eq!(batch.events.len(), KEPT);
        assert_eq!(batch.events[0].sequence, 11);
        assert_eq!(batch.missed, 6);
    }

    #[test]
    fn long_events_are_kept_in_bytes_and_the_newest_always() {
        let log = EventLog::new(KEPT);
        let claimed = |joints: usize| {
            let claimed = Claimed { joints: vec!["j".repeat(1024); joints], ..Claimed::default() };
            let kind = EventKind::JointsClaimed { holder: "me".into(), claimed };
            let event = Event { at: Moment::default(), kind };
            log.push(SystemTime::UNIX_EPOCH, 0, Happened::World(event));
        };
        (0..100).for_each(|_| claimed(1000));
        let batch = log.after(0);
        assert_eq!((batch.events.len(), batch.missed), (2, 98));
        claimed(10_000);
        assert_eq!(log.after(0).events.len(), 1);
        (0..KEPT).for_each(|_| overrun(&log));
        assert_eq!(log.after(0).events.len(), KEPT);
        assert_eq!(log.kept.lock().unwrap().bytes, 0);
    }

    #[test]
    fn a_number_from_another_life_of_the_daemon_reads_nothing() {
        let log = EventLog::new(KEPT);
        overrun(&log);
        assert_eq!(log.after(99).events, []);
    }

    #[tokio::test]
    async fn a_waiting_reader_gets_the_next_event() {
        let log = EventLog::new(KEPT);
        let read = log.next(0, Duration::from_secs(60));
        let write = async { overrun(&log) };
        let (batch, ()) = tokio::join!(read, write);
        assert_eq!(batch.events.len(), 1);
    }
}

//! All events that can wake the driver.

use std::sync::Arc;

use simd_core::simulation::Saved;
use simd_core::simulation::command::{ClaimId, PhysicsChange, SetTargets};
use simd_core::{Command, Moment, PhysicsSettings};
use tokio::sync::oneshot;

use super::published::{Done, Pace, PaceChange, Published, Stepped};
use super::recorder_queue::{RecorderQueue, Sender};
use crate::call_error::CallError;
use crate::run_state::RunState;

/// Sender of an answer. Each call gets exactly one answer; a sender dropped without an answer means that the
/// driver has ended.
pub(crate) type ReplyTo<T> = oneshot::Sender<Result<T, CallError>>;

/// Event that wakes the driver.
#[derive(Debug)]
pub(crate) enum Event {
    /// A step is due. Never posted: the pace or a pending [`Event::Step`] causes it.
    StepDue,
    /// Changes the world.
    Command {
        /// Change.
        command: Command,
        /// Claim of the sender.
        claim: Option<ClaimId>,
        /// Sender.
        sender: Sender,
        /// Receiver of the result, once the change holds.
        reply: ReplyTo<Done>,
    },
    /// Plays, pauses or stops the world.
    SetState {
        /// New run state.
        state: RunState,
        /// Claim of the sender.
        claim: Option<ClaimId>,
        /// Sender.
        sender: Sender,
        /// Receiver of the result, once the state holds.
        reply: ReplyTo<Done>,
    },
    /// Sets targets and makes steps, as fast as possible, while not playing. If either is refused, neither is
    /// done.
    Step {
        /// Targets, applied when the event is handled.
        targets: Option<SetTargets>,
        /// Number of steps, at least 1.
        steps: u64,
        /// Claim of the sender.
        claim: Option<ClaimId>,
        /// Sender.
        sender: Sender,
        /// Receiver of the result after the last step; a caller that no longer wants it drops it.
        reply: ReplyTo<Stepped>,
    },
    /// Sets targets of a lockstep member; the steps follow once all members have asked. If those steps are
    /// not allowed, the targets are refused.
    TargetsOfMember {
        /// Targets, applied when the event is handled.
        targets: SetTargets,
        /// Claim of the sender.
        claim: Option<ClaimId>,
        /// Claim that the steps will use, if any. The outer `None` means that it is unknown, since a member
        /// that has yet to ask may bring one.
        steps_claim: Option<Option<ClaimId>>,
        /// Sender.
        sender: Sender,
        /// Receiver of the result, once the targets hold.
        reply: ReplyTo<Done>,
    },
    /// Changes physics settings and pace. If either is refused, neither is changed.
    SetPhysics {
        /// Change of the settings.
        change: PhysicsChange,
        /// Change of the pace; its factor is checked before.
        pace: PaceChange,
        /// Claim of the sender.
        claim: Option<ClaimId>,
        /// Sender.
        sender: Sender,
        /// Receiver of the result, with the settings and the pace in force from then on.
        reply: ReplyTo<(Done, PhysicsSettings, Pace)>,
    },
    /// Starts or ends a recording: the recorder gets all entries from now on.
    Record {
        /// Queue of the recorder, whose first entry is the whole world; `None` ends the present recording.
        queue: Option<Arc<RecorderQueue>>,
        /// Receiver of the moment from which this holds.
        reply: ReplyTo<Moment>,
    },
    /// Requests the whole state, of which the published one is a part: for copies of the world.
    WholeState {
        /// Receiver of the whole state, with the published state of the same moment.
        reply: ReplyTo<(Saved, Arc<Published>)>,
    },
    /// Ends the driver.
    Shutdown,
}

impl Event {
    /// Returns whether the event interrupts a long step. Such events make the step's result useless, or let a
    /// person stop a world that is too slow. All others wait for the step.
    pub(crate) fn interrupts(&self) -> bool {
        match self {
            Self::SetState { state: RunState::Paused | RunState::Stopped, .. } => true,
            Self::Command { command, .. } => matches!(
                command,
                Command::Delete { .. } | Command::Reset(_) | Command::RestoreState { .. }
            ),
            Self::SetState { state: RunState::Playing, .. }
            | Self::StepDue
            | Self::Step { .. }
            | Self::TargetsOfMember { .. }
            | Self::SetPhysics { .. }
            | Self::Record { .. }
            | Self::WholeState { .. }
            // A separate flag ends the step.
            | Self::Shutdown => false,
        }
    }
}

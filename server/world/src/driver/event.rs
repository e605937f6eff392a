//! Everything that can wake the driver.

use std::sync::Arc;

use simd_core::simulation::Saved;
use simd_core::simulation::command::{ClaimId, PhysicsChange, SetTargets};
use simd_core::{Command, Moment, PhysicsSettings};
use tokio::sync::oneshot;

use super::published::{Done, Pace, PaceChange, Published, Stepped};
use super::recorder_queue::{RecorderQueue, Sender};
use crate::call_error::CallError;
use crate::run_state::RunState;

/// Where an answer goes. Each call gets exactly one; one that is dropped
/// without an answer means that the driver has ended.
pub(crate) type ReplyTo<T> = oneshot::Sender<Result<T, CallError>>;

/// What wakes the driver.
#[derive(Debug)]
pub(crate) enum Event {
    /// It is time for a step. Not posted: the pace or a pending [`Event::Step`] makes it.
    StepDue,
    /// Change the world.
    Command {
        /// How.
        command: Command,
        /// That its sender holds.
        claim: Option<ClaimId>,
        /// Who sends it.
        sender: Sender,
        /// Once it holds.
        reply: ReplyTo<Done>,
    },
    /// Play, pause or stop.
    SetState {
        /// Which of them.
        state: RunState,
        /// That its sender holds.
        claim: Option<ClaimId>,
        /// Who sends it.
        sender: Sender,
        /// Once it holds.
        reply: ReplyTo<Done>,
    },
    /// Set targets and do steps, as fast as possible, while not playing: both or,
    /// where one is refused, nothing.
    Step {
        /// Applied when the event is handled.
        targets: Option<SetTargets>,
        /// At least 1.
        steps: u64,
        /// That its sender holds.
        claim: Option<ClaimId>,
        /// Who sends it.
        sender: Sender,
        /// After the last one; dropped by a caller who does not want them any more.
        reply: ReplyTo<Stepped>,
    },
    /// Set targets of a client that steps the world with others, for steps that come once all have asked: where those may
    /// not be done, nothing.
    TargetsOfMember {
        /// Applied when the event is handled.
        targets: SetTargets,
        /// That their sender holds.
        claim: Option<ClaimId>,
        /// What the steps come with, a claim or none; `None` while one has yet to ask, who may come with one.
        steps_claim: Option<Option<ClaimId>>,
        /// Who sends them.
        sender: Sender,
        /// Once they hold.
        reply: ReplyTo<Done>,
    },
    /// Change how steps are done and when: both or, where one is refused, nothing.
    SetPhysics {
        /// How.
        change: PhysicsChange,
        /// When; its factor is checked before it gets here.
        pace: PaceChange,
        /// That its sender holds.
        claim: Option<ClaimId>,
        /// Who sends it.
        sender: Sender,
        /// With what is in force from then on.
        reply: ReplyTo<(Done, PhysicsSettings, Pace)>,
    },
    /// Give a recorder everything from now on, or end what the present one gets.
    Record {
        /// Where to; the first entry is the whole world.
        queue: Option<Arc<RecorderQueue>>,
        /// Once it holds, with the moment.
        reply: ReplyTo<Moment>,
    },
    /// Tell the whole state, which the published one is a part of: for copies of the world that run on from it.
    WholeState {
        /// With the published state of the same moment.
        reply: ReplyTo<(Saved, Arc<Published>)>,
    },
    /// End.
    Shutdown,
}

impl Event {
    /// Whether a step that takes long is interrupted for it: it ends the step's use, or is how a person gets
    /// out of a world that is too slow. All else waits for the step.
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
            // A flag beside it ends the step.
            | Self::Shutdown => false,
        }
    }
}

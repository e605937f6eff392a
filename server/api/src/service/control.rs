//! `Control`: a stream in which each request is one credit, may carry targets, and gets exactly one state as
//! its answer.
//!
//! The answers are one future, which the transport polls when it has room to send. There is no task or queue
//! in between, so a state is read at the moment it can leave. For a stalled reader, at most the answer to its
//! last request waits in the buffers of HTTP/2. The answer to its next request is the newest state again.

use std::sync::Arc;
use std::time::Duration;

use simd_core::{Command, Reply};
use simd_proto::{methods, v1};
use tokio_util::sync::CancellationToken;
use tonic::{Status, Streaming};

use super::claims::Presented;
use super::joint::readings_beside;
use super::mismatched;
use super::once::Refused;
use super::status::Explained;
use super::transport::with_reason;
use crate::convert::from_proto::joint::set_targets;
use crate::convert::from_proto::sensor::beside;
use crate::convert::from_proto::state::{Wait, control_timeout, selections, wait};
use crate::convert::{Selection, to_proto};
use simd_world::SimHandle;
use simd_world::handle::{CallError, Done, Published, RunState, SensorSelection};

/// One controller's stream.
#[derive(Debug)]
pub(super) struct Control {
    handle: SimHandle,
    draining: CancellationToken,
    presented: Presented,
    requests: Streaming<v1::ControlRequest>,
    /// Joints in the answers, kept from request to request.
    selection: Selection,
    /// Sensors whose newest readings accompany the answers, kept from request to request.
    sensors: Vec<SensorSelection>,
    /// Sequence of the state in the last answer; 0 for none.
    answered: u64,
    /// Sequence of the newest state when the last answer was a refusal.
    refused: Option<u64>,
}

/// Longest wait of a repeated refusal for a newer state.
const WAIT: Duration = Duration::from_secs(1);

impl Control {
    pub(super) fn new(
        handle: SimHandle,
        presented: Presented,
        requests: Streaming<v1::ControlRequest>,
    ) -> Self {
        let draining = handle.draining();
        Self {
            handle,
            draining,
            presented,
            requests,
            selection: Selection::default(),
            sensors: Vec::new(),
            answered: 0,
            refused: None,
        }
    }

    /// Takes one request and answers it. Ends with the requests, or when the daemon drains.
    pub(super) async fn answer_next(mut self) -> Result<Option<(v1::ControlResponse, Self)>, Status> {
        let draining = self.draining.clone();
        let answer = async {
            let Some(request) = self.requests.message().await.map_err(with_reason)? else { return Ok(None) };
            Ok(self.answer(request).await.map(|answer| (answer, self)))
        };
        draining.run_until_cancelled(answer).await.unwrap_or(Ok(None))
    }

    /// Answers one request; `None` if the daemon drains.
    async fn answer(&mut self, request: v1::ControlRequest) -> Option<v1::ControlResponse> {
        let at_once = request.wait == i32::from(v1::ControlWait::None);
        let explained = match self.try_answer(request).await {
            Ok(answer) => {
                self.refused = None;
                return Some(answer);
            }
            Err(Refused::Call(CallError::ShuttingDown)) => return None,
            Err(refused) => Explained::from(&refused),
        };
        // A client that asks for each newer state must not get refusals faster than states.
        if let (Some(refused), false) = (self.refused, at_once)
            && let Err(CallError::ShuttingDown) = self.handle.newer_than(refused, Some(WAIT)).await
        {
            return None;
        }
        self.count(&explained);
        Some(self.refusal(explained))
    }

    /// Counts a refusal like the refusal of a call.
    fn count(&self, explained: &Explained) {
        if let Some(method) = methods::find("JointService", "Control") {
            self.handle.refused_beside_calls(method, self.handle.call().transport, explained.how());
        }
    }

    async fn try_answer(&mut self, request: v1::ControlRequest) -> Result<v1::ControlResponse, Refused> {
        // Stored even if the rest fails, so that no later answer has joints that were not requested.
        if !request.selections.is_empty() {
            self.selection = Selection::new(selections(request.selections)?);
        }
        if !request.sensors.is_empty() {
            self.sensors = beside(request.sensors)?;
        }
        let timeout = control_timeout(request.timeout)?;
        let wait = wait(request.wait)?;
        let mut targets = set_targets(request.robots, request.limit_policy)?;
        let claim = self.presented.claim(&self.handle, &request.claim);
        // Targets take effect only if their answer can be given.
        self.selection.resolve(&self.handle.newest().state.world)?;
        self.handle.readings_beside(&self.sensors)?;

        let mut clamped = Vec::new();
        let mut after = self.answered.max(request.after_sequence);
        if targets.robots.is_empty() {
            if let Ok(Some(claim)) = claim {
                self.handle.renew(claim);
            }
        } else {
            targets.source = Some(self.handle.target_source());
            let done = self.handle.acting_for(claim?).command(Command::SetTargets(targets)).await?;
            after = after.max(self.before_shown(&done));
            clamped = match done.applied.reply {
                Reply::Targets { clamped, changed_law: _ } => to_proto::joint::clamped(clamped),
                other => return Err(mismatched(&other).into()),
            };
        }
        let state = match wait {
            Wait::NewerState => self.handle.newer_than(after, timeout).await?,
            Wait::None => self.handle.newest(),
        };
        let states = Some(self.states(&state)?);
        let sensors = readings_beside(&self.handle, &self.sensors)?;
        Ok(v1::ControlResponse { states, clamped, refusal: None, sensors })
    }

    /// Returns the sequence before the first state that shows a command's effect. While playing, the next
    /// step's state shows it; otherwise, the state is published with the command.
    fn before_shown(&self, done: &Done) -> u64 {
        match self.handle.statistics().state {
            RunState::Playing => done.sequence,
            RunState::Paused | RunState::Stopped => done.sequence.saturating_sub(1),
        }
    }

    fn states(&mut self, state: &Arc<Published>) -> Result<v1::JointStates, simd_core::Error> {
        let states = self.selection.states(state)?;
        self.answered = state.sequence;
        Ok(states)
    }

    /// Returns a refusal with the newest state. The first one goes out at once: a controller must learn of it
    /// even if the world is paused and no newer state comes. The state is left out if the selected robots or
    /// joints do not exist.
    fn refusal(&mut self, explained: Explained) -> v1::ControlResponse {
        let newest = self.handle.newest();
        self.refused = Some(newest.sequence);
        let states = self.states(&newest).ok();
        v1::ControlResponse {
            states,
            clamped: Vec::new(),
            refusal: Some(explained.into()),
            sensors: Vec::new(),
        }
    }
}

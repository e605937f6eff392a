//! Steps that callers requested while the world does not play, in order.

use std::collections::VecDeque;

use simd_core::simulation::command::Clamped;

use super::event::ReplyTo;
use super::published::Stepped;
use crate::call_error::CallError;

/// Calls that wait for their steps.
#[derive(Debug)]
pub(super) struct StepQueue {
    /// Maximum number of waiting calls. Each holds a connection.
    limit: usize,
    calls: VecDeque<Pending>,
}

/// A call that waits for its steps.
#[derive(Debug)]
pub(super) struct Pending {
    steps: u64,
    done: u64,
    /// Clamped targets of the call, which are already applied.
    pub(super) clamped: Vec<Clamped>,
    /// Receiver of the result after its last step.
    pub(super) reply: ReplyTo<Stepped>,
}

impl StepQueue {
    /// Makes a queue for at most `limit` calls.
    pub(super) fn new(limit: usize) -> Self {
        Self { limit, calls: VecDeque::new() }
    }

    /// Refuses a call if the queue is full.
    pub(super) fn has_room(&self) -> Result<(), CallError> {
        if self.calls.len() < self.limit {
            return Ok(());
        }
        Err(CallError::LimitExceeded {
            what: "the number of waiting step calls".into(),
            value: self.limit as u64 + 1,
            limit: self.limit as u64,
        })
    }

    /// Appends a call; the caller checks `has_room` before.
    pub(super) fn push(&mut self, steps: u64, clamped: Vec<Clamped>, reply: ReplyTo<Stepped>) {
        self.calls.push_back(Pending { steps, done: 0, clamped, reply });
    }

    /// Returns whether a step is wanted. Calls of disconnected callers are dropped; their completed steps
    /// stay.
    pub(super) fn is_wanted(&mut self) -> bool {
        while self.calls.front().is_some_and(|call| call.reply.is_closed()) {
            self.calls.pop_front();
        }
        !self.calls.is_empty()
    }

    /// Counts a step, and returns the call that it completes, if any.
    pub(super) fn stepped(&mut self) -> Option<Pending> {
        let first = self.calls.front_mut()?;
        first.done += 1;
        if first.done < first.steps {
            return None;
        }
        self.calls.pop_front()
    }

    /// Takes the first call, and the error that names `by` as the cause of its end.
    pub(super) fn superseded(&mut self, by: &str) -> Option<(ReplyTo<Stepped>, CallError)> {
        let Pending { steps, done, clamped: _, reply } = self.calls.pop_front()?;
        Some((reply, CallError::Superseded { by: by.into(), steps_done: done, steps }))
    }
}

//! A batch in progress: results so far, and the progress of copies that have not ended.

use std::ops::Range;

use super::schedule::Halt;
use crate::simulation::Error;

/// Results of a batch. Each array has its copies concatenated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchResult {
    /// Quantities by row; NaN from where a copy ended.
    pub states: Vec<f64>,
    /// Costs by term, weighted and summed over the steps; infinite if a copy ended early.
    pub costs: Vec<f64>,
    /// Costs by step, all terms together; infinite from where a copy ended.
    pub step_costs: Vec<f64>,
    /// Number of steps that each copy did.
    pub steps_done: Vec<u64>,
    /// Number of these steps that were done in lanes, for all copies together.
    pub lane_steps: u64,
    /// Copies that ended before their last step.
    pub ended: Vec<Ended>,
}

/// A copy that ended before its last step.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Index of the copy.
    pub copy: usize,
    /// Reason, as a sentence.
    pub reason: String,
}

/// Parts of a batch's arrays that a copy writes.
pub(super) struct CopyResult<'r> {
    pub(super) states: &'r mut [f64],
    pub(super) costs: &'r mut [f64],
    pub(super) step_costs: &'r mut [f64],
}

/// Returns a copy's part of an array.
pub(super) fn part(array: &mut [f64], index: usize, length: usize) -> &mut [f64] {
    &mut array[index * length..(index + 1) * length]
}

/// Reason why a copy does no more steps.
#[derive(Debug)]
pub(super) enum Stop {
    /// The schedule stopped it.
    Halted(Halt),
    /// It cannot continue; the message is for people.
    Ended(String),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Ended(error.to_string())
    }
}

impl From<Halt> for Stop {
    fn from(halt: Halt) -> Self {
        Self::Halted(halt)
    }
}

/// A copy in progress, alone or in a group of lanes.
#[derive(Debug)]
pub(super) struct Running {
    pub(super) copy: usize,
    /// Index in the batch.
    pub(super) index: usize,
    /// Number of rows read.
    pub(super) rows: usize,
    /// Whether its view is complete, except for what a step of lanes changes.
    pub(super) is_seen: bool,
    /// Number of steps that it does alone if lanes do not do one; doubles each time.
    pub(super) pause: u64,
    /// Number of steps done when it last stepped alone, which may exceed the group's.
    pub(super) done: u64,
    /// Number of steps done when it last entered its lane.
    pub(super) entered: u64,
    /// Number of steps done in lanes until it last left one.
    pub(super) lane_steps: u64,
    /// Reason why it does no more steps, and the number of steps done by then.
    pub(super) stop: Option<(Stop, u64)>,
}

impl Running {
    /// Creates a copy without steps.
    fn new(copy: usize, index: usize) -> Self {
        Self {
            copy,
            index,
            rows: 0,
            is_seen: false,
            pause: 0,
            done: 0,
            entered: 0,
            lane_steps: 0,
            stop: None,
        }
    }

    /// Returns whether it has yet to do this step.
    pub(super) fn waits_for(&self, step: u64) -> bool {
        self.stop.is_none() && self.done <= step
    }
}

/// A batch of which some copies may be in progress.
#[derive(Debug)]
pub(super) struct OpenBatch {
    /// Number of the batch in the rollout.
    pub(super) batch: usize,
    pub(super) copies: Range<usize>,
    pub(super) result: BatchResult,
    /// Number of its copies that are in progress or have ended.
    begun: usize,
    /// Paused copies; their former workers have their worlds, in this order.
    pub(super) paused: Vec<Running>,
    /// Steps done by the copies in progress: by each of them, or by the group as a whole.
    pub(super) step: u64,
}

impl OpenBatch {
    /// Creates a batch without steps, with room for its results.
    pub(super) fn new(batch: usize, copies: Range<usize>, room: BatchResult) -> Self {
        Self { batch, copies, result: room, begun: 0, paused: Vec::new(), step: 0 }
    }

    /// Returns the paused copies, or else the next ones, at most `count`; empty if all have ended.
    pub(super) fn take_up(&mut self, count: usize) -> Vec<Running> {
        if !self.paused.is_empty() {
            return std::mem::take(&mut self.paused);
        }
        let first = self.begun;
        self.begun = first.saturating_add(count).min(self.copies.len());
        self.step = 0;
        (first..self.begun).map(|index| Running::new(self.copies.start + index, index)).collect()
    }
}

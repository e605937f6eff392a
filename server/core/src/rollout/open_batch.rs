//! A batch that is under way: what its copies have given so far, and how far those are that are not at their end.

use std::ops::Range;

use super::schedule::Halt;
use crate::simulation::Error;

/// What became of a batch. Each array has its copies one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchResult {
    /// By row and quantity; NaN from where a copy ended.
    pub states: Vec<f64>,
    /// By term, weighted and summed over the steps; infinite where a copy ended.
    pub costs: Vec<f64>,
    /// By step, all terms together; infinite from where a copy ended.
    pub step_costs: Vec<f64>,
    /// Steps that each copy did.
    pub steps_done: Vec<u64>,
    /// How many of them were done in lanes, of all copies together.
    pub lane_steps: u64,
    /// Copies that ended before their last step.
    pub ended: Vec<Ended>,
}

/// A copy that ended before its last step.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Which.
    pub copy: usize,
    /// Why, as a sentence.
    pub reason: String,
}

/// What a copy writes into the arrays of a batch.
pub(super) struct CopyResult<'r> {
    pub(super) states: &'r mut [f64],
    pub(super) costs: &'r mut [f64],
    pub(super) step_costs: &'r mut [f64],
}

/// The part of an array that is a copy's.
pub(super) fn part(array: &mut [f64], index: usize, length: usize) -> &mut [f64] {
    &mut array[index * length..(index + 1) * length]
}

/// Why a copy does no more steps.
#[derive(Debug)]
pub(super) enum Stop {
    /// It is not to go on.
    Halted(Halt),
    /// It cannot go on; for people.
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

/// A copy that is under way: alone, or in a group of lanes.
#[derive(Debug)]
pub(super) struct Running {
    pub(super) copy: usize,
    /// Among those of the batch.
    pub(super) index: usize,
    /// Rows that are read.
    pub(super) rows: usize,
    /// Its view has all of its world, but for what a step of lanes changes.
    pub(super) is_seen: bool,
    /// Steps that it does by itself in a row where lanes do not do one: twice as many each time.
    pub(super) pause: u64,
    /// Steps that it had done when it last stepped by itself: that may be more than the group has done.
    pub(super) done: u64,
    /// Steps that it had done when it last came into its lane.
    pub(super) entered: u64,
    /// Steps that it did in lanes until it last left one.
    pub(super) lane_steps: u64,
    /// Why it does no more, and the steps that it had done by then.
    pub(super) stop: Option<(Stop, u64)>,
}

impl Running {
    /// One that has done nothing.
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

    /// Whether it has yet to do this step.
    pub(super) fn waits_for(&self, step: u64) -> bool {
        self.stop.is_none() && self.done <= step
    }
}

/// A batch of which some copies may be under way.
#[derive(Debug)]
pub(super) struct OpenBatch {
    /// Its number in the rollout.
    pub(super) batch: usize,
    pub(super) copies: Range<usize>,
    pub(super) result: BatchResult,
    /// How many of its copies are under way, or at their end.
    begun: usize,
    /// Those that were paused; the workers that had them have their worlds, in this order.
    pub(super) paused: Vec<Running>,
    /// Steps that those that are under way have done: all of them, or the group as a whole.
    pub(super) step: u64,
}

impl OpenBatch {
    /// One of which nothing is done, with room for what it gives.
    pub(super) fn new(batch: usize, copies: Range<usize>, room: BatchResult) -> Self {
        Self { batch, copies, result: room, begun: 0, paused: Vec::new(), step: 0 }
    }

    /// Copies that were paused, or else the next ones, `count` at the most; none where all are at their end.
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

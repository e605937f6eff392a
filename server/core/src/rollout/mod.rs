//! Rollouts: copies of a world that continue from one state, each with its own controls. Predictive control
//! and learning use them.
//!
//! From the bottom to the top; a file imports only from those above it in this list:
//!
//! * [`request`]: the request. `names`: resolution of its names.
//! * `knots`: rows of numbers over time. `draw`: pseudorandom numbers.
//! * `controls`, `starts`, `variations`: differences between copies.
//! * `quantities`, `costs`: results read of copies. `start_state`: facts about the state that they start
//!   from.
//! * `schedule`: pauses and the end. `open_batch`: copies in progress, and their results.
//! * [`Rollout`]: the plan, made once. `batch`: the copies, a batch at a time; `lane_copy`, `lanes`: several
//!   of them at once.
//!
//! A copy is the world itself: its steps are [`Simulation::step`], and its inputs are commands. It therefore
//! ends where the world would, to the bit. A copy depends only on the state, the request and its number: not
//! on other copies, nor on the thread.

mod batch;
mod controls;
mod costs;
mod draw;
mod knots;
mod lane_copy;
mod lanes;
mod names;
mod nearness;
mod open_batch;
mod quantities;
pub mod request;
mod schedule;
mod start_state;
mod starts;
#[cfg(test)]
mod tests;
mod variations;

use std::ops::Range;

pub use batch::Worker;
use controls::ControlPlan;
use costs::CostPlan;
use names::refuse;
pub use open_batch::{BatchResult, Ended};
use quantities::QuantityPlan;
pub use request::RolloutRequest;
pub use schedule::{Halt, Schedule};
use start_state::StartFacts;
use starts::StartPlan;
use variations::VariationPlan;

use crate::simulation::{Error, PublishedState, Saved, Simulation};

/// Maximum number of copies of a rollout.
pub const MAX_COPIES: usize = 65_536;

/// Maximum number of steps of a copy.
pub const MAX_STEPS: u64 = 1_000_000;

/// Maximum number of entries of each list of a request.
const MAX_ENTRIES: usize = 256;

/// Number of copies that are advanced together.
const BATCH: usize = 8;

/// Maximum memory of the worlds of copies that step at once, bytes; copies of a larger world step one after
/// the other.
const LANE_WORLDS: usize = 32 << 20;

/// Validated plan of a rollout: copies of a world and their inputs. Shared by all workers.
#[derive(Debug)]
pub struct Rollout {
    start: Saved,
    /// State of the world in which copies start.
    state: PublishedState,
    shape: Shape,
    controls: Vec<ControlPlan>,
    starts: Vec<StartPlan>,
    variations: Vec<VariationPlan>,
    quantities: Vec<QuantityPlan>,
    costs: Vec<CostPlan>,
    record_every: u64,
    record_start: bool,
    start_facts: StartFacts,
    /// Whether several copies step at once, as long as they can.
    has_lanes: bool,
    /// Robot that moves, if copies step at once.
    lane_robot: usize,
    /// Whether at most four of them step at once, also if the processor has vectors for eight.
    has_four_lanes: bool,
}

/// Numbers of results of a rollout.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// Number of copies.
    pub copies: usize,
    /// Number of steps of each copy.
    pub steps: u64,
    /// Number of moments at which quantities are read.
    pub rows: usize,
    /// Number of values of each quantity.
    pub widths: Vec<usize>,
    /// Number of terms of the cost.
    pub terms: usize,
    /// Whether the cost of each step is returned.
    pub step_costs: bool,
}

impl Shape {
    /// Returns the number of values of all quantities at a moment.
    pub fn columns(&self) -> usize {
        self.widths.iter().sum()
    }

    /// Returns the number of values of a copy.
    fn of_copy(&self) -> u64 {
        let states = (self.rows as u64).saturating_mul(self.columns() as u64);
        let step_costs = if self.step_costs { self.steps } else { 0 };
        states.saturating_add(step_costs).saturating_add(self.terms as u64)
    }

    /// Returns the memory of all values, bytes.
    pub fn bytes(&self) -> u64 {
        self.of_copy().saturating_mul(self.copies as u64).saturating_mul(size_of::<f64>() as u64)
    }
}

fn at_most(what: &str, value: u64, limit: u64) -> Result<(), Error> {
    if value <= limit {
        return Ok(());
    }
    Err(Error::LimitExceeded { what: what.to_owned(), value, limit })
}

impl Rollout {
    /// Resolves all names of a request in the world of a state, and tries a first step. The answer may take
    /// at most `most_bytes`.
    ///
    /// # Errors
    /// Returns an error if a name is not found, a number is invalid, or a limit is exceeded.
    pub fn new(start: Saved, request: RolloutRequest, most_bytes: u64) -> Result<Self, Error> {
        let RolloutRequest {
            copies,
            steps,
            starts,
            variations,
            seed,
            controls,
            quantities,
            record_every,
            record_start,
            costs,
            step_costs,
        } = request;
        for (field, value) in [("copies", copies as u64), ("steps", steps)] {
            if value == 0 {
                return Err(refuse(field, value, "it must be at least 1"));
            }
        }
        at_most("the number of copies", copies as u64, MAX_COPIES as u64)?;
        at_most("the number of steps", steps, MAX_STEPS)?;
        for (what, count) in [
            ("starts", starts.len()),
            ("variations", variations.len()),
            ("controls", controls.len()),
            ("quantities", quantities.len()),
            ("costs", costs.len()),
        ] {
            at_most(&format!("the number of {what}"), count as u64, MAX_ENTRIES as u64)?;
        }
        let world = Simulation::copy_of(&start);
        let mut state = PublishedState::default();
        world.observe(&mut state);
        let time_step = world.settings().time_step;
        let layout = &*state.world;
        let quantities: Vec<_> = (quantities.iter().enumerate())
            .map(|(index, each)| QuantityPlan::new(layout, index, each))
            .collect::<Result<_, _>>()?;
        let costs: Vec<_> = (costs.into_iter().enumerate())
            .map(|(index, term)| CostPlan::new(layout, index, term))
            .collect::<Result<_, _>>()?;
        let rows = match (quantities.is_empty(), record_every) {
            (true, _) => 0,
            (false, 0) => 1 + u64::from(record_start),
            (false, every) => steps / every + u64::from(record_start),
        };
        let widths: Vec<usize> = quantities.iter().map(QuantityPlan::width).collect();
        let rows = usize::try_from(rows).unwrap_or(usize::MAX);
        let step_costs = step_costs && !costs.is_empty();
        let shape = Shape { copies, steps, rows, widths, terms: costs.len(), step_costs };
        at_most("the bytes of the rollout's answer", shape.bytes(), most_bytes)?;
        let starts = (starts.into_iter().enumerate())
            .map(|(index, start)| StartPlan::new(layout, index, start, copies))
            .collect::<Result<_, _>>()?;
        let variations = (variations.into_iter().enumerate())
            .map(|(index, each)| VariationPlan::new(&state, time_step, (index, seed), each, copies))
            .collect::<Result<_, _>>()?;
        let controls = (controls.into_iter().enumerate())
            .map(|(index, control)| ControlPlan::new(layout, index, control, copies))
            .collect::<Result<_, _>>()?;
        let start_facts = StartFacts::of(&start);
        let mut rollout = Self {
            start,
            state,
            shape,
            controls,
            starts,
            variations,
            quantities,
            costs,
            record_every,
            record_start,
            start_facts,
            has_lanes: false,
            lane_robot: 0,
            has_four_lanes: false,
        };
        if let Some(robot) = world.lane_robot() {
            rollout.has_lanes = start_facts.world_bytes.saturating_mul(BATCH) <= LANE_WORLDS;
            rollout.lane_robot = robot;
        }
        rollout.try_first_step(Worker::with(world))?;
        Ok(rollout)
    }

    /// Returns the rollout with copies that step one after the other, for comparisons.
    #[must_use]
    pub fn without_lanes(mut self) -> Self {
        self.has_lanes = false;
        self
    }

    /// Returns the rollout with at most four copies that step at once, for comparisons.
    #[must_use]
    pub fn with_four_lanes(mut self) -> Self {
        self.has_four_lanes = true;
        self
    }

    /// Returns whether several copies step at once, as long as they can and the processor has vectors for it.
    pub fn steps_in_lanes(&self) -> bool {
        self.has_lanes
    }

    /// Returns the number of its results.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Returns the state that all copies start from.
    pub fn start(&self) -> &Saved {
        &self.start
    }

    /// Returns a fingerprint. It is equal if copies start from equal states, of robots with equal names and
    /// masses.
    pub fn start_fingerprint(&self) -> u64 {
        self.start_facts.fingerprint
    }

    /// Returns the number of batches.
    pub fn batches(&self) -> usize {
        self.shape.copies.div_ceil(BATCH)
    }

    /// Returns the copies of a batch.
    pub fn copies_of(&self, batch: usize) -> Range<usize> {
        let first = batch.saturating_mul(BATCH).min(self.shape.copies);
        first..first.saturating_add(BATCH).min(self.shape.copies)
    }

    /// Returns whether quantities are read after `done` steps.
    fn is_row(&self, done: u64) -> bool {
        match (done, self.record_every) {
            (0, _) => self.record_start,
            (done, 0) => done == self.shape.steps,
            (done, every) => done.is_multiple_of(every),
        }
    }
}

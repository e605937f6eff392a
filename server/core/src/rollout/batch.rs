//! Advance of copies, a batch at a time.

use std::cell::Cell;
use std::ops::Range;

use super::Rollout;
use super::controls::{ControlMemory, CopyStep};
use super::open_batch::{BatchResult, CopyResult, Ended, OpenBatch, Running, Stop, part};
use super::quantities::View;
use super::schedule::{Halt, Schedule, Unpaused};
use super::variations::trees;
use crate::pool::Interrupt;
use crate::simulation::{Error, EventKind, Simulation};

/// Largest unweighted cost of a term in a step. The sum over the maximum numbers of terms and steps, with the
/// largest weight, is then finite. Only copies that ended have an infinite or NaN cost.
const LARGEST_VALUE: f64 = 1e200;

/// Memory of a worker, which runs one copy at a time.
#[derive(Debug)]
pub struct Worker {
    pub(super) world: Simulation,
    pub(super) view: View,
    pub(super) memory: ControlMemory,
    /// Factors of the rollout's gains, by robot and joint; empty means 1.
    gain_factors: Vec<Vec<f64>>,
    /// Workers of further copies that step at once, one each.
    pub(super) beside: Vec<Worker>,
    /// Batch in progress.
    open: Option<OpenBatch>,
}

impl Worker {
    pub(super) fn with(world: Simulation) -> Self {
        Self {
            world,
            view: View::default(),
            memory: ControlMemory::default(),
            gain_factors: Vec::new(),
            beside: Vec::new(),
            open: None,
        }
    }
}

impl Rollout {
    /// Creates a worker.
    pub fn worker(&self) -> Worker {
        Worker::with(Simulation::copy_of(&self.start))
    }

    /// Advances the copies of a batch by all of their steps. Returns nothing if `interrupt`, which is called
    /// before each step, returns true.
    pub fn advance(
        &self,
        worker: &mut Worker,
        batch: usize,
        interrupt: &Interrupt<'_>,
    ) -> Option<BatchResult> {
        self.begin_batch(worker, batch);
        self.go_on(worker, &Unpaused(interrupt)).ok().flatten().map(|(_, result)| result)
    }

    /// Starts a batch on a worker, which drops its current one.
    pub fn begin_batch(&self, worker: &mut Worker, batch: usize) {
        worker.open = Some(self.open(batch, self.copies_of(batch)));
    }

    /// Returns a new batch.
    pub(super) fn open(&self, batch: usize, copies: Range<usize>) -> OpenBatch {
        let count = copies.len();
        let states = self.shape.rows * self.shape.columns();
        let steps = if self.shape.step_costs { self.shape.steps as usize } else { 0 };
        let room = BatchResult {
            states: vec![f64::NAN; count * states],
            costs: vec![0.0; count * self.shape.terms],
            step_costs: vec![f64::INFINITY; count * steps],
            steps_done: vec![0; count],
            lane_steps: 0,
            ended: Vec::new(),
        };
        OpenBatch::new(batch, copies, room)
    }

    /// Advances the copies of the worker's batch by as many steps as the schedule allows. Returns the batch's
    /// number and result once all copies have ended; `None` if the worker has no batch.
    ///
    /// Copies step only here: several at once if lanes can take them, else one after the other. In both
    /// cases, and with any pauses, each has the same bits.
    ///
    /// # Errors
    /// Returns why the copies have not ended. If they are paused, the worker keeps the batch.
    pub fn go_on(
        &self,
        worker: &mut Worker,
        schedule: &dyn Schedule,
    ) -> Result<Option<(usize, BatchResult)>, Halt> {
        let Some(mut open) = worker.open.take() else { return Ok(None) };
        let advanced = match self.has_lanes {
            true => self.advance_with_vectors(worker, &mut open, schedule),
            false => self.advance_alone(worker, &mut open, schedule),
        };
        match advanced {
            Ok(()) => Ok(Some((open.batch, open.result))),
            Err(Halt::Paused) => {
                worker.open = Some(open);
                Err(Halt::Paused)
            }
            Err(Halt::Over) => Err(Halt::Over),
        }
    }

    /// Advances copies one after the other.
    pub(super) fn advance_alone(
        &self,
        worker: &mut Worker,
        open: &mut OpenBatch,
        schedule: &dyn Schedule,
    ) -> Result<(), Halt> {
        while let Some(mut running) = open.take_up(1).pop() {
            let ran = self.run(worker, &mut running, (&mut open.step, &mut open.result), schedule);
            let Running { copy, index, .. } = running;
            match ran {
                Ok(()) => {}
                Err(Stop::Halted(halt)) => {
                    open.paused.push(running);
                    return Err(halt);
                }
                Err(Stop::Ended(reason)) => {
                    part(&mut open.result.costs, index, self.shape.terms).fill(f64::INFINITY);
                    open.result.ended.push(Ended { copy, reason });
                }
            }
            open.result.steps_done[index] = open.step;
        }
        Ok(())
    }

    /// Returns a copy's parts of its batch's arrays.
    pub(super) fn copy_result<'r>(&self, result: &'r mut BatchResult, index: usize) -> CopyResult<'r> {
        let steps = if self.shape.step_costs { self.shape.steps as usize } else { 0 };
        CopyResult {
            states: part(&mut result.states, index, self.shape.rows * self.shape.columns()),
            costs: part(&mut result.costs, index, self.shape.terms),
            step_costs: part(&mut result.step_costs, index, steps),
        }
    }

    /// Does the remaining steps of a copy.
    fn run(
        &self,
        worker: &mut Worker,
        running: &mut Running,
        (done, result): (&mut u64, &mut BatchResult),
        schedule: &dyn Schedule,
    ) -> Result<(), Stop> {
        let mut copy_result = self.copy_result(result, running.index);
        if *done == 0 {
            self.begin(worker, running.copy)?;
            running.rows = 0;
            if self.is_row(0) {
                worker.look();
                self.read(worker, &mut running.rows, &mut copy_result);
            }
        }
        for step in *done..self.shape.steps {
            schedule.before_step()?;
            self.drive(worker, running.copy, step)?;
            worker.step(schedule)?;
            *done = step + 1;
            let is_row = self.is_row(step + 1);
            if is_row || !self.costs.is_empty() {
                worker.look();
            }
            if is_row {
                self.read(worker, &mut running.rows, &mut copy_result);
            }
            self.weigh(worker, step, &mut copy_result, schedule)?;
        }
        Ok(())
    }

    /// Checks that copies can begin, be driven and be weighed: an error of the first one is the answer to the
    /// request.
    pub(super) fn try_first_step(&self, mut worker: Worker) -> Result<(), Error> {
        self.begin(&mut worker, 0)?;
        self.drive(&mut worker, 0, 0)?;
        worker.look();
        self.costs.iter().try_for_each(|term| term.value(&mut worker.view, &|| false).map(drop))
    }

    /// Moves the worker's world to the start of a copy.
    pub(super) fn begin(&self, worker: &mut Worker, copy: usize) -> Result<(), Error> {
        let robots = self.state.world.entities.len();
        let mut masses = vec![Vec::new(); robots];
        self.variations.iter().for_each(|variation| variation.masses(copy, &mut masses, &self.state));
        let Worker { world, gain_factors, .. } = worker;
        world.begin_from(&self.start, &trees(&masses, &self.state));
        gain_factors.clear();
        gain_factors.resize_with(robots, Vec::new);
        self.starts.iter().try_for_each(|start| start.apply(world, copy))?;
        let mut vary = self.variations.iter();
        vary.try_for_each(|variation| variation.apply(world, copy, gain_factors, &self.state))?;
        // A reset of joints and the like is not a failure.
        world.take_events();
        Ok(())
    }

    /// Applies the controls and variations that are due before a step of a copy.
    pub(super) fn drive(&self, worker: &mut Worker, copy: usize, step: u64) -> Result<(), Error> {
        let Worker { world, memory, gain_factors, .. } = worker;
        for control in &self.controls {
            let factors = &gain_factors[control.robot()];
            let factor = |joint: usize| factors.get(joint).copied().unwrap_or(1.0);
            control.drive(world, CopyStep { copy, step }, factor, memory)?;
        }
        self.variations.iter().try_for_each(|variation| variation.apply_wrench(world, copy, step))
    }

    /// Writes the quantities of the next row.
    pub(super) fn read(&self, worker: &mut Worker, rows: &mut usize, copy_result: &mut CopyResult<'_>) {
        let mut row = part(copy_result.states, *rows, self.shape.columns());
        *rows += 1;
        for quantity in &self.quantities {
            let (own, others) = row.split_at_mut(quantity.width());
            quantity.write(&mut worker.view, own);
            row = others;
        }
    }

    /// Adds the cost of a step.
    pub(super) fn weigh(
        &self,
        worker: &mut Worker,
        step: u64,
        copy_result: &mut CopyResult<'_>,
        schedule: &dyn Schedule,
    ) -> Result<(), Stop> {
        let is_last = step + 1 == self.shape.steps;
        // A distance from a cancelled search is invalid, even if the schedule later withdraws the
        // cancellation.
        let was_over = Cell::new(false);
        let is_over = || {
            was_over.set(was_over.get() || schedule.is_over());
            was_over.get()
        };
        let mut of_step = 0.0;
        for (term, sum) in self.costs.iter().zip(&mut *copy_result.costs) {
            let weight = if is_last { term.weight + term.final_weight } else { term.weight };
            let value = term.value(&mut worker.view, &is_over);
            if was_over.get() {
                return Err(Halt::Over.into());
            }
            let cost = weight * value?.min(LARGEST_VALUE);
            *sum += cost;
            of_step += cost;
        }
        if let Some(slot) = usize::try_from(step).ok().and_then(|step| copy_result.step_costs.get_mut(step)) {
            *slot = of_step;
        }
        Ok(())
    }
}

impl Worker {
    /// Does a step. A robot whose state is not finite after it ends the copy.
    pub(super) fn step(&mut self, schedule: &dyn Schedule) -> Result<(), Stop> {
        if !schedule.has_long_steps() {
            self.world.step();
        } else if !self.world.step_interruptible(&|| schedule.is_over()) {
            return Err(Halt::Over.into());
        }
        let disabled = |kind: EventKind| match kind {
            EventKind::EntityDisabled { robot, reason } => {
                // The rest describes what a world does with the robot.
                let what = reason.split_once("; the robot was restored").map_or(&*reason, |(what, _)| what);
                Some(format!("robot {robot:?}: {what}"))
            }
            _ => None,
        };
        let failed = self.world.take_events().into_iter().find_map(|event| disabled(event.kind));
        failed.map_or(Ok(()), |reason| Err(Stop::Ended(reason)))
    }

    /// Updates the view from the world.
    pub(super) fn look(&mut self) {
        self.world.observe(&mut self.view.state);
        self.view.changed();
    }
}

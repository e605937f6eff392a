//! Copies, a batch at a time.

use std::cell::Cell;
use std::ops::Range;

use super::Rollout;
use super::controls::ControlMemory;
use super::open_batch::{BatchResult, CopyResult, Ended, OpenBatch, Running, Stop, part};
use super::quantities::View;
use super::schedule::{Halt, Schedule, Unpaused};
use super::variations::trees;
use crate::pool::Interrupt;
use crate::simulation::{Error, EventKind, Simulation};

/// What a term is worth in a step at the most, before it is weighted: as large a weight of as many terms in as many steps as there may
/// be sums up to a number. No cost is infinite, or none at all, but that of a copy that ended.
const LARGEST_VALUE: f64 = 1e200;

/// The memory of one who runs copies: one of them at a time.
#[derive(Debug)]
pub struct Worker {
    pub(super) world: Simulation,
    pub(super) view: View,
    pub(super) memory: ControlMemory,
    /// Factors of the gains that the rollout gives, by robot and joint; empty is one.
    gain_factors: Vec<Vec<f64>>,
    /// Of copies that step at once, one each.
    pub(super) beside: Vec<Worker>,
    /// The batch that it is at.
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
    /// One who runs copies.
    pub fn worker(&self) -> Worker {
        Worker::with(Simulation::copy_of(&self.start))
    }

    /// Advances the copies of a batch by all of their steps; nothing where `interrupt`, which is asked before each step, says that
    /// no one wants them any more.
    pub fn advance(
        &self,
        worker: &mut Worker,
        batch: usize,
        interrupt: &Interrupt<'_>,
    ) -> Option<BatchResult> {
        self.begin_batch(worker, batch);
        self.go_on(worker, &Unpaused(interrupt)).ok().flatten().map(|(_, result)| result)
    }

    /// Has a worker begin a batch, in the place of the one that it was at.
    pub fn begin_batch(&self, worker: &mut Worker, batch: usize) {
        worker.open = Some(self.open(batch, self.copies_of(batch)));
    }

    /// A batch of which nothing is done.
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

    /// Advances the copies of the batch that a worker is at by as many of their steps as the schedule lets them do. Gives the
    /// number of the batch and what became of it once all are at their end; nothing where the worker is at none.
    ///
    /// The one place where copies step: several at once where they can be in lanes, else one after the other. Either way, and
    /// wherever they pause, each has the same bits.
    ///
    /// # Errors
    /// Returns why they are not at their end. Where they are paused, the worker is still at the batch.
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

    /// What a copy writes into the arrays of its batch.
    pub(super) fn copy_result<'r>(&self, result: &'r mut BatchResult, index: usize) -> CopyResult<'r> {
        let steps = if self.shape.step_costs { self.shape.steps as usize } else { 0 };
        CopyResult {
            states: part(&mut result.states, index, self.shape.rows * self.shape.columns()),
            costs: part(&mut result.costs, index, self.shape.terms),
            step_costs: part(&mut result.step_costs, index, steps),
        }
    }

    /// Does the steps of a copy, after those that it has done.
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

    /// Looks whether copies can begin, drive and be weighed: what is wrong for the first is an answer to the request.
    pub(super) fn try_first_step(&self, mut worker: Worker) -> Result<(), Error> {
        self.begin(&mut worker, 0)?;
        self.drive(&mut worker, 0, 0)?;
        worker.look();
        self.costs.iter().try_for_each(|term| term.value(&mut worker.view, &|| false).map(drop))
    }

    /// Puts the worker's world to where a copy starts.
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
        // A reset of joints and the like is no failure.
        world.take_events();
        Ok(())
    }

    /// Gives a copy what is due before a step.
    pub(super) fn drive(&self, worker: &mut Worker, copy: usize, step: u64) -> Result<(), Error> {
        let Worker { world, memory, gain_factors, .. } = worker;
        for control in &self.controls {
            let factors = &gain_factors[control.robot()];
            let factor = |joint: usize| factors.get(joint).copied().unwrap_or(1.0);
            control.drive(world, (copy, step), factor, memory)?;
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
        // What is found by a search that was given up is no distance, also where who gave it up says something else the next time.
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
                // What follows is what a world does with it.
                let what = reason.split_once("; the robot was put back").map_or(&*reason, |(what, _)| what);
                Some(format!("robot {robot:?}: {what}"))
            }
            _ => None,
        };
        let failed = self.world.take_events().into_iter().find_map(|event| disabled(event.kind));
        failed.map_or(Ok(()), |reason| Err(Stop::Ended(reason)))
    }

    /// Looks at the world as it is now.
    pub(super) fn look(&mut self) {
        self.world.observe(&mut self.view.state);
        self.view.changed();
    }
}

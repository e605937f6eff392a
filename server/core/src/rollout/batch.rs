//! Copies, a batch at a time.

use std::ops::Range;

use super::Rollout;
use super::controls::ControlMemory;
use super::quantities::View;
use super::variations::trees;
use crate::simulation::{Error, EventKind, Simulation};

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
}

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

/// Why a copy does no more steps.
pub(super) enum Stop {
    /// The caller wants no more.
    Interrupted,
    /// It cannot go on; for people.
    Ended(String),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Ended(error.to_string())
    }
}

impl Worker {
    pub(super) fn with(world: Simulation) -> Self {
        Self {
            world,
            view: View::default(),
            memory: ControlMemory::default(),
            gain_factors: Vec::new(),
            beside: Vec::new(),
        }
    }
}

/// The part of an array that is a copy's.
pub(super) fn part(array: &mut [f64], index: usize, length: usize) -> &mut [f64] {
    &mut array[index * length..(index + 1) * length]
}

impl Rollout {
    /// One who runs copies.
    pub fn worker(&self) -> Worker {
        Worker::with(Simulation::copy_of(&self.start))
    }

    /// Advances the copies of a batch by all of their steps; nothing where `interrupt`, which is asked before each step, says that
    /// no one wants them any more.
    ///
    /// The one place where copies step: several at once where they can be in lanes, else one after the other. Either way each has
    /// the same bits.
    pub fn advance(
        &self,
        worker: &mut Worker,
        batch: usize,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<BatchResult> {
        let copies = self.copies_of(batch);
        let count = copies.len();
        let states = self.shape.rows * self.shape.columns();
        let steps = if self.shape.step_costs { usize::try_from(self.shape.steps).ok()? } else { 0 };
        let mut result = BatchResult {
            states: vec![f64::NAN; count * states],
            costs: vec![0.0; count * self.shape.terms],
            step_costs: vec![f64::INFINITY; count * steps],
            steps_done: vec![0; count],
            ended: Vec::new(),
        };
        if self.has_lanes {
            self.advance_with_vectors(worker, copies, &mut result, interrupt)?;
        } else {
            self.advance_alone(worker, copies, &mut result, interrupt)?;
        }
        Some(result)
    }

    /// Advances copies one after the other.
    pub(super) fn advance_alone(
        &self,
        worker: &mut Worker,
        copies: Range<usize>,
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<()> {
        for (index, copy) in copies.enumerate() {
            let mut done = 0;
            let ran = self.run(worker, copy, &mut done, self.copy_result(result, index), interrupt);
            result.steps_done[index] = done;
            match ran {
                Ok(()) => {}
                Err(Stop::Interrupted) => return None,
                Err(Stop::Ended(reason)) => {
                    part(&mut result.costs, index, self.shape.terms).fill(f64::INFINITY);
                    result.ended.push(Ended { copy, reason });
                }
            }
        }
        Some(())
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

    /// Does all steps of a copy.
    fn run(
        &self,
        worker: &mut Worker,
        copy: usize,
        done: &mut u64,
        mut copy_result: CopyResult<'_>,
        interrupt: &dyn Fn() -> bool,
    ) -> Result<(), Stop> {
        self.begin(worker, copy)?;
        let mut rows = 0;
        if self.is_row(0) {
            worker.look();
            self.read(worker, &mut rows, &mut copy_result);
        }
        for step in 0..self.shape.steps {
            if interrupt() {
                return Err(Stop::Interrupted);
            }
            self.drive(worker, copy, step)?;
            worker.step()?;
            *done = step + 1;
            let is_row = self.is_row(step + 1);
            if is_row || !self.costs.is_empty() {
                worker.look();
            }
            if is_row {
                self.read(worker, &mut rows, &mut copy_result);
            }
            self.weigh(worker, step, &mut copy_result, interrupt)?;
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
        interrupt: &dyn Fn() -> bool,
    ) -> Result<(), Error> {
        let is_last = step + 1 == self.shape.steps;
        let mut of_step = 0.0;
        for (term, sum) in self.costs.iter().zip(&mut *copy_result.costs) {
            let weight = if is_last { term.weight + term.final_weight } else { term.weight };
            let cost = weight * term.value(&mut worker.view, interrupt)?;
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
    pub(super) fn step(&mut self) -> Result<(), Stop> {
        self.world.step();
        let disabled = |kind: EventKind| match kind {
            EventKind::EntityDisabled { robot, reason } => Some(format!("robot {robot:?}: {reason}")),
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

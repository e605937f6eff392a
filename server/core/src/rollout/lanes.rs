//! Copies of a batch in lanes: if a world has one movable robot that meets only planes, several of its copies
//! step at once.
//!
//! Each copy has a separate world. It starts there, and returns there for everything that lanes cannot do. In
//! between its state is only in its lane: target values are written there, and joints are read there. A step
//! without reads therefore costs a copy nothing beyond the step of all lanes. See
//! [`lanes`](crate::dynamics::lanes) for why this changes no bit.

use pulp::{Simd, WithSimd};

use super::Rollout;
use super::batch::Worker;
use super::controls::CopyStep;
use super::open_batch::{BatchResult, Ended, OpenBatch, Running, Stop, part};
use super::schedule::{Halt, Schedule};
use crate::collision::RobotFeet;
use crate::dynamics::lane::vectorized;
use crate::dynamics::lanes::LaneRobot;
use crate::simulation::{Error, PhysicsSettings};

/// Maximum number of steps before a copy that lanes refused is offered to them again. Entering and leaving
/// costs about half a step, and successive steps of one world are in the processor's caches.
const LONGEST_PAUSE: u64 = 32;

/// Copies of a batch, to be advanced with the vectors of the processor.
struct Batch<'a> {
    rollout: &'a Rollout,
    worker: &'a mut Worker,
    open: &'a mut OpenBatch,
    schedule: &'a dyn Schedule,
}

impl WithSimd for Batch<'_> {
    type Output = Result<(), Halt>;

    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { rollout, worker, open, schedule } = self;
        rollout.advance_in_lanes(simd, worker, open, schedule)
    }
}

/// Copies that step at once, one in each lane.
struct Group<'a, S: Simd> {
    rollout: &'a Rollout,
    lanes: LaneRobot<S>,
    /// Robot that moves.
    robot: usize,
    /// Its contacts with planes and its other shapes that may touch them, if it has feet that lanes can take.
    feet: Option<RobotFeet>,
    /// Whether controls change only target values after the first step: each belongs to that robot, and no
    /// joint has two.
    changes_numbers_alone: bool,
    workers: &'a mut [Worker],
    copies: Vec<Running>,
}

impl Rollout {
    /// Advances copies with the vectors of the processor.
    pub(super) fn advance_with_vectors(
        &self,
        worker: &mut Worker,
        open: &mut OpenBatch,
        schedule: &dyn Schedule,
    ) -> Result<(), Halt> {
        let most = if self.has_four_lanes { 4 } else { usize::MAX };
        match vectorized(most, Batch { rollout: self, worker, open, schedule }) {
            Ok(advanced) => advanced,
            Err(Batch { worker, open, .. }) => self.advance_alone(worker, open, schedule),
        }
    }

    /// Advances copies with these vectors, one in each lane at a time.
    pub(super) fn advance_in_lanes<S: Simd>(
        &self,
        simd: S,
        worker: &mut Worker,
        open: &mut OpenBatch,
        schedule: &dyn Schedule,
    ) -> Result<(), Halt> {
        let mut workers = std::mem::take(&mut worker.beside);
        let advanced = self.advance_groups(simd, &mut workers, open, schedule);
        worker.beside = workers;
        advanced
    }

    fn advance_groups<S: Simd>(
        &self,
        simd: S,
        workers: &mut Vec<Worker>,
        open: &mut OpenBatch,
        schedule: &dyn Schedule,
    ) -> Result<(), Halt> {
        loop {
            let copies = open.take_up(S::F64_LANES);
            workers.resize_with(copies.len().max(workers.len()), || self.worker());
            let Some(mut group) = Group::begin(simd, self, workers, copies, open) else { return Ok(()) };
            if let Err(halt) = group.advance(open, schedule) {
                open.paused = group.pause(open.step);
                return Err(halt);
            }
            group.end(&mut open.result)?;
        }
    }

    /// Returns whether the copies are read after `steps` steps.
    fn is_looked_at(&self, steps: u64) -> bool {
        self.is_row(steps) || !self.costs.is_empty()
    }

    /// Returns whether all controls belong to one robot, and no joint has two of them.
    fn drives_each_joint_once(&self, robot: usize) -> bool {
        let mut driven: Vec<usize> = self.controls.iter().flat_map(|control| control.bodies()).collect();
        let count = driven.len();
        driven.sort_unstable();
        driven.dedup();
        driven.len() == count && self.controls.iter().all(|control| control.robot() == robot)
    }
}

impl<'a, S: Simd> Group<'a, S> {
    /// Starts copies, or continues paused ones: each does its next step alone, as after its start. Returns
    /// `None` if there are no copies.
    fn begin(
        simd: S,
        rollout: &'a Rollout,
        workers: &'a mut [Worker],
        mut copies: Vec<Running>,
        open: &mut OpenBatch,
    ) -> Option<Self> {
        if open.step == 0 {
            for (running, worker) in copies.iter_mut().zip(&mut *workers) {
                running.rows = 0;
                match rollout.begin(worker, running.copy) {
                    Ok(()) if rollout.is_row(0) => {
                        worker.look();
                        running.is_seen = true;
                        let mut copy_result = rollout.copy_result(&mut open.result, running.index);
                        rollout.read(worker, &mut running.rows, &mut copy_result);
                    }
                    Ok(()) => {}
                    Err(error) => running.stop = Some((error.into(), 0)),
                }
            }
        }
        let world = &workers.get(..copies.len())?.first()?.world;
        let robot = rollout.lane_robot;
        let PhysicsSettings { gravity, time_step, substeps, integrator, .. } = *world.settings();
        let parts = (time_step / f64::from(substeps), substeps);
        let mut lanes = LaneRobot::new(simd, world.body(robot).tree(), gravity, parts, integrator);
        let feet = world.lane_feet(robot);
        if let Some(feet) = &feet {
            lanes.set_feet(feet.pairs(), feet.guards());
        }
        let changes_numbers_alone = rollout.drives_each_joint_once(robot);
        Some(Self { rollout, lanes, feet, robot, changes_numbers_alone, workers, copies })
    }

    /// Does all remaining steps of the group.
    fn advance(&mut self, open: &mut OpenBatch, schedule: &dyn Schedule) -> Result<(), Halt> {
        while open.step < self.rollout.shape.steps {
            schedule.before_step()?;
            if self.copies.iter().all(|running| running.stop.is_some()) {
                break;
            }
            let step = open.step;
            self.offer(step);
            self.drive(step);
            self.lanes.step();
            let waiting = self.copies.iter().filter(|running| running.waits_for(step)).count();
            let looks = self.rollout.is_looked_at(step + 1);
            if looks || self.lanes.stepped() < waiting {
                self.complete_step(step, looks, &mut open.result, schedule);
            }
            open.step += 1;
        }
        Ok(())
    }

    /// Returns the copies, each with its state in its world, to continue from there. The group has done
    /// `done` steps.
    fn pause(mut self, done: u64) -> Vec<Running> {
        for lane in 0..self.copies.len() {
            self.bring_back(lane, done);
        }
        self.copies
    }

    /// Writes the results of the copies, once they have ended.
    fn end(self, result: &mut BatchResult) -> Result<(), Halt> {
        let Self { rollout: Rollout { shape, .. }, lanes, copies, .. } = self;
        for (lane, Running { copy, index, entered, lane_steps, stop, .. }) in copies.into_iter().enumerate() {
            let done = stop.as_ref().map_or(shape.steps, |(_, done)| *done);
            let last_in_lane = if lanes.has(lane) { done.saturating_sub(entered) } else { 0 };
            result.lane_steps += lane_steps + last_in_lane;
            result.steps_done[index] = done;
            match stop {
                None => {}
                Some((Stop::Halted(halt), _)) => return Err(halt),
                Some((Stop::Ended(reason), _)) => {
                    part(&mut result.costs, index, shape.terms).fill(f64::INFINITY);
                    result.ended.push(Ended { copy, reason });
                }
            }
        }
        Ok(())
    }

    /// Stops a copy after `done` steps.
    fn stop(&mut self, lane: usize, why: Stop, done: u64) {
        self.release(lane, done);
        self.copies[lane].stop = Some((why, done));
    }

    /// Moves a copy that has done `done` steps into its lane, if lanes can do its next step.
    fn take(&mut self, lane: usize, done: u64) {
        let world = &self.workers[lane].world;
        let surfaces = self.feet.as_ref().map_or(Some(Vec::new()), |feet| world.lane_surfaces(feet));
        let contacts = (world.lane_contacts(), surfaces.as_deref());
        if self.lanes.take(lane, world.body(self.robot)) && self.lanes.take_contacts(lane, contacts) {
            self.copies[lane].entered = done;
        }
    }

    /// Removes a copy that has done `done` steps from its lane.
    fn release(&mut self, lane: usize, done: u64) {
        if self.lanes.has(lane) {
            let running = &mut self.copies[lane];
            running.lane_steps += done.saturating_sub(running.entered);
            self.lanes.release(lane);
        }
    }

    /// Copies the state of a copy in a lane, after `done` steps, to its world.
    fn bring_back(&mut self, lane: usize, done: u64) {
        if self.lanes.has(lane) {
            let begun = self.rollout.state.at.step + done;
            self.workers[lane].bring_back(&self.lanes, (lane, self.robot), begun);
            self.release(lane, done);
        }
    }

    /// Moves copies that have stepped alone up to here into their lanes, if possible.
    fn offer(&mut self, step: u64) {
        for lane in 0..self.copies.len() {
            let (running, world) = (&self.copies[lane], &self.workers[lane].world);
            let has_stepped_alone = step > 0 && running.done == step && running.stop.is_none();
            if !has_stepped_alone || world.lane_robot() != Some(self.robot) {
                continue;
            }
            let clearance = world.lane_clearance(self.robot, self.feet.is_some());
            if clearance.around.min(clearance.own) > clearance.slack {
                self.lanes.set_clearance(lane, &clearance);
                self.take(lane, step);
            }
        }
    }

    /// Applies the controls and variations that are due before a step.
    fn drive(&mut self, step: u64) {
        let rollout = self.rollout;
        let has_wrench = rollout.variations.iter().any(|variation| variation.applies_wrench_at(step));
        if !has_wrench && !rollout.controls.iter().any(|control| control.drives_at(step)) {
            return;
        }
        for lane in 0..self.copies.len() {
            if self.copies[lane].waits_for(step)
                && let Err(error) = self.drive_copy(lane, step, has_wrench)
            {
                self.stop(lane, error.into(), step);
            }
        }
    }

    fn drive_copy(&mut self, lane: usize, step: u64, has_wrench: bool) -> Result<(), Error> {
        let (rollout, copy) = (self.rollout, self.copies[lane].copy);
        let was_in = self.lanes.has(lane);
        if was_in && !has_wrench && self.changes_numbers_alone {
            for control in &rollout.controls {
                let memory = &mut self.workers[lane].memory;
                control.drive_lane(&mut self.lanes, lane, CopyStep { copy, step }, memory)?;
            }
            return Ok(());
        }
        self.bring_back(lane, step);
        rollout.drive(&mut self.workers[lane], copy, step)?;
        // A copy with an applied wrench steps alone while the wrench acts.
        if was_in && !has_wrench {
            self.take(lane, step);
        }
        Ok(())
    }

    /// Completes a step of all copies, and reads their results.
    fn complete_step(&mut self, step: u64, looks: bool, result: &mut BatchResult, schedule: &dyn Schedule) {
        for lane in 0..self.copies.len() {
            if !self.copies[lane].waits_for(step) {
                continue;
            }
            if !self.lanes.has(lane) || !self.lanes.has_stepped(lane) {
                self.go_on_alone(lane, step, result, schedule);
            } else if looks {
                self.look(lane, step);
                if let Err(why) = self.read(lane, step, result, schedule) {
                    self.stop(lane, why, step + 1);
                }
            }
        }
    }

    /// Updates the view of a copy after a step of its lane.
    fn look(&mut self, lane: usize, step: u64) {
        let (lanes, robot) = (&self.lanes, self.robot);
        let (worker, running) = (&mut self.workers[lane], &mut self.copies[lane]);
        if running.is_seen {
            worker.look_at_lane(lanes, (lane, robot));
        } else {
            worker.bring_back(lanes, (lane, robot), self.rollout.state.at.step + step + 1);
            worker.look();
            running.is_seen = true;
        }
    }

    /// Does a step that lanes did not do in a copy's world, and some steps after it.
    fn go_on_alone(&mut self, lane: usize, first: u64, result: &mut BatchResult, schedule: &dyn Schedule) {
        self.bring_back(lane, first);
        let running = &mut self.copies[lane];
        let pause = if running.done < first { 0 } else { running.pause };
        running.pause = (2 * pause).clamp(1, LONGEST_PAUSE);
        let last = (first + running.pause).min(self.rollout.shape.steps);
        for step in first..last {
            let asked = match step == first {
                // All copies do it before the group can pause.
                true if schedule.is_over() => Err(Halt::Over),
                true => Ok(()),
                false => schedule.before_step(),
            };
            match asked {
                Ok(()) => {}
                Err(Halt::Paused) => return,
                Err(Halt::Over) => return self.stop(lane, Halt::Over.into(), step),
            }
            if let Err((why, done)) = self.step_alone(lane, (step, step == first), result, schedule) {
                return self.stop(lane, why, done);
            }
            self.copies[lane].done = step + 1;
        }
    }

    /// Does a step in a copy's world, which may be driven already. An error comes with the number of steps
    /// done.
    fn step_alone(
        &mut self,
        lane: usize,
        (step, is_driven): (u64, bool),
        result: &mut BatchResult,
        schedule: &dyn Schedule,
    ) -> Result<(), (Stop, u64)> {
        let (worker, running) = (&mut self.workers[lane], &mut self.copies[lane]);
        if !is_driven {
            self.rollout.drive(worker, running.copy, step).map_err(|error| (error.into(), step))?;
        }
        worker.step(schedule).map_err(|why| (why, step))?;
        running.is_seen = self.rollout.is_looked_at(step + 1);
        if running.is_seen {
            worker.look();
            self.read(lane, step, result, schedule).map_err(|why| (why, step + 1))?;
        }
        Ok(())
    }

    /// Reads the results of a copy after a step.
    fn read(
        &mut self,
        lane: usize,
        step: u64,
        result: &mut BatchResult,
        schedule: &dyn Schedule,
    ) -> Result<(), Stop> {
        let (worker, running) = (&mut self.workers[lane], &mut self.copies[lane]);
        let mut copy_result = self.rollout.copy_result(result, running.index);
        if self.rollout.is_row(step + 1) {
            self.rollout.read(worker, &mut running.rows, &mut copy_result);
        }
        self.rollout.weigh(worker, step, &mut copy_result, schedule)
    }
}

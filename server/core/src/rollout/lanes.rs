//! Copies of a batch in lanes: where a world has one robot that moves and meets nothing but planes, several of its copies step at once.
//!
//! Each copy has a world of its own, which is where it begins, and where it is whenever something is to be done that lanes do not
//! do. In between its state is in its lane alone: new numbers of targets are written there, and what is read of its joints is read
//! there, so that a step of which nothing is read costs a copy nothing beside the step of all lanes. See
//! [`lanes`](crate::dynamics::lanes) for why that changes no bit.

use pulp::{Simd, WithSimd};

use super::Rollout;
use super::batch::Worker;
use super::open_batch::{BatchResult, Ended, OpenBatch, Running, Stop, part};
use super::schedule::{Halt, Schedule};
use crate::collision::RobotFeet;
use crate::dynamics::lanes::{LaneRobot, vectorized};
use crate::simulation::{Error, PhysicsSettings};

/// A copy whose steps are none of lanes is offered to them again after so many steps at the latest: to go in and out costs about as
/// much as half a step, and steps of one world in a row find it in the processor's caches.
const LONGEST_PAUSE: u64 = 32;

/// Copies of a batch, to be advanced with the vectors that the processor has.
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

/// Copies that step at once, one a lane.
struct Group<'a, S: Simd> {
    rollout: &'a Rollout,
    lanes: LaneRobot<S>,
    /// The robot that moves.
    robot: usize,
    /// What it touches planes with and what else of it may come to them, where it has feet that lanes take.
    feet: Option<RobotFeet>,
    /// Controls change numbers of targets and nothing else of them after the first step: each is of that robot, and no joint has
    /// two.
    changes_numbers_alone: bool,
    workers: &'a mut [Worker],
    copies: Vec<Running>,
}

impl Rollout {
    /// Advances copies with what the processor has.
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

    /// The same, as many at a time as there are lanes.
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

    /// Whether something is read of the copies after so many steps.
    fn is_looked_at(&self, steps: u64) -> bool {
        self.is_row(steps) || !self.costs.is_empty()
    }

    /// Whether controls are all of one robot, and no joint has two of them.
    fn drives_each_joint_once(&self, robot: usize) -> bool {
        let mut driven: Vec<usize> = self.controls.iter().flat_map(|control| control.bodies()).collect();
        let count = driven.len();
        driven.sort_unstable();
        driven.dedup();
        driven.len() == count && self.controls.iter().all(|control| control.robot() == robot)
    }
}

impl<'a, S: Simd> Group<'a, S> {
    /// Copies at their start, or where they were paused: then each does its next step by itself, as after its start. Nothing where
    /// there are no copies.
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
        let PhysicsSettings { gravity, time_step, substeps, integrator, surface_combination: _, sleeping: _ } =
            *world.settings();
        let parts = (time_step / f64::from(substeps), substeps);
        let mut lanes = LaneRobot::new(simd, world.body(robot).tree(), gravity, parts, integrator);
        let feet = world.lane_feet(robot);
        if let Some(feet) = &feet {
            lanes.set_feet(feet.pairs(), feet.guards());
        }
        let changes_numbers_alone = rollout.drives_each_joint_once(robot);
        Some(Self { rollout, lanes, feet, robot, changes_numbers_alone, workers, copies })
    }

    /// Does all steps that the group has not done.
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

    /// The copies, each with its state in its world, to go on with from there. The group has done so many steps.
    fn pause(mut self, done: u64) -> Vec<Running> {
        for lane in 0..self.copies.len() {
            self.bring_back(lane, done);
        }
        self.copies
    }

    /// Says what became of the copies, once they are at their end.
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

    /// A copy does no more steps than those that it has done.
    fn stop(&mut self, lane: usize, why: Stop, done: u64) {
        self.release(lane, done);
        self.copies[lane].stop = Some((why, done));
    }

    /// Takes a copy that has done so many steps into its lane, if its next step is one of lanes.
    fn take(&mut self, lane: usize, done: u64) {
        let world = &self.workers[lane].world;
        let surfaces = self.feet.as_ref().map_or(Some(Vec::new()), |feet| world.lane_surfaces(feet));
        let contacts = (world.lane_contacts(), surfaces.as_deref());
        if self.lanes.take(lane, world.body(self.robot)) && self.lanes.take_contacts(lane, contacts) {
            self.copies[lane].entered = done;
        }
    }

    /// Frees a lane of a copy that has done so many steps.
    fn release(&mut self, lane: usize, done: u64) {
        if self.lanes.has(lane) {
            let running = &mut self.copies[lane];
            running.lane_steps += done.saturating_sub(running.entered);
            self.lanes.release(lane);
        }
    }

    /// Brings a copy that is in a lane and has done so many steps back to its world.
    fn bring_back(&mut self, lane: usize, done: u64) {
        if self.lanes.has(lane) {
            let begun = self.rollout.state.at.step + done;
            self.workers[lane].bring_back(&self.lanes, (lane, self.robot), begun);
            self.release(lane, done);
        }
    }

    /// Takes copies into their lanes that have stepped by themselves up to here, and can.
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

    /// Gives copies what is due before a step.
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
                control.drive_lane(&mut self.lanes, lane, (copy, step), memory)?;
            }
            return Ok(());
        }
        self.bring_back(lane, step);
        rollout.drive(&mut self.workers[lane], copy, step)?;
        // A copy with an applied wrench steps by itself for as long as it has one.
        if was_in && !has_wrench {
            self.take(lane, step);
        }
        Ok(())
    }

    /// Ends a step of all copies, and reads what is to be read of them.
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

    /// Looks at a copy after a step of its lane.
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

    /// Has a copy's world do a step that lanes did not do, and some after it.
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

    /// Has a copy's world do a step, for which it may be driven already; an error comes with the steps that it has done.
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

    /// Reads of a copy what is to be read after a step.
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

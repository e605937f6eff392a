//! Copies of a batch in lanes: where a world has one robot that moves and meets nothing, several of its copies step at once.
//!
//! Each copy has a world of its own, which is where it begins, and where it is whenever something is to be done that lanes do not
//! do. In between its state is in its lane alone: new numbers of targets are written there, and what is read of its joints is read
//! there, so that a step of which nothing is read costs a copy nothing beside the step of all lanes. See
//! [`lanes`](crate::dynamics::lanes) for why that changes no bit.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::Rollout;
use super::batch::{BatchResult, Ended, Stop, Worker, part};
use super::lane_copy::Running;
use crate::dynamics::lanes::LaneRobot;
use crate::simulation::{Error, PhysicsSettings, Simulation};

/// A copy whose steps are none of lanes is offered to them again after so many steps at the latest: to go in and out costs about as
/// much as half a step, and steps of one world in a row find it in the processor's caches.
const LONGEST_PAUSE: u64 = 32;

/// Copies of a batch, to be advanced with the vectors that the processor has.
struct Batch<'a> {
    rollout: &'a Rollout,
    worker: &'a mut Worker,
    copies: Range<usize>,
    result: &'a mut BatchResult,
    interrupt: &'a dyn Fn() -> bool,
}

impl WithSimd for Batch<'_> {
    type Output = Option<()>;

    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { rollout, worker, copies, result, interrupt } = self;
        if S::F64_LANES > 1 {
            rollout.advance_in_lanes(simd, worker, copies, result, interrupt)
        } else {
            rollout.advance_alone(worker, copies, result, interrupt)
        }
    }
}

/// Vectors of four numbers, where the processor has them.
#[cfg(target_arch = "x86_64")]
fn four_lanes() -> Option<pulp::x86::V3> {
    pulp::x86::V3::try_new()
}

/// The same of other processors.
#[cfg(not(target_arch = "x86_64"))]
fn four_lanes() -> Option<pulp::Scalar> {
    None
}

/// Copies that step at once, one a lane.
struct Group<'a, S: Simd> {
    rollout: &'a Rollout,
    lanes: LaneRobot<S>,
    /// The robot that moves.
    robot: usize,
    /// Controls change numbers of targets and nothing else of them after the first step: each is of that robot, and no joint has
    /// two.
    changes_numbers_alone: bool,
    workers: &'a mut [Worker],
    copies: Vec<Running>,
}

impl Rollout {
    /// Whether copies can be in lanes: of a world that may have them.
    pub(super) fn can_be_in_lanes(&self, world: &Simulation) -> bool {
        world.lane_robot().is_some()
    }

    /// Advances copies with what the processor has; nothing where they are interrupted.
    pub(super) fn advance_with_vectors(
        &self,
        worker: &mut Worker,
        copies: Range<usize>,
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<()> {
        let batch = Batch { rollout: self, worker, copies, result, interrupt };
        if self.has_four_lanes
            && let Some(simd) = four_lanes()
        {
            return Simd::vectorize(simd, batch);
        }
        Arch::new().dispatch(batch)
    }

    /// The same, as many at a time as there are lanes.
    pub(super) fn advance_in_lanes<S: Simd>(
        &self,
        simd: S,
        worker: &mut Worker,
        copies: Range<usize>,
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<()> {
        let mut workers = std::mem::take(&mut worker.beside);
        workers.resize_with(S::F64_LANES.max(workers.len()), || self.worker());
        let mut next = copies.start;
        while next < copies.end {
            let some = next..(next + S::F64_LANES).min(copies.end);
            next = some.end;
            let mut group = Group::begin(simd, self, &mut workers, (some, copies.start), result)?;
            group.advance(result, interrupt)?;
            group.end(result)?;
        }
        worker.beside = workers;
        Some(())
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
    /// Puts copies of a batch, whose first copy is `first`, to where they start.
    fn begin(
        simd: S,
        rollout: &'a Rollout,
        workers: &'a mut [Worker],
        (copies, first): (Range<usize>, usize),
        result: &mut BatchResult,
    ) -> Option<Self> {
        let mut copies: Vec<Running> = copies.map(|copy| Running::new(copy, copy - first)).collect();
        for (running, worker) in copies.iter_mut().zip(&mut *workers) {
            match rollout.begin(worker, running.copy) {
                Ok(()) if rollout.is_row(0) => {
                    worker.look();
                    running.is_seen = true;
                    let mut copy_result = rollout.copy_result(result, running.index);
                    rollout.read(worker, &mut running.rows, &mut copy_result);
                }
                Ok(()) => {}
                Err(error) => running.stop = Some((error.into(), 0)),
            }
        }
        let world = &workers.first()?.world;
        let robot = world.lane_robot().unwrap_or(0);
        let PhysicsSettings { gravity, time_step, substeps, integrator, surface_combination: _ } =
            *world.settings();
        let parts = (time_step / f64::from(substeps), substeps);
        let lanes = LaneRobot::new(simd, world.body(robot).tree(), gravity, parts, integrator);
        let changes_numbers_alone = rollout.drives_each_joint_once(robot);
        Some(Self { rollout, lanes, robot, changes_numbers_alone, workers, copies })
    }

    /// Does all steps; nothing where they are interrupted.
    fn advance(&mut self, result: &mut BatchResult, interrupt: &dyn Fn() -> bool) -> Option<()> {
        for step in 0..self.rollout.shape.steps {
            if interrupt() {
                return None;
            }
            if self.copies.iter().all(|running| running.stop.is_some()) {
                break;
            }
            self.offer(step);
            self.drive(step);
            self.lanes.step();
            let waiting = self.copies.iter().filter(|running| running.waits_for(step)).count();
            let looks = self.rollout.is_looked_at(step + 1);
            if looks || self.lanes.stepped() < waiting {
                self.complete_step(step, looks, result, interrupt);
            }
        }
        Some(())
    }

    /// Says what became of the copies; nothing where they were interrupted.
    fn end(self, result: &mut BatchResult) -> Option<()> {
        let Rollout { shape, .. } = self.rollout;
        for Running { copy, index, stop, .. } in self.copies {
            result.steps_done[index] = stop.as_ref().map_or(shape.steps, |(_, done)| *done);
            match stop {
                None => {}
                Some((Stop::Interrupted, _)) => return None,
                Some((Stop::Ended(reason), _)) => {
                    part(&mut result.costs, index, shape.terms).fill(f64::INFINITY);
                    result.ended.push(Ended { copy, reason });
                }
            }
        }
        Some(())
    }

    /// A copy does no more steps than those that it has done.
    fn stop(&mut self, lane: usize, why: Stop, done: u64) {
        self.copies[lane].stop = Some((why, done));
        self.lanes.release(lane);
    }

    /// Takes copies into their lanes that have stepped by themselves up to here, and can.
    fn offer(&mut self, step: u64) {
        for (lane, running) in self.copies.iter().enumerate() {
            let world = &self.workers[lane].world;
            let has_stepped_alone = step > 0 && running.done == step && running.stop.is_none();
            if !has_stepped_alone || world.lane_robot() != Some(self.robot) {
                continue;
            }
            let clearance = world.lane_clearance(self.robot);
            // Else the next step is none of lanes.
            if clearance.around.min(clearance.own) > clearance.slack {
                self.lanes.set_clearance(lane, &clearance);
                self.lanes.take(lane, world.body(self.robot));
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
        let (rollout, lanes, robot) = (self.rollout, &mut self.lanes, self.robot);
        let (worker, copy) = (&mut self.workers[lane], self.copies[lane].copy);
        let was_in = lanes.has(lane);
        if was_in && !has_wrench && self.changes_numbers_alone {
            for control in &rollout.controls {
                control.drive_lane(lanes, lane, (copy, step), &mut worker.memory)?;
            }
            return Ok(());
        }
        if was_in {
            worker.bring_back(lanes, (lane, robot), rollout.state.at.step + step);
            lanes.release(lane);
        }
        rollout.drive(worker, copy, step)?;
        // A copy with an applied wrench steps by itself for as long as it has one.
        if was_in && !has_wrench {
            lanes.take(lane, worker.world.body(robot));
        }
        Ok(())
    }

    /// Ends a step of all copies, and reads what is to be read of them.
    fn complete_step(
        &mut self,
        step: u64,
        looks: bool,
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) {
        for lane in 0..self.copies.len() {
            if !self.copies[lane].waits_for(step) {
                continue;
            }
            if !self.lanes.has(lane) || !self.lanes.has_stepped(lane) {
                self.go_on_alone(lane, step, result, interrupt);
            } else if looks {
                self.look(lane, step);
                if let Err(error) = self.read(lane, step, result, interrupt) {
                    self.stop(lane, error.into(), step + 1);
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
    fn go_on_alone(
        &mut self,
        lane: usize,
        first: u64,
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) {
        if self.lanes.has(lane) {
            let begun = self.rollout.state.at.step + first;
            self.workers[lane].bring_back(&self.lanes, (lane, self.robot), begun);
            self.lanes.release(lane);
        }
        let running = &mut self.copies[lane];
        let pause = if running.done < first { 0 } else { running.pause };
        running.pause = (2 * pause).clamp(1, LONGEST_PAUSE);
        running.done = (first + running.pause).min(self.rollout.shape.steps);
        for step in first..running.done {
            if let Err((why, done)) = self.step_alone(lane, (step, step == first), result, interrupt) {
                return self.stop(lane, why, done);
            }
        }
    }

    /// Has a copy's world do a step, for which it may be driven already; an error comes with the steps that it has done.
    fn step_alone(
        &mut self,
        lane: usize,
        (step, is_driven): (u64, bool),
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) -> Result<(), (Stop, u64)> {
        let (worker, running) = (&mut self.workers[lane], &mut self.copies[lane]);
        if interrupt() {
            return Err((Stop::Interrupted, step));
        }
        if !is_driven {
            self.rollout.drive(worker, running.copy, step).map_err(|error| (error.into(), step))?;
        }
        worker.step().map_err(|why| (why, step))?;
        // Of contacts a step of lanes changes nothing: those that are seen must be those of this step.
        running.is_seen = self.rollout.is_looked_at(step + 1);
        if running.is_seen {
            worker.look();
            self.read(lane, step, result, interrupt).map_err(|error| (error.into(), step + 1))?;
        }
        Ok(())
    }

    /// Reads of a copy what is to be read after a step.
    fn read(
        &mut self,
        lane: usize,
        step: u64,
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) -> Result<(), Error> {
        let (worker, running) = (&mut self.workers[lane], &mut self.copies[lane]);
        let mut copy_result = self.rollout.copy_result(result, running.index);
        if self.rollout.is_row(step + 1) {
            self.rollout.read(worker, &mut running.rows, &mut copy_result);
        }
        self.rollout.weigh(worker, step, &mut copy_result, interrupt)
    }
}

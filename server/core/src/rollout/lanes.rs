//! Copies of a batch in lanes: where a world has one robot that moves and meets nothing, several of its copies step at once.
//!
//! What a copy is given and what is read of it goes the way of one that is alone: it has a world of its own, which gets its state
//! back where something is to be done that lanes do not do. See [`lanes`](crate::dynamics::lanes) for why that changes no bit.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::Rollout;
use super::batch::{BatchResult, CopyResult, Ended, Stop, Worker, part};
use crate::dynamics::lanes::LaneRobot;
use crate::simulation::{PhysicsSettings, Simulation};

/// A copy whose steps are none of lanes is offered to them again after so many steps at the latest: to go in and out costs about as
/// much as half a step.
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

/// A copy in a group that steps at once.
struct Running {
    copy: usize,
    /// Among those of the batch.
    index: usize,
    /// Rows that are read.
    rows: usize,
    /// Its view has all of its world, but for what a step of lanes changes.
    is_seen: bool,
    /// Steps that it does by itself after one that lanes did not do: the more, the oftener that was.
    pause: u64,
    /// How many of them are left.
    alone: u64,
    /// Why it does no more.
    stop: Option<Stop>,
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
        Arch::new().dispatch(Batch { rollout: self, worker, copies, result, interrupt })
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
        let begun = copies.start;
        let mut first = begun;
        while first < copies.end {
            let group = first..(first + S::F64_LANES).min(copies.end);
            first = group.end;
            let group = group.map(|copy| Running {
                copy,
                index: copy - begun,
                rows: 0,
                is_seen: false,
                pause: 0,
                alone: 0,
                stop: None,
            });
            self.advance_group(simd, &mut workers, group.collect(), result, interrupt)?;
        }
        worker.beside = workers;
        Some(())
    }

    fn advance_group<S: Simd>(
        &self,
        simd: S,
        workers: &mut [Worker],
        mut group: Vec<Running>,
        result: &mut BatchResult,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<()> {
        for (running, worker) in group.iter_mut().zip(&mut *workers) {
            match self.begin(worker, running.copy) {
                Ok(()) if self.is_row(0) => {
                    worker.look();
                    running.is_seen = true;
                    self.read(worker, &mut running.rows, &mut self.copy_result(result, running.index));
                }
                Ok(()) => {}
                Err(error) => running.stop = Some(error.into()),
            }
        }
        let world = &workers.first()?.world;
        let robot = world.lane_robot().unwrap_or(0);
        let PhysicsSettings { gravity, time_step, substeps, integrator, surface_combination: _ } =
            *world.settings();
        let parts = (time_step / f64::from(substeps), substeps);
        let mut lanes = LaneRobot::new(simd, world.body(robot).tree(), gravity, parts, integrator);
        for step in 0..self.shape.steps {
            if interrupt() {
                return None;
            }
            if group.iter().all(|running| running.stop.is_some()) {
                break;
            }
            let is_due = self.controls.iter().any(|control| control.drives_at(step));
            let has_wrench = self.variations.iter().any(|variation| variation.applies_wrench_at(step));
            for (lane, running) in group.iter_mut().enumerate().filter(|(_, running)| running.stop.is_none())
            {
                let worker = &mut workers[lane];
                if has_wrench && lanes.has(lane) {
                    // A copy with an applied wrench steps by itself for as long as it has one.
                    lanes.give_back(lane, worker.world.body_mut(robot));
                    lanes.leave(lane);
                }
                let was_in = lanes.has(lane);
                if !is_due && was_in {
                    continue;
                }
                if was_in {
                    lanes.give_targets(lane, worker.world.body_mut(robot));
                }
                if let Err(error) = self.drive(worker, running.copy, step) {
                    running.stop = Some(error.into());
                    lanes.leave(lane);
                } else if was_in {
                    lanes.take_targets(lane, worker.world.body(robot));
                    if !lanes.has(lane) {
                        lanes.give_back(lane, worker.world.body_mut(robot));
                    }
                }
            }
            lanes.step();
            for (lane, running) in group.iter_mut().enumerate().filter(|(_, running)| running.stop.is_none())
            {
                let worker = &mut workers[lane];
                let done = self.complete_step(&mut lanes, (lane, robot), worker, step, running);
                if done.is_ok() {
                    result.steps_done[running.index] = step + 1;
                }
                let weighed = done.and_then(|()| {
                    if !self.is_looked_at(step + 1) {
                        return Ok(());
                    }
                    let mut copy_result = self.copy_result(result, running.index);
                    if self.is_row(step + 1) {
                        self.read(worker, &mut running.rows, &mut copy_result);
                    }
                    Ok(self.weigh(worker, step, &mut copy_result, interrupt)?)
                });
                if let Err(stop) = weighed {
                    running.stop = Some(stop);
                    lanes.leave(lane);
                }
            }
        }
        for Running { copy, index, stop, .. } in group {
            match stop {
                None => {}
                Some(Stop::Interrupted) => return None,
                Some(Stop::Ended(reason)) => {
                    part(&mut result.costs, index, self.shape.terms).fill(f64::INFINITY);
                    result.ended.push(Ended { copy, reason });
                }
            }
        }
        Some(())
    }

    /// Where a copy's step is none of lanes, has its world do it. Then the worker's view is what is to be read.
    fn complete_step<S: Simd>(
        &self,
        lanes: &mut LaneRobot<S>,
        (lane, robot): (usize, usize),
        worker: &mut Worker,
        step: u64,
        running: &mut Running,
    ) -> Result<(), Stop> {
        let looks = self.is_looked_at(step + 1);
        if lanes.has(lane) && lanes.has_stepped(lane) {
            worker.world.pass_step();
            running.pause = 0;
            if looks && running.is_seen {
                worker.look_at_lane(lanes, (lane, robot));
            } else if looks {
                lanes.give_back(lane, worker.world.body_mut(robot));
                worker.look();
                running.is_seen = true;
            }
            return Ok(());
        }
        if lanes.has(lane) {
            lanes.give_back(lane, worker.world.body_mut(robot));
            running.pause = (2 * running.pause).clamp(1, LONGEST_PAUSE);
            running.alone = running.pause;
        }
        worker.step()?;
        if looks {
            worker.look();
        }
        // Of contacts a step of lanes changes nothing: those that are seen must be those of this step.
        running.is_seen = looks;
        lanes.leave(lane);
        running.alone = running.alone.saturating_sub(1);
        if running.alone == 0 && worker.world.lane_robot() == Some(robot) {
            let clearance = worker.world.lane_clearance(robot);
            // Else the next step is none of lanes.
            if clearance.around.min(clearance.own) > clearance.slack {
                lanes.set_clearance(lane, &clearance);
                lanes.take(lane, worker.world.body(robot));
            }
        }
        Ok(())
    }

    /// Whether something is read of the copies after so many steps.
    fn is_looked_at(&self, steps: u64) -> bool {
        self.is_row(steps) || !self.costs.is_empty()
    }

    /// What a copy writes into the arrays of its batch.
    fn copy_result<'r>(&self, result: &'r mut BatchResult, index: usize) -> CopyResult<'r> {
        let steps = result.step_costs.len() / result.steps_done.len().max(1);
        CopyResult {
            states: part(&mut result.states, index, self.shape.rows * self.shape.columns()),
            costs: part(&mut result.costs, index, self.shape.terms),
            step_costs: part(&mut result.step_costs, index, steps),
        }
    }
}

impl Worker {
    /// Looks at what a step of lanes has changed of a copy.
    fn look_at_lane<S: Simd>(&mut self, lanes: &LaneRobot<S>, (lane, robot): (usize, usize)) {
        let state = &mut self.view.state;
        if let Some((pose, linear, angular)) = lanes.root(lane) {
            let root = &mut state.roots[robot];
            (root.pose, root.linear, root.angular) = (pose, linear, angular);
        }
        let layout = &state.world.entities[robot];
        let (positions, velocities) = (layout.positions.clone(), layout.velocities.clone());
        let joints = positions.zip(velocities).enumerate();
        for (joint, (position, velocity)) in joints {
            [state.positions[position], state.velocities[velocity], state.efforts[velocity]] =
                lanes.joint(lane, joint);
        }
        self.view.changed();
    }
}

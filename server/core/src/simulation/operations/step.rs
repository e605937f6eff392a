//! The step of a world, as the method reads.

mod crowd;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use glamx::DVec3;

use crate::collision::SurfaceCombination;
use crate::dynamics::Integrator;
use crate::dynamics::island::{Island, IslandOutcome, SolverChoice};
use crate::pool::{Interrupt, PIECES, Pool, for_each};
use crate::simulation::constraints::{LinkConstraints, acts};
use crate::simulation::contacts::{Contacts, SearchOptions};
use crate::simulation::entity::Entity;
use crate::simulation::group_memory::GroupMemory;
use crate::simulation::groups::Group;
use crate::simulation::{EventKind, PhysicsSettings, Simulation, StepMemory};

/// Contacts are looked for at least this far from what moves, metres.
const NEAR: f64 = 1e-3;

impl Simulation {
    /// Advances the world by one time step, in as many equal parts as the settings say.
    ///
    /// Each part: poses are updated; contacts are found; a sleeping robot that something awake touches wakes;
    /// each robot takes its actuators' laws and finds its new velocities; a robot without contacts
    /// solves its own constraints, and robots that touch each other are solved together; positions
    /// are integrated; robots at rest fall asleep.
    ///
    /// What concerns a robot alone is done where its poses are updated and where it is solved, and not in turns of its own
    /// through all robots: each such turn would fetch hundreds of robots into the cache once more, on one thread.
    ///
    /// Sensors take the samples that have fallen due, which [`Simulation::take_due_samples`] gives until the next step.
    ///
    /// Allocates nothing once there have been as many contacts at a time as there will be,
    /// except where hulls or cylinders overlap: parry finds their depth by EPA, in memory of its
    /// own.
    pub fn step(&mut self) {
        self.try_step(&|| false);
    }

    /// Has steps use threads beside the one that calls, or none. The state after a step does not depend on that, to the bit.
    /// They are used where there are groups of robots enough to be worth it: a world of one robot has only the calling thread.
    pub fn set_pool(&mut self, pool: Option<Arc<dyn Pool>>) {
        self.pool = pool;
    }

    /// How many robots the last part of a step moved several at once, in vectors of the processor. No number of the state depends on it.
    pub fn robots_at_once(&self) -> usize {
        self.step_memory.groups.at_once()
    }

    /// Has the impulses of contacts found in one way from now on, and measures how exactly they are, for figures of the solver. It is
    /// no part of the state, and takes time and memory in each step.
    pub fn measure_solver(&mut self, choice: SolverChoice) {
        let solvers = &mut self.step_memory.solvers;
        solvers.prepare(PIECES);
        solvers.all().for_each(|solver| solver.island.measure_solver(choice));
    }

    /// The largest residual of the contacts of all steps since this was last asked, m/s: by how much the impulse of a contact would
    /// change its own velocity if it alone were solved once more. `None` where it is not measured, or nothing touched.
    pub fn take_solver_residual(&mut self) -> Option<f64> {
        let solvers = self.step_memory.solvers.all();
        solvers.filter_map(|solver| solver.island.take_residual()).reduce(f64::max)
    }

    /// The same as [`Simulation::step`], given up as soon as `interrupt` says so: then all is as if the step had never begun, to
    /// the bit, and the answer is false. It is asked before each part of the step, each pair of robots that
    /// are near each other, each contact and each constraint that is measured, each constraint that is looked at
    /// where the step may lead to, and each sweep of the solver.
    ///
    /// Costs a copy of the world's state, which is what is gone back to.
    pub fn step_interruptible(&mut self, interrupt: &Interrupt<'_>) -> bool {
        let (state, robots) = self.state();
        let is_whole = self.try_step(interrupt);
        if !is_whole {
            self.go_back(&state, &robots);
        }
        is_whole
    }

    /// False where it was interrupted; then the world is in the midst of a step.
    fn try_step(&mut self, interrupt: &Interrupt<'_>) -> bool {
        let time_step = self.settings.time_step;
        self.step_memory.busy.begin_step(&self.entities);
        for constraint in &mut self.constraints.list {
            if acts(&self.entities, constraint) {
                constraint.begin_step();
            }
        }
        let needs_attention = AtomicBool::new(false);
        let pool = self.pool.clone();
        // The step before says it of what comes before groups are known.
        let is_whole = match pool.as_deref().filter(|_| self.step_memory.groups.are_worth_threads()) {
            Some(threads) => {
                let mut is_whole = false;
                threads.keep_awake(&mut || {
                    is_whole = self.advance_parts(Some(threads), &needs_attention, interrupt);
                });
                is_whole
            }
            None => self.advance_parts(pool.as_deref(), &needs_attention, interrupt),
        };
        if !is_whole {
            return false;
        }
        let mut needs_attention = needs_attention.into_inner();
        // The others have ended the step where they were solved.
        for &robot in self.step_memory.busy.not_solved() {
            needs_attention |= end_step(&mut self.entities[robot], time_step);
        }
        if needs_attention {
            self.disable_not_finite(time_step);
        }
        self.break_constraints();
        self.step_memory.busy.end_step(&self.entities);
        self.now.step += 1;
        // A product instead of a sum: no error gathers over a month.
        let (step, time) = self.time_base;
        self.now.sim_time = time + (self.now.step - step) as f64 * time_step;
        self.take_samples();
        if needs_attention {
            (0..self.entities.len()).for_each(|robot_index| self.report_ended(robot_index));
        }
        true
    }

    /// All parts of a step. False where it was interrupted.
    fn advance_parts(
        &mut self,
        pool: Option<&dyn Pool>,
        needs_attention: &AtomicBool,
        interrupt: &Interrupt<'_>,
    ) -> bool {
        let PhysicsSettings { gravity, time_step, substeps, integrator, surface_combination, sleeping } =
            self.settings;
        let h = time_step / f64::from(substeps);
        (0..substeps).all(|part| {
            let part = Part {
                gravity,
                time_step,
                h,
                integrator,
                surface_combination,
                sleeping,
                done: f64::from(part) / f64::from(substeps),
                begins: part == 0,
                ends: part + 1 == substeps,
                needs_attention,
            };
            let Self { entities, contacts, constraints, step_memory, .. } = self;
            !interrupt() && advance(entities, (contacts, constraints), step_memory, part, pool, interrupt)
        })
    }

    /// Takes robots whose state the step has left not finite out of the simulation.
    fn disable_not_finite(&mut self, time_step: f64) {
        for index in 0..self.step_memory.busy.robots().len() {
            let robot_index = self.step_memory.busy.robots()[index];
            let entity = &mut self.entities[robot_index];
            if entity.is_not_finite() {
                let reason = entity.disable().to_string();
                entity.judge_trajectories(time_step);
                let robot = entity.state.name.clone();
                self.contacts.forget(robot_index);
                self.constraints.forget_step(robot_index);
                self.step_memory.busy.forget();
                self.happened(EventKind::EntityDisabled { robot, reason });
            }
        }
    }
}

/// Ends the step of a robot. Whether the world has something to do for it: it is not finite, or trajectories of it have ended.
fn end_step(robot: &mut Entity, time_step: f64) -> bool {
    robot.end_step(time_step);
    if robot.is_not_finite() {
        // Its trajectories are judged once it is disabled.
        return true;
    }
    robot.judge_trajectories(time_step);
    robot.has_ended_trajectories()
}

/// One of the equal parts of a step.
#[derive(Clone, Copy)]
struct Part<'a> {
    gravity: DVec3,
    /// Of the whole step, seconds.
    time_step: f64,
    /// Of this part, seconds.
    h: f64,
    integrator: Integrator,
    surface_combination: SurfaceCombination,
    /// Bodies at rest fall asleep.
    sleeping: bool,
    /// How much of the step is over, 0 to 1.
    done: f64,
    /// It is the first one.
    begins: bool,
    /// It is the last one.
    ends: bool,
    /// What [`end_step`] says of any robot that was solved. Threads only set it, so that their order does not matter.
    needs_attention: &'a AtomicBool,
}

/// From how near what moves contacts are looked for beside what its motion asks for, metres.
pub(super) fn slack(gravity: DVec3, h: f64) -> f64 {
    NEAR + 2.0 * gravity.length() * h * h
}

/// False where it was interrupted.
fn advance(
    robots: &mut [Entity],
    (contacts, constraints): (&mut Contacts, &mut LinkConstraints),
    StepMemory { solvers, groups, busy }: &mut StepMemory,
    part: Part<'_>,
    pool: Option<&dyn Pool>,
    interrupt: &Interrupt<'_>,
) -> bool {
    // The part before says it for what comes before groups are known.
    let threads = pool.filter(|_| groups.are_worth_threads());
    // One that is alone with its shapes meets nothing, and need not know where they are.
    let others = busy.idle_shaped() + busy.shaped().len() > 1;
    let for_poses = threads.filter(|_| !busy.shaped().is_empty());
    for_each((for_poses, PIECES), (robots, 0), busy.begin_early(), &|robot: &mut Entity| {
        part.begin(robot, others);
    });
    let options =
        SearchOptions { slack: part.slack(), combination: part.surface_combination, begins: part.begins };
    if !contacts.find(robots, busy, &constraints.excluded, options, threads, interrupt) {
        return false;
    }
    if !busy.leaves_some() {
        busy.robots().iter().for_each(|&robot| robots[robot].state.teleported = false);
    }
    let mut gathered = groups.gather(robots, busy, &mut contacts.list, &mut constraints.list);
    let threads = pool.filter(|_| groups.are_worth_threads());
    solvers.prepare(if threads.is_some() { PIECES } else { 1 });
    let memories = &*solvers;
    let is_whole = groups.all(&mut gathered).for_each((threads, PIECES), &|groups| {
        let (thread, tree) = (threads.map_or(0, Pool::thread), groups.tree());
        memories.lend(thread, tree, |memory| part.solve_all(groups, memory, interrupt))
    });
    groups.put_back(gathered);
    solvers.all().for_each(GroupMemory::end_part);
    groups.note_at_once(solvers.all().map(|solver| std::mem::take(&mut solver.at_once)).sum());
    is_whole
}

impl Part<'_> {
    fn slack(self) -> f64 {
        slack(self.gravity, self.h)
    }

    /// Begins the part for a robot: what acts on it and where it is, and where its shapes are, if there are `others`.
    fn begin(self, robot: &mut Entity, others: bool) {
        robot.fetch();
        if self.begins {
            robot.begin_step();
            robot.follow_trajectories(self.time_step);
        }
        if robot.is_active() {
            robot.update_poses(others, self.slack(), self.h);
        }
        // Of a heap thousands are solved together: each would be fetched into the cache once more. Others may step several at once, which
        // starts them.
        robot.is_started = robot.is_free_body() && robot.is_awake();
        if robot.is_started {
            robot.body.start(self.gravity, self.h, self.integrator);
        }
    }

    /// Wakes a group and moves it on, where any of it is awake. False where it was interrupted.
    fn solve(self, mut group: Group<'_, '_>, island: &mut Island, interrupt: &Interrupt<'_>) -> bool {
        if group.wake(self.done) && !self.move_on(&mut group, island, interrupt) {
            return false;
        }
        self.end(&mut group);
        true
    }

    /// Begins the part for those of a group that have not begun it.
    fn begin_late(self, group: &mut Group<'_, '_>) {
        for robot in group.members() {
            if robot.begins_late() {
                self.begin(robot, false);
            }
        }
    }

    /// Ends the step for a group, where the part ends it.
    fn end(self, group: &mut Group<'_, '_>) {
        if self.ends {
            for robot in group.members() {
                if end_step(robot, self.time_step) {
                    self.needs_attention.store(true, Relaxed);
                }
            }
        }
    }

    /// Moves a group on that is awake. False where it was interrupted.
    fn move_on(self, group: &mut Group<'_, '_>, island: &mut Island, interrupt: &Interrupt<'_>) -> bool {
        for robot in group.members().filter(|robot| !robot.is_started) {
            robot.body.start(self.gravity, self.h, self.integrator);
        }
        self.solve_started(group, island, interrupt)
    }

    /// The same of a group whose robots have been started.
    ///
    /// A robot that cannot be computed spoils no other one: it is moved on by itself, and those around it are solved as if it were not
    /// there, in the groups that they are without it.
    fn solve_started(
        self,
        group: &mut Group<'_, '_>,
        island: &mut Island,
        interrupt: &Interrupt<'_>,
    ) -> bool {
        let Self { gravity, h, ends, sleeping, .. } = self;
        let is_sound = group.is_sound();
        if !is_sound && group.robots.len() > 1 {
            return group
                .solve_without_unsound(|mut group| self.solve_started(&mut group, &mut *island, interrupt));
        }
        if !is_sound || group.contacts.is_empty() && group.links.is_empty() {
            self.move_alone(group);
        } else {
            let (indices, contacts, links) = (group.indices, &mut *group.contacts, &mut *group.links);
            match island.solve((&mut *group.robots, indices), contacts, links, (gravity, h), interrupt) {
                IslandOutcome::Solved => {}
                IslandOutcome::Unusable => return self.solve_started(group, island, interrupt),
                IslandOutcome::Interrupted => return false,
            }
            for contact in &mut *group.contacts {
                contact.total += contact.impulse;
            }
        }
        group.rest(h, ends && sleeping, gravity.length());
        true
    }

    /// Moves on what nothing acts on in this part.
    fn move_alone(self, group: &mut Group<'_, '_>) {
        let Self { gravity, h, .. } = self;
        for member in &mut *group.robots {
            member.as_mut().solve_alone(gravity, h);
            member.as_mut().finish(gravity, h);
        }
        group.contacts.iter_mut().for_each(|contact| contact.skip_part());
        group.links.iter_mut().for_each(|link| link.constraint.skip_part());
    }
}

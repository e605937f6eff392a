//! Step of a world.

mod crowd;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use glamx::DVec3;

use crate::collision::SurfaceCombination;
use crate::dynamics::Integrator;
use crate::dynamics::island::{Island, IslandOutcome, SolverChoice};
use crate::pool::{Division, Interrupt, PIECES, Pool, for_each};
use crate::simulation::constraints::{LinkConstraints, acts};
use crate::simulation::contacts::{Contacts, SearchOptions};
use crate::simulation::entity::Entity;
use crate::simulation::group_memory::GroupMemory;
use crate::simulation::groups::Group;
use crate::simulation::{EventKind, PhysicsSettings, Simulation, StepMemory};

/// Minimum distance from moving robots within which contacts are looked for, metres.
const CONTACT_MARGIN: f64 = 1e-3;

impl Simulation {
    /// Advances the world by one time step, in the number of equal parts that the settings say.
    ///
    /// Each part does the following:
    ///
    /// 1. It updates poses and finds contacts.
    /// 2. It wakes sleeping robots that something awake touches.
    /// 3. Each robot determines its actuators' laws and its new velocities.
    /// 4. A robot without contacts solves its own constraints, and robots that touch are solved together.
    /// 5. It integrates positions, and puts robots at rest to sleep.
    ///
    /// Actions on a single robot are done where its poses are updated and where it is solved, and not in
    /// separate passes through all robots. Each pass would fetch hundreds of robots into the cache once more,
    /// on one thread.
    ///
    /// Sensors take the samples that are due. [`Simulation::take_due_samples`] returns them until the next
    /// step.
    ///
    /// Allocates nothing once the largest number of simultaneous contacts has occurred, except if hulls or
    /// cylinders overlap: parry finds their depth by EPA, which allocates.
    pub fn step(&mut self) {
        self.try_step(&|| false);
    }

    /// Sets the threads that steps use in addition to the calling one, or none. The state after a step does
    /// not depend on them, to the bit. They are used if there are enough groups of robots to pay off: a world
    /// of one robot uses only the calling thread.
    pub fn set_pool(&mut self, pool: Option<Arc<dyn Pool>>) {
        self.pool = pool;
    }

    /// Returns the number of robots that the last part of a step moved several at once, in vectors of the
    /// processor. The state does not depend on it.
    pub fn robots_at_once(&self) -> usize {
        self.step_memory.groups.at_once()
    }

    /// Selects the contact solver from now on, and measures its accuracy, for figures of the solver. This is
    /// not part of the state, and takes time and memory in each step.
    pub fn measure_solver(&mut self, choice: SolverChoice) {
        let solvers = &mut self.step_memory.solvers;
        solvers.prepare(PIECES);
        solvers.all().for_each(|solver| solver.island.measure_solver(choice));
    }

    /// Returns the largest residual of the contacts of all steps since the last call, m/s. It is the change
    /// of a contact's velocity if only it were solved once more. Returns `None` if nothing is measured, or
    /// nothing touched.
    pub fn take_solver_residual(&mut self) -> Option<f64> {
        let solvers = self.step_memory.solvers.all();
        solvers.filter_map(|solver| solver.island.take_residual()).reduce(f64::max)
    }

    /// Like [`Simulation::step`], but stops as soon as `interrupt` returns true. The world is then as if the
    /// step had never begun, to the bit, and the result is false.
    ///
    /// Calls `interrupt` before each of these:
    ///
    /// * part of the step, pair of robots near each other, and sweep of the solver;
    /// * contact and constraint that is measured;
    /// * constraint whose errors after the step are computed.
    ///
    /// Costs a copy of the world's state, to restore it.
    pub fn step_interruptible(&mut self, interrupt: &Interrupt<'_>) -> bool {
        let (state, robots) = self.state();
        let is_whole = self.try_step(interrupt);
        if !is_whole {
            self.go_back(&state, &robots);
        }
        is_whole
    }

    /// Does a step. Returns false if interrupted, leaving the world mid-step.
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
        // The previous step decides for the work before groups are known.
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
        // A product instead of a sum: no error accumulates over a month.
        let (step, time) = self.time_base;
        self.now.sim_time = time + (self.now.step - step) as f64 * time_step;
        self.take_samples();
        if needs_attention {
            (0..self.entities.len()).for_each(|robot_index| self.report_ended(robot_index));
        }
        true
    }

    /// Does all parts of a step. Returns false if interrupted.
    fn advance_parts(
        &mut self,
        pool: Option<&dyn Pool>,
        needs_attention: &AtomicBool,
        interrupt: &Interrupt<'_>,
    ) -> bool {
        let PhysicsSettings {
            gravity, time_step, substeps, integrator, surface_combination, sleeping, ..
        } = self.settings;
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

    /// Disables robots whose state is not finite after the step.
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

/// Ends the step of a robot. Returns whether the world must handle it: it is not finite, or trajectories of
/// it have ended.
fn end_step(robot: &mut Entity, time_step: f64) -> bool {
    robot.end_step(time_step);
    if robot.is_not_finite() {
        // Its trajectories are handled once it is disabled.
        return true;
    }
    robot.judge_trajectories(time_step);
    robot.has_ended_trajectories()
}

/// One of the equal parts of a step.
#[derive(Clone, Copy)]
struct Part<'a> {
    gravity: DVec3,
    /// Time step of the whole step, seconds.
    time_step: f64,
    /// Length of this part, seconds.
    h: f64,
    integrator: Integrator,
    surface_combination: SurfaceCombination,
    /// Whether bodies at rest fall asleep.
    sleeping: bool,
    /// Fraction of the step that is over, 0 to 1.
    done: f64,
    /// Whether it is the first part.
    begins: bool,
    /// Whether it is the last part.
    ends: bool,
    /// Whether [`end_step`] returned true for any solved robot. Threads only set it, so that their order does
    /// not matter.
    needs_attention: &'a AtomicBool,
}

/// Returns the distance from moving robots within which contacts are looked for, in addition to the distance
/// for their motion, metres.
pub(super) fn slack(gravity: DVec3, h: f64) -> f64 {
    CONTACT_MARGIN + 2.0 * gravity.length() * h * h
}

/// Does one part of a step. Returns false if interrupted.
fn advance(
    robots: &mut [Entity],
    (contacts, constraints): (&mut Contacts, &mut LinkConstraints),
    StepMemory { solvers, groups, busy }: &mut StepMemory,
    part: Part<'_>,
    pool: Option<&dyn Pool>,
    interrupt: &Interrupt<'_>,
) -> bool {
    // The previous part decides for the work before groups are known.
    let threads = pool.filter(|_| groups.are_worth_threads());
    // A single robot with shapes meets nothing, and its shapes need no poses.
    let others = busy.idle_shaped() + busy.shaped().len() > 1;
    let for_poses = threads.filter(|_| !busy.shaped().is_empty());
    for_each(
        Division { pool: for_poses, pieces: PIECES },
        (robots, 0),
        busy.begin_early(),
        &|robot: &mut Entity| {
            part.begin(robot, others);
        },
    );
    let options = SearchOptions {
        slack: part.slack(),
        combination: part.surface_combination,
        begins: part.begins,
        is_bullets: part.integrator.bullet().is_some(),
    };
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
    let is_whole =
        groups.all(&mut gathered).for_each(Division { pool: threads, pieces: PIECES }, &|groups| {
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

    /// Begins the part for a robot: updates its forces and pose, and the poses of its shapes if there are
    /// `others`.
    fn begin(self, robot: &mut Entity, others: bool) {
        robot.prefetch();
        if self.begins {
            robot.begin_step();
            robot.follow_trajectories(self.time_step);
        }
        if robot.is_active() {
            robot.update_poses(others, self.slack(), (self.integrator, self.h));
        }
        // Thousands of a heap are solved together: each would be fetched into the cache once more. Other
        // robots may step several at once, which starts them.
        robot.is_started = robot.is_free_body() && robot.is_awake();
        if robot.is_started {
            robot.body.start(self.gravity, self.h, self.integrator);
        }
    }

    /// Wakes a group and advances it, if any of it is awake. Returns false if interrupted.
    fn solve(self, mut group: Group<'_, '_>, island: &mut Island, interrupt: &Interrupt<'_>) -> bool {
        if group.wake(self.done) && !self.move_on(&mut group, island, interrupt) {
            return false;
        }
        self.end(&mut group);
        true
    }

    /// Begins the part for the members of a group that have not begun it.
    fn begin_late(self, group: &mut Group<'_, '_>) {
        for robot in group.members() {
            if robot.begins_late() {
                self.begin(robot, false);
            }
        }
    }

    /// Ends the step for a group, if this is the last part.
    fn end(self, group: &mut Group<'_, '_>) {
        if self.ends {
            for robot in group.members() {
                if end_step(robot, self.time_step) {
                    self.needs_attention.store(true, Relaxed);
                }
            }
        }
    }

    /// Advances an awake group. Returns false if interrupted.
    fn move_on(self, group: &mut Group<'_, '_>, island: &mut Island, interrupt: &Interrupt<'_>) -> bool {
        for robot in group.members().filter(|robot| !robot.is_started) {
            robot.body.start(self.gravity, self.h, self.integrator);
        }
        self.solve_started(group, island, interrupt)
    }

    /// Advances a group whose robots have been started.
    ///
    /// A robot that cannot be computed affects no other one: it is advanced alone. The robots around it are
    /// solved as if it did not exist, in the groups that remain without it.
    fn solve_started(
        self,
        group: &mut Group<'_, '_>,
        island: &mut Island,
        interrupt: &Interrupt<'_>,
    ) -> bool {
        let Self { gravity, h, integrator, ends, sleeping, .. } = self;
        let is_sound = group.is_sound();
        if !is_sound && group.robots.len() > 1 {
            return group
                .solve_without_unsound(|mut group| self.solve_started(&mut group, &mut *island, interrupt));
        }
        if !is_sound || group.contacts.is_empty() && group.links.is_empty() {
            self.move_alone(group);
        } else {
            let (indices, contacts, links) = (group.indices, &mut *group.contacts, &mut *group.links);
            let (members, bullet) = ((&mut *group.robots, indices), integrator.bullet());
            match island.solve(members, contacts, links, (gravity, h), bullet, interrupt) {
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

    /// Advances robots on which nothing acts in this part.
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

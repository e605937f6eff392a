//! The step of a world, as the method reads.

use glamx::DVec3;

use crate::dynamics::Integrator;
use crate::simulation::constraints::{LinkConstraints, acts};
use crate::simulation::contacts::Contacts;
use crate::simulation::entity::Entity;
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
    /// Allocates nothing once there have been as many contacts at a time as there will be,
    /// except where hulls or cylinders overlap: parry finds their depth by EPA, in memory of its
    /// own.
    pub fn step(&mut self) {
        self.try_step(&|| false);
    }

    /// The same, given up as soon as `interrupt` says so: then all is as if the step had never begun, to
    /// the bit, and the answer is false. It is asked before each part of the step, each pair of robots that
    /// are near each other, each contact that is measured and each sweep of the solver.
    ///
    /// Costs a copy of the world's state, which is what is gone back to.
    pub fn step_interruptible(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        let (state, robots) = self.state();
        let is_whole = self.try_step(interrupt);
        if !is_whole {
            self.go_back(state, robots);
        }
        is_whole
    }

    /// False where it was interrupted; then the world is in the midst of a step.
    fn try_step(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        let PhysicsSettings { gravity, time_step, substeps, integrator } = self.settings;
        let h = time_step / f64::from(substeps);
        self.step_memory.busy.begin_step(&self.entities);
        for &robot in self.step_memory.busy.robots() {
            self.entities[robot].begin_step();
            self.entities[robot].follow_trajectories(time_step);
        }
        self.contacts.begin_step(&self.entities);
        for constraint in &mut self.constraints.list {
            if acts(&self.entities, constraint) {
                constraint.begin_step();
            }
        }
        for part in 0..substeps {
            let part = Part {
                gravity,
                h,
                integrator,
                done: f64::from(part) / f64::from(substeps),
                ends: part + 1 == substeps,
            };
            let Self { entities, contacts, constraints, step_memory, .. } = self;
            if interrupt() || !advance(entities, (contacts, constraints), step_memory, part, interrupt) {
                return false;
            }
        }
        let mut some_ended = false;
        for place in 0..self.step_memory.busy.robots().len() {
            let robot_index = self.step_memory.busy.robots()[place];
            let entity = &mut self.entities[robot_index];
            if let Some(reason) = entity.end_step(time_step) {
                let (robot, reason) = (entity.state.name.clone(), reason.to_string());
                self.contacts.forget(robot_index);
                self.happened(EventKind::EntityDisabled { robot, reason });
            }
            let entity = &mut self.entities[robot_index];
            entity.judge_trajectories(time_step);
            some_ended |= entity.has_ended_trajectories();
        }
        self.break_constraints();
        self.step_memory.busy.end_step(&self.entities);
        self.now.step += 1;
        // A product instead of a sum: no error gathers over a month.
        let (step, time) = self.time_base;
        self.now.sim_time = time + (self.now.step - step) as f64 * time_step;
        if some_ended {
            (0..self.entities.len()).for_each(|robot_index| self.tell_ended(robot_index));
        }
        true
    }
}

/// One of the equal parts of a step.
#[derive(Clone, Copy)]
struct Part {
    gravity: DVec3,
    /// Seconds.
    h: f64,
    integrator: Integrator,
    /// How much of the step is over, 0 to 1.
    done: f64,
    /// It is the last one.
    ends: bool,
}

/// False where it was interrupted.
fn advance(
    robots: &mut [Entity],
    (contacts, constraints): (&mut Contacts, &mut LinkConstraints),
    StepMemory { island, groups, busy }: &mut StepMemory,
    Part { gravity, h, integrator, done, ends }: Part,
    interrupt: &dyn Fn() -> bool,
) -> bool {
    let slack = NEAR + 2.0 * gravity.length() * h * h;
    // One that is alone with its shapes meets nothing, and need not know where they are.
    let is_shaped = |robot: &&usize| robots[**robot].is_active() && !robots[**robot].colliders.is_empty();
    let shaped = busy.idle_shaped() + busy.robots().iter().filter(is_shaped).count();
    for &robot in busy.robots() {
        let robot = &mut robots[robot];
        if robot.is_active() {
            robot.update_poses(shaped > 1, slack, h);
        }
    }
    if !contacts.find(robots, busy, &constraints.apart, slack, interrupt) {
        return false;
    }
    for &robot in busy.robots() {
        robots[robot].state.teleported = false;
    }
    let constraints = &mut constraints.list;
    groups.gather(robots, busy, &contacts.list, constraints);
    groups.wake(robots, &mut contacts.list, constraints, done);
    for &robot in busy.robots() {
        let robot = &mut robots[robot];
        if robot.is_awake() {
            robot.body.start(gravity, h, integrator);
        }
    }
    for group in (0..groups.len()).map(|group| groups.get(group)) {
        if !robots[group.members[0]].is_awake() {
            continue;
        }
        // A robot with velocities that are not finite is solved alone, so that it does not spoil others.
        let sound = group.members.iter().all(|&member| robots[member].body.new_velocities_are_finite());
        if group.contacts.is_empty() && group.links.is_empty() || !sound {
            for &member in group.members {
                robots[member].body.solve_alone(gravity, h);
                robots[member].body.finish(gravity, h);
            }
        } else {
            let touching = (&mut *contacts.list, group.contacts);
            let linked = (&mut **constraints, group.links);
            if !island.solve(robots, group.members, touching, linked, (gravity, h), interrupt) {
                return false;
            }
        }
        for &robot_index in group.contacts {
            let contact = &mut contacts.list[robot_index];
            contact.total += contact.impulse;
        }
        group.rest(robots, h, ends);
    }
    true
}

//! Robots that a step must visit, and robots that wake with another one.

use super::entity::Entity;
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::link_constraint::LinkConstraint;

/// Robots that a step must visit. These are all of them or, after a step without other events, all except
/// those that no step changes. A town of a thousand houses then costs nothing. Data of the others are kept
/// from that step.
///
/// Data that do not change until the next event are also read here, and not from the robots. Those are in the
/// caches of the threads that solved them last.
#[derive(Debug, Default)]
pub(super) struct Busy {
    /// Robots in order, as all lists are.
    robots: Vec<usize>,
    shaped: Vec<usize>,
    begin_early: Vec<usize>,
    solved: Vec<Solved>,
    not_solved: Vec<usize>,
    /// Number of the other robots with shapes.
    idle_shaped: usize,
    is_known: bool,
}

/// A robot that a step has in a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved {
    pub(super) index: usize,
    /// Number of its degrees of freedom.
    pub(super) velocities: usize,
    /// Whether it sleeps, or may fall asleep if nothing pushes it.
    pub(super) may_sleep: bool,
}

impl Busy {
    /// Discards the lists: something may have happened to any robot.
    pub(super) fn forget(&mut self) {
        self.is_known = false;
    }

    /// Updates the lists before a step.
    pub(super) fn begin_step(&mut self, robots: &[Entity]) {
        if !self.is_known {
            self.robots.clear();
            self.robots.extend(0..robots.len());
            self.idle_shaped = 0;
            self.sort(robots);
        }
    }

    /// Updates the lists after a step, which has placed all shapes.
    pub(super) fn end_step(&mut self, robots: &[Entity]) {
        if !self.is_known {
            self.robots.retain(|&robot| !robots[robot].is_idle());
            let shaped = robots.iter().filter(|robot| robot.is_idle() && !robot.colliders.is_empty());
            self.idle_shaped = shaped.count();
            self.sort(robots);
            self.is_known = true;
        }
    }

    fn sort(&mut self, robots: &[Entity]) {
        let Self { robots: all, shaped, begin_early, solved, not_solved, .. } = self;
        for list in [&mut *shaped, begin_early, not_solved] {
            list.clear();
        }
        solved.clear();
        for &index in &*all {
            let robot = &robots[index];
            if robot.is_active() && !robot.colliders.is_empty() {
                shaped.push(index);
            }
            if !robot.begins_late() {
                begin_early.push(index);
            }
            if robot.is_solved() {
                let may_sleep = robot.state.asleep || robot.is_free_body();
                solved.push(Solved { index, velocities: robot.body.velocities().len(), may_sleep });
            } else {
                not_solved.push(index);
            }
        }
    }

    /// Returns the robots to visit.
    pub(super) fn robots(&self) -> &[usize] {
        &self.robots
    }

    /// Returns those that are active and have shapes.
    pub(super) fn shaped(&self) -> &[usize] {
        &self.shaped
    }

    /// Returns those that begin a step before they are solved.
    pub(super) fn begin_early(&self) -> &[usize] {
        &self.begin_early
    }

    /// Returns those that are in groups.
    pub(super) fn solved(&self) -> &[Solved] {
        &self.solved
    }

    /// Returns those that are in no group.
    pub(super) fn not_solved(&self) -> &[usize] {
        &self.not_solved
    }

    /// Returns whether the lists are unchanged since the last step, and may leave out robots.
    pub(super) fn leaves_some(&self) -> bool {
        self.is_known
    }

    /// Returns the number of the other robots with shapes.
    pub(super) fn idle_shaped(&self) -> usize {
        self.idle_shaped
    }
}

/// Wakes a robot, the robots that it touches or is constrained to, and those that they touch.
pub(super) fn wake_around(
    robots: &mut [Entity],
    contacts: &[Contact],
    constraints: &[LinkConstraint],
    robot_index: usize,
) {
    let mut reached = vec![false; robots.len()];
    reached[robot_index] = true;
    let mut grows = true;
    while grows {
        grows = false;
        let constrained = constraints.iter().filter_map(|of| match of.definition.ends.map(|end| end.link) {
            [Some((a, _)), Some((b, _))] => Some([a, b]),
            _ => None,
        });
        for [a, b] in contacts.iter().map(|contact| contact.robots).chain(constrained) {
            // Immovable robots pass nothing on.
            let passes = |robot: usize| reached[robot] && (robot == robot_index || robots[robot].moves());
            let (from_a, from_b) = (passes(a), passes(b));
            if (from_a && !reached[b]) || (from_b && !reached[a]) {
                (reached[a], reached[b], grows) = (true, true, true);
            }
        }
    }
    for (entity, _) in robots.iter_mut().zip(&reached).filter(|(_, reached)| **reached) {
        entity.wake();
    }
}

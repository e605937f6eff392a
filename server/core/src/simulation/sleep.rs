//! Which robots a step looks at, and which others wake with one that wakes.

use super::entity::Entity;
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::link_constraint::LinkConstraint;

/// Robots that a step looks at: all of them, or after a step in which nothing else happened, all but those that no step
/// changes: a town of a thousand houses costs it nothing. What follows from the others is kept as it was found then.
///
/// What does not change either until something happens, a step reads here and not of the robots: those are in the caches of the threads
/// that solved them last.
#[derive(Debug, Default)]
pub(super) struct Busy {
    /// In their order, as all lists are.
    robots: Vec<usize>,
    shaped: Vec<usize>,
    begin_early: Vec<usize>,
    solved: Vec<Solved>,
    not_solved: Vec<usize>,
    /// How many of the others have shapes.
    idle_shaped: usize,
    is_known: bool,
}

/// A robot that a step has in a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved {
    pub(super) index: usize,
    /// Its degrees of freedom.
    pub(super) velocities: usize,
    /// It sleeps, or is of those that fall asleep where nothing pushes them.
    pub(super) may_sleep: bool,
}

impl Busy {
    /// Something may have happened to any robot.
    pub(super) fn forget(&mut self) {
        self.is_known = false;
    }

    /// Before a step.
    pub(super) fn begin_step(&mut self, robots: &[Entity]) {
        if !self.is_known {
            self.robots.clear();
            self.robots.extend(0..robots.len());
            self.idle_shaped = 0;
            self.sort(robots);
        }
    }

    /// After a step, which has put all shapes where they are.
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

    /// Those that are looked at.
    pub(super) fn robots(&self) -> &[usize] {
        &self.robots
    }

    /// Those of them that take part and have shapes.
    pub(super) fn shaped(&self) -> &[usize] {
        &self.shaped
    }

    /// Those of them that begin a step before they are solved.
    pub(super) fn begin_early(&self) -> &[usize] {
        &self.begin_early
    }

    /// Those of them that are in groups.
    pub(super) fn solved(&self) -> &[Solved] {
        &self.solved
    }

    /// The others of them.
    pub(super) fn not_solved(&self) -> &[usize] {
        &self.not_solved
    }

    /// Whether nothing that these lists have has changed since the last step, and those that are looked at may not be all.
    pub(super) fn leaves_some(&self) -> bool {
        self.is_known
    }

    /// How many of the others have shapes.
    pub(super) fn idle_shaped(&self) -> usize {
        self.idle_shaped
    }
}

/// Wakes what a robot touches or is constrained to, and what that touches, and itself.
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
            // What cannot move passes nothing on.
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

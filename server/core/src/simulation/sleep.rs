//! Which robots a step looks at, and which others wake with one that wakes.

use super::entity::Entity;
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::link_constraint::LinkConstraint;

/// Robots that a step looks at: all of them, or after a step in which nothing else happened, all but those that no step
/// changes: a town of a thousand houses costs it nothing. What follows from the others is kept as it was found then.
#[derive(Debug, Default)]
pub(super) struct Busy {
    /// In their order.
    robots: Vec<usize>,
    /// How many of the others have shapes.
    idle_shaped: usize,
    is_known: bool,
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
        }
    }

    /// After a step, which has put all shapes where they are.
    pub(super) fn end_step(&mut self, robots: &[Entity]) {
        if !self.is_known {
            self.robots.retain(|&robot| !robots[robot].is_idle());
            let shaped = robots.iter().filter(|robot| robot.is_idle() && !robot.colliders.is_empty());
            self.idle_shaped = shaped.count();
            self.is_known = true;
        }
    }

    /// Those that are looked at, in their order.
    pub(super) fn robots(&self) -> &[usize] {
        &self.robots
    }

    /// Whether those are not all.
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

//! The memory of those who solve groups of robots.

use std::sync::Arc;

use super::groups::Group;
use crate::dynamics::Tree;
use crate::dynamics::island::Island;
use crate::dynamics::lanes::{Crowd, crowd};

/// So many of a tree in a row have lanes made for them, and fewer step one after the other.
pub(super) const LEAST: usize = 4;

/// The memory of one who solves groups.
#[derive(Debug, Default)]
pub(super) struct GroupMemory {
    pub(super) island: Island,
    /// What robots of a tree step in.
    pub(super) lanes: Option<(Arc<Tree>, Box<dyn Crowd>)>,
    /// How many robots were in them in this part.
    pub(super) at_once: usize,
    /// A tree that lanes are not for, and how many robots in a row were of it.
    candidate: Option<(Arc<Tree>, usize)>,
}

impl GroupMemory {
    /// Notes that a robot of this tree had no lanes.
    fn miss(&mut self, tree: &Arc<Tree>) {
        match &mut self.candidate {
            Some((known, count)) if Arc::ptr_eq(known, tree) => *count += 1,
            candidate => *candidate = Some((Arc::clone(tree), 1)),
        }
    }

    /// Makes lanes for robots that there are many of, unless those that there are were of use.
    pub(super) fn end_part(&mut self) {
        if self.at_once == 0
            && let Some((tree, count)) = &self.candidate
            && *count >= LEAST
        {
            self.lanes = crowd(tree).map(|lanes| (Arc::clone(tree), lanes));
        }
        self.candidate = None;
    }

    /// Whether a robot can wait for others to step with.
    pub(super) fn takes(&mut self, group: &mut Group<'_, '_>) -> bool {
        let Some((index, robot, contacts)) = group.alone().filter(|(_, robot, _)| robot.is_awake()) else {
            return false;
        };
        let tree = robot.body.tree();
        if tree.bodies.len() == 1 || self.island.is_measured() {
            return false;
        }
        match &mut self.lanes {
            Some((known, lanes)) if Arc::ptr_eq(known, tree) => lanes.has_room(index, contacts),
            _ => {
                self.miss(tree);
                false
            }
        }
    }
}

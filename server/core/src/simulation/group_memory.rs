//! Memory for solving groups of robots, and the choice of robots that step in lanes.

#[expect(clippy::disallowed_types, reason = "it is tried and never waited for")]
use std::sync::Mutex;
use std::sync::{Arc, PoisonError, TryLockError};

use super::groups::Group;
use crate::dynamics::Tree;
use crate::dynamics::island::Island;
use crate::dynamics::lanes::{Crowd, crowd};

/// Minimum number of consecutive robots of a tree for which lanes are made; fewer step alone.
pub(super) const LEAST: usize = 4;

/// Number of parts of steps for which less useful lanes are kept: making others allocates.
const KEPT_FOR: u32 = 1000;

/// Memory for groups that are solved at the same time: each thread has its own. Results do not depend on
/// which one is used.
#[derive(Debug, Default)]
#[expect(clippy::disallowed_types, reason = "it is tried and never waited for")]
pub(super) struct GroupMemories(Vec<Mutex<GroupMemory>>);

impl GroupMemories {
    /// Ensures memory for `count` pieces of work at a time.
    pub(super) fn prepare(&mut self, count: usize) {
        if self.0.len() < count {
            self.0.resize_with(count, Default::default);
        }
    }

    /// Runs work with free memory, preferably the thread's: first memory with lanes for the tree or without
    /// lanes, then any. There is as much memory as pieces of work at a time. If none is free after all,
    /// temporary memory is used, of which nothing is measured.
    pub(super) fn lend<T>(
        &self,
        thread: usize,
        tree: Option<*const Tree>,
        work: impl FnOnce(&mut GroupMemory) -> T,
    ) -> T {
        let (before, after) = self.0.split_at(thread % self.0.len().max(1));
        let free = |any: bool| {
            let all = after.iter().chain(before);
            let open = all.filter_map(|memory| match memory.try_lock() {
                Ok(memory) => Some(memory),
                Err(TryLockError::Poisoned(memory)) => Some(memory.into_inner()),
                Err(TryLockError::WouldBlock) => None,
            });
            let mut open = open.filter(|memory| any || tree.is_none_or(|tree| memory.suits(tree)));
            open.next()
        };
        match free(false).or_else(|| free(true)) {
            Some(mut memory) => work(&mut memory),
            None => work(&mut GroupMemory::default()),
        }
    }

    /// Returns all memories, between parts of steps.
    pub(super) fn all(&mut self) -> impl Iterator<Item = &mut GroupMemory> {
        self.0.iter_mut().map(|memory| memory.get_mut().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Memory for solving groups on one thread.
#[derive(Debug, Default)]
pub(super) struct GroupMemory {
    pub(super) island: Island,
    lanes: Option<TreeLanes>,
    /// Number of robots in lanes in this part.
    pub(super) at_once: usize,
    /// Current run of consecutive robots of a tree.
    run: Run,
    /// Longest such run in this part.
    longest: Run,
    /// Number of parts for which other lanes would have been more useful.
    useless_for: u32,
}

/// Lanes for robots of a tree.
#[derive(Debug)]
struct TreeLanes {
    tree: Arc<Tree>,
    /// Lanes; `None` if lanes cannot take robots of this tree.
    crowd: Option<Box<dyn Crowd>>,
}

#[derive(Debug, Default)]
struct Run {
    tree: Option<Arc<Tree>>,
    robots: usize,
}

impl Run {
    /// Returns whether it belongs to a tree.
    fn is_of(&self, tree: &Arc<Tree>) -> bool {
        self.tree.as_ref().is_some_and(|known| Arc::ptr_eq(known, tree))
    }
}

impl GroupMemory {
    /// Returns the present lanes.
    pub(super) fn lanes(&mut self) -> Option<&mut (dyn Crowd + 'static)> {
        self.lanes.as_mut()?.crowd.as_deref_mut()
    }

    /// Returns whether it has lanes for a tree, or could have.
    fn suits(&self, tree: *const Tree) -> bool {
        self.lanes.as_ref().is_none_or(|known| std::ptr::eq(Arc::as_ptr(&known.tree), tree))
    }

    /// Starts another piece of work, whose robots do not continue the previous run.
    pub(super) fn begin_piece(&mut self) {
        self.run.robots = 0;
    }

    /// Counts a robot that could step with others of its tree.
    fn see(&mut self, tree: &Arc<Tree>) {
        if !self.run.is_of(tree) {
            self.run = Run { tree: Some(Arc::clone(tree)), robots: 0 };
        }
        self.run.robots += 1;
        if self.run.robots > self.longest.robots {
            self.longest.robots = self.run.robots;
            if !self.longest.is_of(tree) {
                self.longest.tree = Some(Arc::clone(tree));
            }
        }
    }

    /// Makes lanes if there are none, or if the present ones have been less useful than others for long.
    pub(super) fn end_part(&mut self) {
        if self.longest.robots >= LEAST
            && let Some(tree) = &self.longest.tree
        {
            let is_known = self.lanes.as_ref().is_some_and(|known| Arc::ptr_eq(&known.tree, tree));
            let is_better = !is_known && self.longest.robots > 2 * self.at_once;
            self.useless_for = if is_better { self.useless_for + 1 } else { 0 };
            if is_better && (self.lanes.is_none() || self.useless_for > KEPT_FOR) {
                self.lanes = Some(TreeLanes { tree: Arc::clone(tree), crowd: crowd(tree, LEAST) });
                self.useless_for = 0;
            }
        }
        self.longest.robots = 0;
    }

    /// Returns whether a robot can wait for others to step with.
    pub(super) fn takes(&mut self, group: &mut Group<'_, '_>) -> bool {
        let Some((index, robot, contacts)) = group.alone().filter(|(_, robot, _)| robot.is_awake()) else {
            return false;
        };
        let tree = robot.body.tree();
        if tree.bodies.len() == 1 || self.island.is_measured() {
            return false;
        }
        self.see(tree);
        match &mut self.lanes {
            Some(TreeLanes { tree: known, crowd: Some(crowd) }) if Arc::ptr_eq(known, tree) => {
                crowd.has_room(index, contacts)
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_of_one_number_have_separate_memory_and_give_it_back() {
        let mut memories = GroupMemories::default();
        memories.prepare(2);
        let place = |memory: &mut GroupMemory| std::ptr::from_mut(memory).addr();
        let [first, second, third] = memories.lend(1, None, |first| {
            let [second, third] = memories
                .lend(1, None, |second| [place(second), memories.lend(1, None, |third| place(third))]);
            [place(first), second, third]
        });
        assert!(first != second && second != third && third != first);
        assert_eq!(memories.lend(1, None, place), first);
        assert_eq!(memories.all().count(), 2, "the third was for once");
    }
}

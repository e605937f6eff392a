//! Solution of the groups in a part of a step. Robots of one tree that touch nothing, or only immovable
//! robots, are solved several at once in [lanes](crate::dynamics::lanes); others one after the other. The
//! bits are equal in both cases.

use super::Part;
use crate::pool::Interrupt;
use crate::simulation::group_memory::{GroupMemory, LEAST};
use crate::simulation::groups::{AT_ONCE, Group, GroupRange};

impl Part<'_> {
    /// Wakes groups and advances them, if any of each is awake. Returns false if interrupted.
    pub(super) fn solve_all(
        self,
        groups: GroupRange<'_, '_>,
        memory: &mut GroupMemory,
        interrupt: &Interrupt<'_>,
    ) -> bool {
        memory.begin_piece();
        if let Some(lanes) = memory.lanes() {
            lanes.begin_step(self.gravity, self.h, self.integrator);
        }
        let width = memory.lanes().map_or(0, |lanes| lanes.width().min(AT_ONCE));
        let mut waiting = [const { None }; AT_ONCE];
        let mut count = 0;
        for mut group in groups {
            self.begin_late(&mut group);
            if self.integrator.bullet().is_some() || !memory.takes(&mut group) {
                if !self.solve(group, &mut memory.island, interrupt) {
                    return false;
                }
                continue;
            }
            waiting[count] = Some(group);
            count += 1;
            if count == width {
                if !self.solve_at_once(&mut waiting[..count], memory, interrupt) {
                    return false;
                }
                count = 0;
            }
        }
        self.solve_at_once(&mut waiting[..count], memory, interrupt)
    }

    /// Wakes and advances groups that wait for each other.
    fn solve_at_once(
        self,
        waiting: &mut [Option<Group<'_, '_>>],
        memory: &mut GroupMemory,
        interrupt: &Interrupt<'_>,
    ) -> bool {
        if interrupt() {
            return false;
        }
        if waiting.len() >= LEAST
            && let Some(lanes) = memory.lanes()
        {
            let mut at_once = 0;
            lanes.clear();
            for (lane, group) in waiting.iter_mut().enumerate() {
                if let Some((index, robot, contacts)) = group.as_mut().and_then(Group::alone) {
                    lanes.take(lane, index, &robot.body, contacts);
                }
            }
            lanes.step();
            for (lane, slot) in waiting.iter_mut().enumerate() {
                let Some(mut group) = slot.take() else { continue };
                let alone = group.alone();
                if alone.is_some_and(|(_, robot, contacts)| lanes.give_back(lane, &mut robot.body, contacts))
                {
                    at_once += 1;
                    group.rest(self.h, self.ends && self.sleeping, self.gravity.length());
                    self.end(&mut group);
                } else {
                    *slot = Some(group);
                }
            }
            memory.at_once += at_once;
        }
        for group in waiting.iter_mut().filter_map(Option::take) {
            if !self.solve(group, &mut memory.island, interrupt) {
                return false;
            }
        }
        true
    }
}

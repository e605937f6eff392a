//! Groups of robots that touch or are constrained to each other: a step solves each group independently,
//! several at the same time.

mod joined;
mod unsound;

use std::sync::Arc;

use glamx::DPose3;

use self::joined::Joined;
use super::constraints::moved;
use super::entity::Entity;
use super::sleep::{Busy, Solved};
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::link_constraint::{ConstraintEnd, LinkConstraint};
use crate::dynamics::island::ActiveConstraint;
use crate::dynamics::{Articulation, Tree};
use crate::pool::Division;

/// Linear speed below which a body may sleep, as a part of the speed that gravity adds in a second: forces
/// that balance leave less.
const STILL_LINEAR: f64 = 1e-7;

/// Minimum of that bound, m/s, for worlds without gravity.
const WEIGHTLESS: f64 = 1e-9;

/// Ratio of the angular to the linear speed below which a body may sleep, 1/m.
const STILL_ANGULAR: f64 = 10.0;

/// Time for which a body must be that slow before it sleeps, seconds.
const STILL_FOR: f64 = 1.0;

/// Size of groups for which waking threads pays off, by [`Groups::are_worth_threads`].
const WORTH_THREADS: usize = 500;

/// Maximum number of robots that step at once.
pub(super) const AT_ONCE: usize = 8;

/// Number of rows of a contact, and about of a constraint.
const ROWS: usize = 3;

/// Movable robots in groups that touch or are constrained; its memory is reused from step to step.
#[derive(Debug, Default)]
pub(super) struct Groups {
    joined: Joined,
    /// Robots by group, then index.
    members: Vec<usize>,
    /// First robot of each contact's group, and the contact's index; in order. Contacts are large, so these
    /// are sorted in their place.
    order: Vec<(usize, usize)>,
    /// Ends of each group among robots, contacts and constraints.
    ends: Vec<Ends>,
    /// Robots; empty except in a step.
    robots: Vec<Member<'static>>,
    contacts: Vec<&'static mut Contact>,
    /// Contacts to be sorted by group; empty except during sorting.
    unsorted: Vec<Option<&'static mut Contact>>,
    links: Vec<ActiveConstraint<'static>>,
    /// Size of all awake groups except the largest: degrees of freedom, and rows.
    beside_largest: usize,
    /// Number of robots that were solved several at once in the last part of a step.
    at_once: usize,
}

/// End of a group among robots, contacts and constraints.
type Ends = [usize; 3];

/// Robot of a group.
#[derive(Debug)]
pub(super) struct Member<'a> {
    solved: Solved,
    robot: &'a mut Entity,
}

impl Member<'_> {
    fn index(&self) -> usize {
        self.solved.index
    }
}

impl AsMut<Articulation> for Member<'_> {
    fn as_mut(&mut self) -> &mut Articulation {
        &mut self.robot.body
    }
}

/// Movable robots and what acts on them, group by group.
pub(super) struct Gathered<'a> {
    robots: Vec<Member<'a>>,
    contacts: Vec<&'a mut Contact>,
    links: Vec<ActiveConstraint<'a>>,
}

/// Consecutive groups.
pub(super) struct GroupRange<'b, 'a> {
    groups: Group<'b, 'a>,
    ends: &'b [Ends],
    /// Start of the first group.
    begin: Ends,
    /// Whether most robots were solved several at once in the last part of a step, and should stay together.
    are_at_once: bool,
}

/// Robots that are solved together.
pub(super) struct Group<'b, 'a> {
    /// Robots in order.
    pub(super) robots: &'b mut [Member<'a>],
    /// Indices of the robots in the world.
    pub(super) indices: &'b [usize],
    /// Contacts that can move one of them, in order.
    pub(super) contacts: &'b mut [&'a mut Contact],
    /// Constraints between links that can move one of them, in order.
    pub(super) links: &'b mut [ActiveConstraint<'a>],
}

impl Groups {
    /// Groups robots that touch or are constrained. Immovable robots connect nothing. Contacts are in the
    /// order of their robots and colliders, which they keep within a group.
    pub(super) fn gather<'a>(
        &mut self,
        robots: &'a mut [Entity],
        busy: &Busy,
        contacts: &'a mut [Contact],
        constraints: &'a mut [LinkConstraint],
    ) -> Gathered<'a> {
        let Self { joined, members, order, .. } = self;
        joined.begin(robots.len());
        order.clear();
        for (index, contact) in contacts.iter().enumerate() {
            order.push((moved_by(contact), index));
            if contact.point.bodies.iter().all(Option::is_some) {
                joined.join(contact.robots);
            }
        }
        for constraint in &*constraints {
            if let Some([Some(a), Some(b)]) = moved(robots, constraint) {
                joined.join([a, b]);
            }
        }
        joined.end();
        order.iter_mut().for_each(|(robot, _)| *robot = joined.first(*robot));
        let mut links: Vec<ActiveConstraint<'a>> = std::mem::take(&mut self.links);
        for (index, constraint) in constraints.iter_mut().enumerate() {
            if let Some(robot) = moved(robots, constraint).and_then(|[a, b]| a.or(b)) {
                let fixed = constraint.definition.ends.map(|end| fixed_pose(robots, end));
                links.push(ActiveConstraint { order: (joined.first(robot), index), constraint, fixed });
            }
        }
        links.sort_unstable_by_key(|link| link.order);
        let mut touching: Vec<&'a mut Contact> = std::mem::take(&mut self.contacts);
        // So that a step does not allocate when groups come out of order for the first time.
        self.unsorted.reserve(contacts.len());
        if order.is_sorted() {
            touching.extend(contacts);
        } else {
            order.sort_unstable();
            let mut unsorted: Vec<Option<&'a mut Contact>> = std::mem::take(&mut self.unsorted);
            unsorted.extend(contacts.iter_mut().map(Some));
            touching.extend(order.iter().filter_map(|&(_, index)| unsorted[index].take()));
            self.unsorted = emptied(unsorted);
        }
        members.clear();
        let mut moving: Vec<Member<'a>> = std::mem::take(&mut self.robots);
        let mut rest = robots.iter_mut();
        let mut next = 0;
        for &solved in busy.solved() {
            let index = solved.index;
            if let Some(robot) = rest.nth(index - next) {
                members.push(index);
                moving.push(Member { solved, robot });
            }
            next = index + 1;
        }
        if joined.is_any() {
            members.sort_unstable_by_key(|&robot| (joined.first(robot), robot));
            moving.sort_unstable_by_key(|member| (joined.first(member.index()), member.index()));
        }
        let gathered = Gathered { robots: moving, contacts: touching, links };
        self.find_ends(&gathered);
        gathered
    }

    fn find_ends(&mut self, Gathered { robots, links, .. }: &Gathered<'_>) {
        let Self { joined, order, ends, beside_largest, .. } = self;
        ends.clear();
        let [mut m, mut c, mut l] = [0; 3];
        let (mut sum, mut largest) = (0, 0);
        let root = |member: &Member<'_>| joined.first(member.index());
        for group in robots.chunk_by(|a, b| root(a) == root(b)) {
            let root = root(&group[0]);
            let [touch, hold] = [c, l];
            m += group.len();
            c += order[c..].iter().take_while(|contact| contact.0 == root).count();
            l += links[l..].iter().take_while(|link| link.order.0 == root).count();
            ends.push([m, c, l]);
            if !group[0].solved.may_sleep || group[0].robot.is_awake() {
                let velocities: usize = group.iter().map(|of| of.solved.velocities).sum();
                let size = velocities + ROWS * (c - touch + l - hold);
                (sum, largest) = (sum + size, largest.max(size));
            }
        }
        *beside_largest = sum - largest;
    }

    /// Returns whether waking threads pays off for the gathered groups: the work outside of the largest group
    /// must take longer than waking.
    pub(super) fn are_worth_threads(&self) -> bool {
        self.beside_largest >= WORTH_THREADS
    }

    /// Stores the number of robots that were solved several at once.
    pub(super) fn note_at_once(&mut self, count: usize) {
        self.at_once = count;
    }

    /// Returns the number of robots that were solved several at once.
    pub(super) fn at_once(&self) -> usize {
        self.at_once
    }

    /// Returns all gathered groups, to be solved.
    pub(super) fn all<'b, 'a>(&'b self, gathered: &'b mut Gathered<'a>) -> GroupRange<'b, 'a> {
        let Gathered { robots, contacts, links } = gathered;
        let groups = Group { robots, indices: &self.members, contacts, links };
        let are_at_once = 2 * self.at_once > self.members.len();
        GroupRange { groups, ends: &self.ends, begin: [0; 3], are_at_once }
    }

    /// Ends the use of the gathered groups, and keeps their memory.
    pub(super) fn put_back(&mut self, Gathered { robots, contacts, links }: Gathered<'_>) {
        (self.robots, self.contacts, self.links) = (emptied(robots), emptied(contacts), emptied(links));
    }
}

/// Returns an empty list for items of another lifetime. std keeps the memory of a list that is collected into
/// one of items of the same layout.
fn emptied<A, B>(mut list: Vec<A>) -> Vec<B> {
    list.clear();
    list.into_iter().filter_map(|_| None).collect()
}

/// Returns the robot whose group a contact belongs to: for a contact with an immovable one, the movable side.
fn moved_by(contact: &Contact) -> usize {
    contact.robots[usize::from(contact.point.bodies[0].is_none())]
}

/// Returns the frame of an end that no step moves; undefined for others.
fn fixed_pose(robots: &[Entity], ConstraintEnd { link, frame }: ConstraintEnd) -> DPose3 {
    let Some((robot, link)) = link else { return frame };
    let body = &robots[robot].body;
    body.base() * body.tree().links[link].body_from_link * frame
}

impl<'a> Group<'_, 'a> {
    /// Returns its robots in order.
    pub(super) fn members(&mut self) -> impl Iterator<Item = &mut Entity> {
        self.robots.iter_mut().map(|member| &mut *member.robot)
    }

    /// Returns its robot with its index in the world and its contacts, if it is the only movable one and no
    /// constraint holds it.
    pub(super) fn alone(&mut self) -> Option<(usize, &mut Entity, &mut [&'a mut Contact])> {
        match (&mut *self.robots, self.links.is_empty()) {
            ([Member { solved, robot }], true) => Some((solved.index, robot, self.contacts)),
            _ => None,
        }
    }

    /// Wakes all robots if one is awake. Returns false if all sleep. The part `done` of the present step, 0
    /// to 1, is over: robots that slept until now were pushed during it as before.
    pub(super) fn wake(&mut self, done: f64) -> bool {
        if self.robots.iter().all(|member| member.robot.is_awake()) {
            return true;
        }
        if !self.robots.iter().any(|member| member.robot.is_awake()) {
            return false;
        }
        let Self { robots, indices, contacts, links } = self;
        let member = |robot: usize| indices.binary_search(&robot).ok().map(|index| &*robots[index].robot);
        let is_awake = |robot: usize| member(robot).is_some_and(Entity::is_awake);
        let moves = |(robot, link): (usize, usize)| {
            member(robot).is_some_and(|it| it.is_awake() && it.body.tree().links[link].body.is_some())
        };
        for contact in &mut **contacts {
            let mut sides = contact.robots.into_iter().zip(contact.point.bodies);
            if !sides.any(|(robot, body)| body.is_some() && is_awake(robot)) {
                contact.total *= done;
            }
        }
        for ActiveConstraint { constraint, .. } in &mut **links {
            if !constraint.definition.ends.iter().filter_map(|end| end.link).any(moves) {
                constraint.reading.force *= done;
                constraint.reading.torque *= done;
            }
        }
        robots.iter_mut().for_each(|member| member.robot.wake());
        true
    }

    /// Counts the time for which each member has been still. Puts the group to sleep when all have been long
    /// enough and the step `ends`: impulses are summed over all parts of a step. Only single free bodies that
    /// lie or hang on something sleep.
    pub(super) fn rest(&mut self, h: f64, ends: bool, gravity: f64) {
        let mut all = ends && !(self.contacts.is_empty() && self.links.is_empty());
        for Member { robot, .. } in &mut *self.robots {
            robot.state.still_for =
                if robot.may_sleep() && is_still(robot, gravity) { robot.state.still_for + h } else { 0.0 };
            all &= robot.state.still_for >= STILL_FOR;
        }
        if all {
            self.robots.iter_mut().for_each(|member| member.robot.fall_asleep());
        }
    }
}

/// Returns whether neither its velocities nor position corrections by constraints move it.
fn is_still(robot: &Entity, gravity: f64) -> bool {
    let most = (STILL_LINEAR * gravity * STILL_FOR).max(WEIGHTLESS);
    let square = |velocities: &[f64]| velocities.iter().map(|velocity| velocity * velocity).sum::<f64>();
    let is_slow = |velocities: &[f64]| {
        square(&velocities[..3]) < most.powi(2) && square(&velocities[3..]) < (STILL_ANGULAR * most).powi(2)
    };
    let (velocities, split) = (robot.body.velocities(), robot.body.split_velocities());
    velocities.len() == 6 && is_slow(velocities) && (split.is_empty() || is_slow(split))
}

impl<'b, 'a> Iterator for GroupRange<'b, 'a> {
    type Item = Group<'b, 'a>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ends.is_empty() {
            return None;
        }
        let rest = self.split_off(1);
        Some(std::mem::replace(self, rest).groups)
    }
}

impl<'b, 'a> GroupRange<'b, 'a> {
    /// Solves groups with `solve`, divided on a pool. Returns false if `solve` does for one of
    /// them; others may then be unsolved.
    pub(super) fn for_each(
        mut self,
        division: Division<'_>,
        solve: &(dyn Fn(GroupRange<'_, 'a>) -> bool + Sync),
    ) -> bool {
        let middle = self.middle();
        if let (Some(pool), 2.., 1..) = (division.pool, division.pieces, middle) {
            let mut after = Some(self.split_off(middle));
            let mut before = Some(self);
            let mut are_whole = [true; 2];
            let [a, b] = &mut are_whole;
            let half = division.half();
            pool.join(&mut || *a = before.take().is_none_or(|of| of.for_each(half, solve)), &mut || {
                *b = after.take().is_none_or(|of| of.for_each(half, solve))
            });
            return are_whole == [true; 2];
        }
        solve(self)
    }

    /// Returns the tree of the first robot.
    pub(super) fn tree(&self) -> Option<*const Tree> {
        self.groups.robots.first().map(|member| Arc::as_ptr(member.robot.body.tree()))
    }

    /// Returns the number of groups that make up about half of the work; 0 if it cannot be divided. If each
    /// group is one robot that is solved with others, as many stay together.
    fn middle(&self) -> usize {
        let size = |ends: &Ends| ends[0] + ends[1] + ends[2];
        let (begin, end) = (size(&self.begin), self.ends.last().map_or(0, size));
        let middle = self.ends.partition_point(|ends| 2 * size(ends) <= begin + end);
        let last = self.ends.len().saturating_sub(1);
        if self.are_at_once {
            let middle = (middle + AT_ONCE / 2) / AT_ONCE * AT_ONCE;
            return if middle > last { last / AT_ONCE * AT_ONCE } else { middle.max(AT_ONCE.min(last)) };
        }
        middle.max(1).min(last)
    }

    /// Keeps `count` groups, and returns the others.
    fn split_off(&mut self, count: usize) -> Self {
        let (kept, others) = self.ends.split_at(count);
        let end = kept.last().copied().unwrap_or(self.begin);
        let [m, c, l] = [0, 1, 2].map(|i| end[i] - self.begin[i]);
        let Group { robots, indices, contacts, links } = &mut self.groups;
        let split = Group {
            robots: cut(robots, m),
            indices: &indices[m..],
            contacts: cut(contacts, c),
            links: cut(links, l),
        };
        *indices = &indices[..m];
        self.ends = kept;
        Self { groups: split, ends: others, begin: end, are_at_once: self.are_at_once }
    }
}

/// Keeps `count` items, and returns the others.
fn cut<'b, T>(items: &mut &'b mut [T], count: usize) -> &'b mut [T] {
    let (kept, others) = std::mem::take(items).split_at_mut(count);
    *items = kept;
    others
}

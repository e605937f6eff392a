//! Groups of robots that touch or are constrained to each other: a step can solve each on its own, at the same time as
//! others.

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
use crate::pool::Pool;

/// Linear speed below which a body may sleep, as a part of what gravity gives it in a second: forces that balance leave less.
const STILL_LINEAR: f64 = 1e-7;

/// The least such bound, m/s, for worlds without gravity.
const WEIGHTLESS: f64 = 1e-9;

/// Angular speed below which a body may sleep, 1/m: its linear bound times this.
const STILL_ANGULAR: f64 = 10.0;

/// Seconds for which a body is that slow before it sleeps.
const STILL_FOR: f64 = 1.0;

/// Threads are worth waking for groups of this size, by [`Groups::are_worth_threads`].
const WORTH_THREADS: usize = 500;

/// Robots that step at once, at the most.
pub(super) const AT_ONCE: usize = 8;

/// Rows of a contact, and about as many of a constraint.
const ROWS: usize = 3;

/// Robots that move, in groups that touch each other or are constrained; kept from step to step for its memory.
#[derive(Debug, Default)]
pub(super) struct Groups {
    joined: Joined,
    /// Robots by group, then index.
    members: Vec<usize>,
    /// Of each contact its group's first robot, and its index; in order. Contacts are large: they are sorted by these.
    order: Vec<(usize, usize)>,
    /// Ends of each group among robots, contacts and constraints.
    ends: Vec<Ends>,
    /// Empty but in a step.
    robots: Vec<Member<'static>>,
    contacts: Vec<&'static mut Contact>,
    /// Contacts that are to be put in their groups' order; empty but where that is done.
    unsorted: Vec<Option<&'static mut Contact>>,
    links: Vec<ActiveConstraint<'static>>,
    /// The size of all groups that are awake but the largest: degrees of freedom, and rows.
    beside_largest: usize,
    /// How many robots were solved several at once in the last part of a step.
    at_once: usize,
}

/// Where a group ends among robots, contacts and constraints.
type Ends = [usize; 3];

/// A robot of a group.
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

/// What moves and what acts on it, each group's after the other's.
pub(super) struct Gathered<'a> {
    robots: Vec<Member<'a>>,
    contacts: Vec<&'a mut Contact>,
    links: Vec<ActiveConstraint<'a>>,
}

/// Groups that follow each other.
pub(super) struct GroupRange<'b, 'a> {
    groups: Group<'b, 'a>,
    ends: &'b [Ends],
    /// Where the first of them begins.
    begin: Ends,
    /// Most robots were solved several at once in the last part of a step, and so are to be kept together.
    are_at_once: bool,
}

/// Robots that are solved together.
pub(super) struct Group<'b, 'a> {
    /// In their order.
    pub(super) robots: &'b mut [Member<'a>],
    /// Their indices in the world.
    pub(super) indices: &'b [usize],
    /// Those that can move one of them, in their order.
    pub(super) contacts: &'b mut [&'a mut Contact],
    /// The same of constraints between links.
    pub(super) links: &'b mut [ActiveConstraint<'a>],
}

impl Groups {
    /// Joins what touches or is constrained. What cannot move joins nothing. Contacts come in the order of their robots and
    /// colliders, which is theirs within a group.
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
        // A step takes no memory where groups come out of order for the first time.
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

    /// Whether threads are worth waking for what was last gathered: what can be done beside the largest group takes
    /// longer than that.
    pub(super) fn are_worth_threads(&self) -> bool {
        self.beside_largest >= WORTH_THREADS
    }

    /// Notes how many of the robots were solved several at once.
    pub(super) fn note_at_once(&mut self, count: usize) {
        self.at_once = count;
    }

    /// How many that were.
    pub(super) fn at_once(&self) -> usize {
        self.at_once
    }

    /// What was gathered, to be solved.
    pub(super) fn all<'b, 'a>(&'b self, gathered: &'b mut Gathered<'a>) -> GroupRange<'b, 'a> {
        let Gathered { robots, contacts, links } = gathered;
        let groups = Group { robots, indices: &self.members, contacts, links };
        let are_at_once = 2 * self.at_once > self.members.len();
        GroupRange { groups, ends: &self.ends, begin: [0; 3], are_at_once }
    }

    /// Ends the use of what was gathered, and keeps its memory.
    pub(super) fn put_back(&mut self, Gathered { robots, contacts, links }: Gathered<'_>) {
        (self.robots, self.contacts, self.links) = (emptied(robots), emptied(contacts), emptied(links));
    }
}

/// A list without items for items of another lifetime: std keeps the memory of a list that is collected into one of
/// items of the same layout.
fn emptied<A, B>(mut list: Vec<A>) -> Vec<B> {
    list.clear();
    list.into_iter().filter_map(|_| None).collect()
}

/// The robot whose group a contact belongs to: of one with what cannot move, the side that can.
fn moved_by(contact: &Contact) -> usize {
    contact.robots[usize::from(contact.point.bodies[0].is_none())]
}

/// Where the frame of an end is that no step moves; of others it means nothing.
fn fixed_pose(robots: &[Entity], ConstraintEnd { link, frame }: ConstraintEnd) -> DPose3 {
    let Some((robot, link)) = link else { return frame };
    let body = &robots[robot].body;
    body.base() * body.tree().links[link].body_from_link * frame
}

impl<'a> Group<'_, 'a> {
    /// Its robots, in their order.
    pub(super) fn members(&mut self) -> impl Iterator<Item = &mut Entity> {
        self.robots.iter_mut().map(|member| &mut *member.robot)
    }

    /// Its robot, the index of that in the world and what it touches, where it is the only one that moves and no constraint holds it.
    pub(super) fn alone(&mut self) -> Option<(usize, &mut Entity, &mut [&'a mut Contact])> {
        match (&mut *self.robots, self.links.is_empty()) {
            ([Member { solved, robot }], true) => Some((solved.index, robot, self.contacts)),
            _ => None,
        }
    }

    /// Wakes all if one is awake; false where all sleep. Of the present step `done`, 0 to 1, is over: what slept until now was
    /// pushed for so long as it was pushed before.
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

    /// Counts for how long each member has been still, and puts the group to sleep when all
    /// have for long enough and the step `ends`: impulses of a step are summed over all of its parts. Only
    /// single free bodies that lie or hang on something sleep.
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

/// Whether neither its velocities move it, nor what constraints put right in its position alone.
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
    /// Has groups solved by `solve`; on a pool, where there is one, in so many pieces. False where `solve` says so of one of them:
    /// then others may not be solved.
    pub(super) fn for_each(
        mut self,
        (pool, pieces): (Option<&dyn Pool>, usize),
        solve: &(dyn Fn(GroupRange<'_, 'a>) -> bool + Sync),
    ) -> bool {
        let middle = self.middle();
        if let (Some(pool), 2.., 1..) = (pool, pieces, middle) {
            let mut after = Some(self.split_off(middle));
            let mut before = Some(self);
            let mut are_whole = [true; 2];
            let [a, b] = &mut are_whole;
            let half = (Some(pool), pieces / 2);
            pool.join(&mut || *a = before.take().is_none_or(|of| of.for_each(half, solve)), &mut || {
                *b = after.take().is_none_or(|of| of.for_each(half, solve))
            });
            return are_whole == [true; 2];
        }
        solve(self)
    }

    /// Which tree the first robot is of.
    pub(super) fn tree(&self) -> Option<*const Tree> {
        self.groups.robots.first().map(|member| Arc::as_ptr(member.robot.body.tree()))
    }

    /// After so many groups about half of the work is done; 0 where it cannot be divided. Where each group is one robot that is solved
    /// with others, as many stay together.
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

    /// Keeps so many groups, and gives the others.
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

/// Keeps so many items, and gives the others.
fn cut<'b, T>(items: &mut &'b mut [T], count: usize) -> &'b mut [T] {
    let (kept, others) = std::mem::take(items).split_at_mut(count);
    *items = kept;
    others
}

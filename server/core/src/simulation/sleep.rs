//! Which robots a step looks at; groups of robots that touch or are constrained, and which of them sleep.

use super::constraints::{acts as constraint_acts, moved};
use super::entity::Entity;
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::link_constraint::LinkConstraint;

/// A body slower than this may fall asleep, m/s.
const STILL_LINEAR: f64 = 5e-4;

/// The same in rad/s.
const STILL_ANGULAR: f64 = 5e-3;

/// After so many seconds.
const STILL_FOR: f64 = 1.0;

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

/// Robots that move, in groups that touch each other or are constrained; kept from step to step for its memory.
#[derive(Debug, Default)]
pub(super) struct Groups {
    /// Of each robot: one on the way to its group's first.
    above: Vec<usize>,
    /// Robots by group, then index.
    members: Vec<usize>,
    /// Contacts by group, then index.
    contacts: Vec<usize>,
    /// Constraints between links by group, then index.
    links: Vec<usize>,
    /// Ends of each group in the three lists.
    ends: Vec<(usize, usize, usize)>,
}

/// Robots that are solved together.
pub(super) struct Group<'a> {
    /// In their order.
    pub(super) members: &'a [usize],
    /// Those that can move one of them, in their order.
    pub(super) contacts: &'a [usize],
    /// The same of constraints between links.
    pub(super) links: &'a [usize],
}

impl Groups {
    /// Joins what touches or is constrained. What cannot move joins nothing.
    pub(super) fn gather(
        &mut self,
        robots: &[Entity],
        busy: &Busy,
        contacts: &[Contact],
        constraints: &[LinkConstraint],
    ) {
        let Self { above, members, contacts: sorted, links, ends } = self;
        above.resize(robots.len(), 0);
        for &robot in busy.robots() {
            above[robot] = robot;
        }
        for contact in contacts {
            if contact.point.bodies.iter().all(Option::is_some) {
                let [a, b] = contact.robots.map(|robot| first(above, robot));
                above[a.max(b)] = a.min(b);
            }
        }
        for constraint in constraints {
            if let Some([Some(a), Some(b)]) = moved(robots, constraint) {
                let [a, b] = [a, b].map(|robot| first(above, robot));
                above[a.max(b)] = a.min(b);
            }
        }
        for &robot in busy.robots() {
            above[robot] = first(above, robot);
        }
        members.clear();
        let moving = |robot: &usize| robots[*robot].is_active() && robots[*robot].moves();
        members.extend(busy.robots().iter().copied().filter(moving));
        members.sort_unstable_by_key(|&robot| (above[robot], robot));
        // Of a contact with what cannot move, the side that can says where it belongs.
        let group = |index: &usize| {
            let contact = &contacts[*index];
            let side = usize::from(contact.point.bodies[0].is_none());
            (above[contact.robots[side]], *index)
        };
        sorted.clear();
        sorted.extend(0..contacts.len());
        sorted.sort_unstable_by_key(group);
        let link_group = |index: &usize| {
            let one = moved(robots, &constraints[*index]).and_then(|[a, b]| a.or(b));
            (one.map(|robot| above[robot]), *index)
        };
        links.clear();
        links.extend((0..constraints.len()).filter(|index| link_group(index).0.is_some()));
        links.sort_unstable_by_key(link_group);
        ends.clear();
        let (mut m, mut c, mut l) = (0, 0, 0);
        while m < members.len() {
            let root = above[members[m]];
            m += members[m..].iter().take_while(|&&robot| above[robot] == root).count();
            c += sorted[c..].iter().take_while(|&&index| group(&index).0 == root).count();
            l += links[l..].iter().take_while(|&&index| link_group(&index).0 == Some(root)).count();
            ends.push((m, c, l));
        }
    }

    /// Wakes each group of which one is awake. Of the present step `done`, 0 to 1, is over: what slept
    /// until now was pushed for so long as it was pushed before.
    pub(super) fn wake(
        &self,
        robots: &mut [Entity],
        contacts: &mut [Contact],
        constraints: &mut [LinkConstraint],
        done: f64,
    ) {
        for group in self.all() {
            if group.members.iter().any(|&robot| robots[robot].is_awake()) {
                for &index in group.contacts {
                    if !acts(robots, &contacts[index]) {
                        contacts[index].total *= done;
                    }
                }
                for &index in group.links {
                    if !constraint_acts(robots, &constraints[index]) {
                        constraints[index].reading.force *= done;
                        constraints[index].reading.torque *= done;
                    }
                }
                group.members.iter().for_each(|&robot| robots[robot].wake());
            }
        }
    }

    fn all(&self) -> impl Iterator<Item = Group<'_>> {
        (0..self.ends.len()).map(|group| self.get(group))
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// One of them.
    pub(super) fn get(&self, group: usize) -> Group<'_> {
        let (m, c, l) = group.checked_sub(1).map_or((0, 0, 0), |before| self.ends[before]);
        let (m_end, c_end, l_end) = self.ends[group];
        Group {
            members: &self.members[m..m_end],
            contacts: &self.contacts[c..c_end],
            links: &self.links[l..l_end],
        }
    }
}

/// Whether a step solves a contact: something that it can move is awake. A box may sleep on the base of an arm
/// that moves.
pub(super) fn acts(robots: &[Entity], contact: &Contact) -> bool {
    let mut sides = contact.robots.into_iter().zip(contact.point.bodies);
    sides.any(|(robot, body)| body.is_some() && robots[robot].is_awake())
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

/// The first robot of a robot's group. Halves the way for the next time.
fn first(above: &mut [usize], mut robot: usize) -> usize {
    while above[robot] != robot {
        above[robot] = above[above[robot]];
        robot = above[robot];
    }
    robot
}

impl Group<'_> {
    /// Counts for how long each member has been still, and puts the group to sleep when all
    /// have for long enough and the step `ends`: impulses of a step are summed over all of its parts. Only
    /// single free bodies that lie or hang on something sleep.
    pub(super) fn rest(&self, robots: &mut [Entity], h: f64, ends: bool) {
        let mut all = ends && !(self.contacts.is_empty() && self.links.is_empty());
        for &member in self.members {
            let robot = &mut robots[member];
            robot.state.still_for =
                if robot.may_sleep() && is_still(robot) { robot.state.still_for + h } else { 0.0 };
            all &= robot.state.still_for >= STILL_FOR;
        }
        if all {
            self.members.iter().for_each(|&member| robots[member].fall_asleep());
        }
    }
}

fn is_still(robot: &Entity) -> bool {
    let square = |velocities: &[f64]| velocities.iter().map(|velocity| velocity * velocity).sum::<f64>();
    match robot.body.velocities() {
        velocities if velocities.len() == 6 => {
            square(&velocities[..3]) < STILL_LINEAR * STILL_LINEAR
                && square(&velocities[3..]) < STILL_ANGULAR * STILL_ANGULAR
        }
        _ => false,
    }
}

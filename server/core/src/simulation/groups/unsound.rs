//! Solution of a group without robots that cannot be solved together with others.

use super::{Group, Joined, Member};
use crate::dynamics::LARGEST_STATE;
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::island::ActiveConstraint;

/// Robots of a group that a contact or a constraint moves, by their index in the group.
type Moved = [Option<usize>; 2];

impl<'a> Group<'_, 'a> {
    /// Returns whether it can be solved unchanged: new velocities are finite and, for several robots, within
    /// [`LARGEST_STATE`].
    pub(in crate::simulation) fn is_sound(&self) -> bool {
        let most = if self.robots.len() > 1 { LARGEST_STATE } else { f64::MAX };
        self.robots.iter().all(|member| member.robot.body.new_velocities_are_within(most))
    }

    /// Calls `solve` with each group that remains without unsound robots, and with each unsound robot alone.
    /// Nothing acts on the latter in this part of a step, not even immovable robots. Returns false if `solve`
    /// does; others may then be unsolved.
    ///
    /// The order of the robots, and of what acts on them, changes.
    pub(in crate::simulation) fn solve_without_unsound(
        &mut self,
        mut solve: impl FnMut(Group<'_, 'a>) -> bool,
    ) -> bool {
        // Allocates. It is rare: most unsound robots are disabled at the end of the step.
        let indices = self.indices;
        let sound = |member: &Member<'_>| member.robot.body.new_velocities_are_within(LARGEST_STATE);
        let are_sound: Vec<bool> = self.robots.iter().map(sound).collect();
        let all: Vec<Moved> =
            self.contacts.iter().map(|contact| moved_by_contact(indices, contact)).collect();
        let all = all
            .into_iter()
            .chain(self.links.iter().map(|link| moved_by_link(&self.robots[..], indices, link)));
        let mut joined = Joined::default();
        joined.begin(self.robots.len());
        for moved in all {
            if let [Some(a), Some(b)] = moved
                && are_sound[a]
                && are_sound[b]
            {
                joined.join([a, b]);
            }
        }
        joined.end();
        // `None` if an unsound robot takes part.
        let leader_of = |moved: Moved| {
            let mut moved = moved.into_iter().flatten();
            let is_whole = moved.clone().all(|robot| are_sound[robot]);
            moved.next().filter(|_| is_whole).map(|robot| joined.first(robot))
        };
        let of_contacts = sort_by(self.contacts, |contact| leader_of(moved_by_contact(indices, contact)));
        let robots = &*self.robots;
        let of_links = sort_by(self.links, |link| leader_of(moved_by_link(robots, indices, link)));
        let leader =
            |member: &Member<'_>| indices.binary_search(&member.index()).ok().map(|at| joined.first(at));
        let of_robots = sort_by(self.robots, leader);
        let indices: Vec<usize> = self.robots.iter().map(Member::index).collect();

        let count = |of: &[Option<usize>], leader| of.iter().take_while(|own| **own == leader).count();
        let (mut contact, mut link) = (count(&of_contacts, None), count(&of_links, None));
        let (lost, mut contacts) = self.contacts.split_at_mut(contact);
        lost.iter_mut().for_each(|contact| contact.skip_part());
        let (lost, mut links) = self.links.split_at_mut(link);
        lost.iter_mut().for_each(|link| link.constraint.skip_part());
        let (mut robots, mut begin) = (&mut *self.robots, 0);
        while let Some(&leader) = of_robots.get(begin) {
            let [m, c, l] = [
                count(&of_robots[begin..], leader),
                count(&of_contacts[contact..], leader),
                count(&of_links[link..], leader),
            ];
            let own = &indices[begin..begin + m];
            (begin, contact, link) = (begin + m, contact + c, link + l);
            let group = Group {
                robots: cut_off(&mut robots, m),
                indices: own,
                contacts: cut_off(&mut contacts, c),
                links: cut_off(&mut links, l),
            };
            if !solve(group) {
                return false;
            }
        }
        true
    }
}

fn moved_by_contact(indices: &[usize], contact: &Contact) -> Moved {
    [0, 1].map(|side| {
        contact.point.bodies[side].and_then(|_| indices.binary_search(&contact.robots[side]).ok())
    })
}

/// Returns the robots of a constraint, while they are still in order.
fn moved_by_link(robots: &[Member<'_>], indices: &[usize], link: &ActiveConstraint<'_>) -> Moved {
    link.constraint.definition.ends.map(|end| {
        let (robot, link) = end.link?;
        let index = indices.binary_search(&robot).ok()?;
        robots[index].robot.body.tree().links[link].body.map(|_| index)
    })
}

/// Sorts items by their groups, those without one first, and returns the group of each.
fn sort_by<T>(things: &mut [T], group: impl Fn(&T) -> Option<usize>) -> Vec<Option<usize>> {
    things.sort_by_key(&group);
    things.iter().map(group).collect()
}

/// Removes and returns the first `count` items.
fn cut_off<'b, T>(things: &mut &'b mut [T], count: usize) -> &'b mut [T] {
    let (taken, others) = std::mem::take(things).split_at_mut(count);
    *things = others;
    taken
}

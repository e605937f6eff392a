//! Data that contacts inherit from the previous part of a step: impulses and displacement.

use super::faces::share_loads;
use super::key;
use crate::dynamics::constraint::contact::Contact;

/// Largest displacement on either of the two surfaces at which a point is still the same, metres.
const SAME_POINT: f64 = 0.01;

/// Number of previous contacts that are passed over one by one, since few of them end at a time. Longer runs,
/// as of sleeping robots, are skipped by a search.
const ONE_BY_ONE: usize = 4;

/// Contacts of the previous part, in order.
pub(super) struct PreviousContacts<'a> {
    /// Contacts after the last search.
    contacts: &'a [Contact],
    /// Whether a step begins: sums of impulses then restart.
    begins: bool,
}

impl<'a> PreviousContacts<'a> {
    pub(super) fn new(contacts: &'a [Contact], begins: bool) -> Self {
        Self { contacts, begins }
    }

    /// Copies to new contacts of two robots, in order, the impulses of the nearest old ones of the same
    /// colliders. If a pair had one point and has one, they are the same, however far it rolled.
    ///
    /// `awake` says whether each of the two robots is. If a step begins, sums of impulses are 0. Contacts
    /// that the step does not solve stay unchanged, since no robot that they can move is awake. For example,
    /// a box may sleep on the base of an arm that moves.
    pub(super) fn pass_on(&mut self, list: &mut [Contact], awake: [bool; 2]) {
        let mut start = 0;
        while start < list.len() {
            let this = key(&list[start]);
            let len = list[start..].iter().take_while(|contact| key(contact) == this).count();
            // A search among all would fetch contacts from the whole list.
            let near = self.contacts.iter().take(ONE_BY_ONE).position(|old| key(old) >= this);
            let first = near.unwrap_or_else(|| self.contacts.partition_point(|old| key(old) < this));
            let rest = &self.contacts[first..];
            let (old, rest) = rest.split_at(rest.iter().take_while(|old| key(old) == this).count());
            self.contacts = rest;
            let mut sides = list[start].point.bodies.into_iter().zip(awake);
            let is_solved = sides.any(|(body, awake)| body.is_some() && awake);
            let begins = self.begins && is_solved;
            let single = len == 1 && old.len() == 1;
            let mut taken = 0u64;
            for (index, contact) in list[start..start + len].iter_mut().enumerate() {
                contact.index = index;
                let way = |old: &Contact| {
                    let on = |i: usize| contact.point.on[i].distance_squared(old.point.on[i]);
                    on(0).min(on(1))
                };
                let free = old.iter().take(64).enumerate().filter(|(i, _)| taken >> i & 1 == 0);
                let nearest = free.min_by(|a, b| way(a.1).total_cmp(&way(b.1)));
                let Some((i, known)) = nearest else { continue };
                if single || way(known) < SAME_POINT * SAME_POINT {
                    taken |= 1 << i;
                    contact.warm_start_from(known, begins);
                }
                if single {
                    contact.follow(known);
                }
            }
            share_loads(&mut list[start..start + len], is_solved);
            start += len;
        }
    }
}

#[cfg(test)]
mod tests {
    use glamx::DVec3;

    use super::*;
    use crate::dynamics::contact_point::{ContactPoint, Surface};

    #[test]
    fn a_contact_continues_however_many_before_it_have_ended_and_a_new_one_takes_nothing() {
        let contact = |robot: usize, push: f64| {
            let point = ContactPoint {
                colliders: [0; 2],
                links: [0; 2],
                bodies: [Some(0); 2],
                on: [DVec3::ZERO; 2],
                position: DVec3::ZERO,
                normal: DVec3::Z,
                distance: 0.0,
                surface: Surface::default(),
            };
            Contact { impulse: DVec3::Z * push, ..Contact::new([0, robot], point) }
        };
        // Contacts of robots with even numbers, from 2 on.
        let before: Vec<Contact> = (1..20).map(|half| contact(2 * half, half as f64)).collect();
        let mut previous = PreviousContacts::new(&before, true);
        let robots = [1, 2, 3, 6, 20, 21, 22, 38, 39];
        let known = robots.map(|robot| {
            let mut list = [contact(robot, 0.0)];
            previous.pass_on(&mut list, [true; 2]);
            list[0].impulse.z
        });
        assert_eq!(known, [0.0, 1.0, 0.0, 3.0, 10.0, 0.0, 11.0, 19.0, 0.0]);
    }
}

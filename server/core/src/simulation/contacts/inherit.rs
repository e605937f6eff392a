//! What contacts have of those of the part of a step before: impulses, and the way they have come.

use super::key;
use crate::dynamics::constraint::contact::Contact;

/// A point is the same as before if it has moved on one of the two surfaces by less than this,
/// metres.
const SAME_POINT: f64 = 0.01;

/// The contacts of the part before, in order.
pub(super) struct PreviousContacts<'a> {
    contacts: &'a [Contact],
    /// Where those come that follow what was last looked for.
    next: usize,
    /// A step begins: sums of impulses begin anew.
    begins: bool,
}

impl<'a> PreviousContacts<'a> {
    pub(super) fn new(contacts: &'a [Contact], begins: bool) -> Self {
        Self { contacts, next: 0, begins }
    }

    /// Gives new contacts of two robots the impulses of the nearest old ones of the same colliders. A pair that
    /// had one point and has one is the same, however far it rolled.
    ///
    /// `awake` says whether each of the two robots is. Where a step begins, sums of impulses are 0, but for contacts that the
    /// step does not solve, since nothing that they can move is awake: those stay as they are. A box may sleep on the base of
    /// an arm that moves.
    pub(super) fn pass_on(&mut self, list: &mut [Contact], awake: [bool; 2]) {
        let mut start = 0;
        while start < list.len() {
            let this = key(&list[start]);
            let len = list[start..].iter().take_while(|contact| key(contact) == this).count();
            // What goes on touching is where the last one ended: to look for it would fetch contacts from all over the list.
            let follows = self.contacts.get(self.next).is_some_and(|old| key(old) == this);
            let first =
                if follows { self.next } else { self.contacts.partition_point(|old| key(old) < this) };
            let old = &self.contacts[first..];
            let old = &old[..old.iter().take_while(|old| key(old) == this).count()];
            self.next = first + old.len();
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
                    contact.go_on_from(known, begins);
                }
                if single {
                    contact.follow(known);
                }
            }
            start += len;
        }
    }
}

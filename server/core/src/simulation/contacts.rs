//! The contacts of a world: found anew in each part of a step, and given the impulses that
//! they had in the one before.

use std::hash::Hasher;

use glamx::DVec3;

use super::entity::Entity;
use super::links::check_surface;
use super::sleep::acts;
use super::world_state::ContactState;
use crate::collision::{Broad, Fixed, MOST, Narrow, Side, Touch};
use crate::dynamics::articulation::finite;
use crate::dynamics::constraint::contact::Contact;

/// A point is the same as before if it has moved on one of the two surfaces by less than this,
/// metres.
const SAME_POINT: f64 = 0.01;

/// The contacts of a world, in the order of their robots and colliders.
#[derive(Debug, Default)]
pub(super) struct Contacts {
    pub(super) list: Vec<Contact>,
    before: Vec<Contact>,
    /// Of robots that are near each other and that nothing is sure to part, in order: which of their colliders were put
    /// into each other, and do not touch until they have come apart.
    fixed: Vec<Fixed>,
    fixed_before: Vec<Fixed>,
    broad: Broad,
    narrow: Narrow,
}

/// Places of two robots, the earlier first, and of a collider of each.
pub type Pair = ([usize; 2], [usize; 2]);

/// What orders contacts.
fn key(contact: &Contact) -> Pair {
    (contact.robots, contact.touch.colliders)
}

impl Contacts {
    /// Sums of impulses begin anew, but for contacts of what sleeps: those stay as they are.
    pub(super) fn begin_step(&mut self, robots: &[Entity]) {
        for contact in self.list.iter_mut().filter(|contact| acts(robots, contact)) {
            contact.total = DVec3::ZERO;
        }
    }

    /// Keeps forces as they are where steps and their parts become longer by these factors.
    pub(super) fn stretch(&mut self, step: f64, part: f64) {
        for contact in &mut self.list {
            contact.total *= step;
            contact.impulse *= part;
        }
    }

    /// Finds what touches, of robots whose colliders are in place; false where it was interrupted. Contacts are looked
    /// for at least `slack` metres from what moves.
    ///
    /// Links of one robot, and of two that are fixed to the world, do not touch where one was put into the other since
    /// the last step, until they have come apart. A person loads two arms at the origin, or an arm whose first link
    /// reaches into the table: no motion of their joints ends that, and to push would only make them writhe.
    pub(super) fn find(&mut self, robots: &[Entity], slack: f64, interrupt: &dyn Fn() -> bool) -> bool {
        std::mem::swap(&mut self.list, &mut self.before);
        std::mem::swap(&mut self.fixed, &mut self.fixed_before);
        let Self { list, before, fixed, fixed_before, broad, narrow } = self;
        list.clear();
        fixed.clear();
        let present =
            robots.iter().map(|robot| robot.is_active().then(|| (&robot.colliders, robot.is_awake())));
        let mut known = fixed_before.drain(..).peekable();
        for &pair in broad.pairs(present) {
            if interrupt() {
                return false;
            }
            let [a, b] = pair.map(|robot| &robots[robot]);
            let colliders = [&a.colliders, &b.colliders];
            let found = |touch| {
                list.push(Contact {
                    robots: pair,
                    place: 0,
                    touch,
                    impulse: DVec3::ZERO,
                    total: DVec3::ZERO,
                });
            };
            if pair[0] != pair[1] && !(a.is_fixed() && b.is_fixed()) {
                narrow.between(colliders, found);
                continue;
            }
            // Those that are near each other no more have come apart.
            while known.next_if(|known| known.robots < pair).is_some() {}
            let known = known.next_if(|known| known.robots == pair);
            let mut known = known.unwrap_or_else(|| Fixed::new(pair, Vec::new()));
            narrow.between_fixed(colliders, (a.was_put || b.was_put, slack), &mut known, found);
            fixed.push(known);
        }
        drop(known);
        inherit(list, before);
        // What sleeps has not moved: its contacts are as they were.
        let asleep = |contact: &&Contact| {
            let [a, b] = contact.robots.map(|robot| &robots[robot]);
            a.is_active() && b.is_active() && !a.is_awake() && !b.is_awake()
        };
        list.extend(before.iter().filter(asleep));
        list.sort_unstable_by_key(|contact| (key(contact), contact.place));
        true
    }

    /// Pairs that were put into each other where nothing is sure to push them apart, in order.
    pub(super) fn merged(&self) -> impl Iterator<Item = Pair> + '_ {
        self.fixed.iter().flat_map(|fixed| fixed.merged.iter().map(|&colliders| (fixed.robots, colliders)))
    }

    /// Takes over the contacts of another state, and the pairs that are put into each other in it.
    pub(super) fn replace(&mut self, list: Vec<Contact>, merged: &[Pair]) {
        self.list = list;
        let of = |pairs: &[Pair]| Fixed::new(pairs[0].0, pairs.iter().map(|pair| pair.1).collect());
        self.fixed = merged.chunk_by(|a, b| a.0 == b.0).map(of).collect();
    }

    /// Takes the contacts of a robot out.
    pub(super) fn forget(&mut self, robot: usize) {
        self.list.retain(|contact| !contact.robots.contains(&robot));
        self.fixed.retain(|fixed| !fixed.robots.contains(&robot));
    }

    /// The robot at this place is gone, and those after it have moved up.
    pub(super) fn remove(&mut self, robot: usize) {
        self.forget(robot);
        let touching = self.list.iter_mut().flat_map(|contact| &mut contact.robots);
        for place in touching.chain(self.fixed.iter_mut().flat_map(|fixed| &mut fixed.robots)) {
            *place -= usize::from(*place > robot);
        }
    }

    /// Feeds everything that a step reads to a hasher.
    pub(super) fn hash_into(&self, hasher: &mut impl Hasher) {
        for contact in &self.list {
            let Touch { colliders, on, point, normal, distance, .. } = contact.touch;
            for index in contact.robots.into_iter().chain(colliders) {
                hasher.write_usize(index);
            }
            let vectors = [on[0], on[1], point, normal, contact.impulse];
            for value in vectors.into_iter().flat_map(|vector| vector.to_array()).chain([distance]) {
                hasher.write_u64(value.to_bits());
            }
        }
        for index in self.merged().flat_map(|(robots, colliders)| robots.into_iter().chain(colliders)) {
            hasher.write_usize(index);
        }
    }
}

/// As plain data.
pub(super) fn contact_state(contact: &Contact) -> ContactState {
    let Contact { robots, place: _, touch, impulse, total } = *contact;
    let Touch { colliders, links: _, bodies: _, on, point, normal, distance, surface } = touch;
    ContactState { robots, colliders, on, point, normal, distance, surface, impulse, total }
}

/// From plain data; or what is wrong with it, as a sentence.
pub(super) fn contacts(robots: &[Entity], states: &[ContactState]) -> Result<Vec<Contact>, String> {
    let mut list: Vec<Contact> = Vec::with_capacity(states.len());
    for state in states {
        let ContactState { robots: places, colliders, on, point, normal, distance, surface, impulse, total } =
            *state;
        let sides = sides(robots, (places, colliders))?;
        if sides.iter().all(|side| side.body.is_none()) {
            return Err("a contact is between what cannot move".into());
        }
        let vectors = [on[0], on[1], point, normal, impulse, total];
        let values = vectors.into_iter().flat_map(|vector| vector.to_array()).chain([distance]);
        finite("the contacts have numbers", values)?;
        if (normal.length_squared() - 1.0).abs() > 1e-6 {
            return Err("a contact's normal is not of unit length".into());
        }
        check_surface(&surface)?;
        let (links, bodies) = (sides.map(|side| side.link), sides.map(|side| side.body));
        let touch = Touch { colliders, links, bodies, on, point, normal, distance, surface };
        let mut contact = Contact { robots: places, place: 0, touch, impulse, total };
        if let Some(before) = list.last() {
            if key(before) > key(&contact) {
                return Err("the contacts are not in the order of their robots and colliders".into());
            }
            contact.place = if key(before) == key(&contact) { before.place + 1 } else { 0 };
        }
        if contact.place >= MOST {
            return Err(format!("there are more than {MOST} contacts between two colliders"));
        }
        list.push(contact);
    }
    Ok(list)
}

/// Whether pairs that are put into each other are pairs of these robots, in order.
pub(super) fn check_merged(robots: &[Entity], merged: &[Pair]) -> Result<(), String> {
    if !merged.is_sorted_by(|a, b| a < b) {
        return Err("the pairs that are put into each other are not in order".into());
    }
    merged.iter().try_for_each(|pair| sides(robots, *pair).map(|_sides| ()))
}

/// What the two sides of a pair are.
fn sides(robots: &[Entity], (places, colliders): Pair) -> Result<[Side; 2], String> {
    let side = |i: usize| {
        let robot = robots.get(places[i]).filter(|robot| robot.is_active());
        robot.and_then(|robot| robot.colliders.side(colliders[i]))
    };
    let ordered = places[0] < places[1] || (places[0] == places[1] && colliders[0] < colliders[1]);
    match (side(0), side(1)) {
        (Some(a), Some(b)) if ordered => Ok([a, b]),
        _ => Err(format!("there is no pair of colliders {colliders:?} of the robots at {places:?}")),
    }
}

/// Gives new contacts the impulses of the nearest old ones of the same colliders. A pair that
/// had one point and has one is the same, however far it rolled.
fn inherit(list: &mut [Contact], before: &[Contact]) {
    let mut start = 0;
    while start < list.len() {
        let this = key(&list[start]);
        let len = list[start..].iter().take_while(|contact| key(contact) == this).count();
        let first = before.partition_point(|old| key(old) < this);
        let old = &before[first..];
        let old = &old[..old.iter().take_while(|old| key(old) == this).count()];
        let single = len == 1 && old.len() == 1;
        let mut taken = 0u64;
        for (place, contact) in list[start..start + len].iter_mut().enumerate() {
            contact.place = place;
            let way = |old: &Contact| {
                let on = |i: usize| contact.touch.on[i].distance_squared(old.touch.on[i]);
                on(0).min(on(1))
            };
            let free = old.iter().take(64).enumerate().filter(|(i, _)| taken >> i & 1 == 0);
            let nearest = free.min_by(|a, b| way(a.1).total_cmp(&way(b.1)));
            let Some((i, known)) = nearest else { continue };
            if single || way(known) < SAME_POINT * SAME_POINT {
                taken |= 1 << i;
                (contact.impulse, contact.total) = (known.impulse, known.total);
            }
        }
        start += len;
    }
}

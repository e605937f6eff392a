//! Robots of one tree in one world that touch nothing, or what cannot move: several of them step at once, from contacts that the world
//! has found.

use std::fmt::Debug;
use std::sync::Arc;

use glamx::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::feet::{MOST_FEET, can_be_foot, is_simple};
use super::robot::{LaneRobot, Stepping};
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::island::MANY;
use crate::dynamics::{Articulation, Integrator, Tree};

/// Where robots touch more than there is room for, what there is room for stays so for so many parts of steps: to change it takes memory.
const KEPT_FOR: u32 = 1000;

/// Robots in lanes, for a step or a part of it. Where one cannot be in them it is to do the step by itself, which gives the same bits.
pub trait Crowd: Debug + Send {
    /// How many robots there can be at once.
    fn width(&self) -> usize;

    /// Begins a step, with gravity, of so many seconds.
    fn begin_step(&mut self, gravity: DVec3, h: f64, integrator: Integrator);

    /// Forgets the robots that are in lanes.
    fn clear(&mut self);

    /// Makes room for the contacts of a robot of this index in the world. False where they are none of lanes.
    fn has_room(&mut self, index: usize, contacts: &[&mut Contact]) -> bool;

    /// Takes a robot into a lane. False where it has to step by itself.
    fn take(&mut self, lane: usize, index: usize, robot: &Articulation, contacts: &[&mut Contact]) -> bool;

    /// Advances all that were taken.
    fn step(&mut self);

    /// Gives a robot what has become of it. False where it has to step by itself: then it is as it was.
    fn give_back(&self, lane: usize, robot: &mut Articulation, contacts: &mut [&mut Contact]) -> bool;
}

/// Lanes for robots of a tree, where the processor has vectors and they can be in lanes.
pub fn crowd(tree: &Arc<Tree>) -> Option<Box<dyn Crowd>> {
    Arch::new().dispatch(Make(tree))
}

struct Make<'a>(&'a Arc<Tree>);

impl WithSimd for Make<'_> {
    type Output = Option<Box<dyn Crowd>>;

    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self(tree) = self;
        if S::F64_LANES == 1 || !LaneRobot::<S>::takes(tree) {
            return None;
        }
        let lanes = LaneRobot::new(simd, tree, DVec3::ZERO, (1.0, 1), Integrator::Leapfrog);
        let slots_of_lanes = vec![[0; MOST_FEET]; S::F64_LANES];
        let can_touch = (0..tree.bodies.len()).map(|body| can_be_foot(tree, body)).collect();
        Some(Box::new(Members { lanes, can_touch, slots: Vec::new(), slots_of_lanes, kept_for: 0 }))
    }
}

/// A contact that robots may have, in the order that the contacts of each have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Slot {
    /// Index of the robot that cannot move.
    other: usize,
    /// Index of each one's collider.
    colliders: [usize; 2],
    /// The number of the contact among those of the two colliders.
    number: usize,
    /// Which of the two moves.
    side: usize,
    /// The body that is touched.
    body: usize,
}

#[derive(Debug)]
struct Members<S: Simd> {
    lanes: LaneRobot<S>,
    /// Of each body, whether lanes know contacts of it.
    can_touch: Vec<bool>,
    /// What robots may touch, in order.
    slots: Vec<Slot>,
    /// By lane, of each contact of the robot.
    slots_of_lanes: Vec<[usize; MOST_FEET]>,
    /// For so many steps slots are not forgotten.
    kept_for: u32,
}

/// The slots of contacts of a robot of this index with what cannot move; `None` for what lanes do not know.
fn slots_of<'c>(
    can_touch: &'c [bool],
    index: usize,
    contacts: &'c [&mut Contact],
) -> impl Iterator<Item = Option<Slot>> + 'c {
    let mut number = 0;
    contacts.iter().enumerate().map(move |(at, contact)| {
        let is_of = |before: &Contact| {
            (before.robots, before.point.colliders) == (contact.robots, contact.point.colliders)
        };
        number = if at > 0 && is_of(contacts[at - 1]) { number + 1 } else { 0 };
        let side = usize::from(contact.robots[0] != index);
        let body = contact.point.bodies[side]?;
        let is_fixed = contact.point.bodies[1 - side].is_none();
        let is_known = is_fixed && can_touch[body] && is_simple(&contact.point.surface);
        let colliders = contact.point.colliders;
        is_known.then_some(Slot { other: contact.robots[1 - side], colliders, number, side, body })
    })
}

/// Whether two contacts of a robot are on one body of it.
fn is_on_body_of(a: &Contact, b: &Contact) -> bool {
    let body = |contact: &Contact| contact.point.bodies[0].or(contact.point.bodies[1]);
    body(a) == body(b)
}

impl<S: Simd> Crowd for Members<S> {
    fn width(&self) -> usize {
        S::F64_LANES
    }

    fn begin_step(&mut self, gravity: DVec3, h: f64, integrator: Integrator) {
        self.lanes.stepping = Stepping { gravity, h, parts: 1, integrator };
        self.kept_for = self.kept_for.saturating_sub(1);
    }

    fn clear(&mut self) {
        self.lanes.is_taken = self.lanes.is_taken.same(0.0);
        // They may have other modes from now on.
        self.lanes.modes.fill(None);
    }

    fn has_room(&mut self, index: usize, contacts: &[&mut Contact]) -> bool {
        if contacts.is_empty() {
            return true;
        }
        let on_body_of =
            |contact: &Contact| contacts.iter().filter(|other| is_on_body_of(other, contact)).count();
        let fits = contacts.len() <= MOST_FEET && !self.lanes.tree.fixed_base;
        if !fits || contacts.iter().any(|contact| on_body_of(contact) >= MANY) {
            return false;
        }
        let own = || slots_of(&self.can_touch, index, contacts);
        if own().all(|slot| slot.is_some_and(|slot| self.slots.binary_search(&slot).is_ok())) {
            return true;
        }
        let Some(own) = own().collect::<Option<Vec<Slot>>>() else { return false };
        let mut slots: Vec<Slot> = self.slots.iter().chain(&own).copied().collect();
        slots.sort_unstable();
        slots.dedup();
        if slots.len() > MOST_FEET {
            // Those that others had are given up.
            if self.kept_for > 0 {
                return false;
            }
            self.kept_for = KEPT_FOR;
            slots = own;
        }
        let touched: Vec<(usize, usize)> = slots.iter().map(|slot| (slot.body, slot.side)).collect();
        self.lanes.set_given_contacts(&touched);
        self.slots = slots;
        true
    }

    fn take(&mut self, lane: usize, index: usize, robot: &Articulation, contacts: &[&mut Contact]) -> bool {
        if !self.lanes.take(lane, robot) {
            return false;
        }
        self.lanes.take_no_contacts(lane);
        for (at, slot) in slots_of(&self.can_touch, index, contacts).enumerate() {
            let slot = slot.and_then(|slot| self.slots.binary_search(&slot).ok());
            let Some(slot) = slot else {
                self.lanes.release(lane);
                return false;
            };
            self.slots_of_lanes[lane][at] = slot;
            self.lanes.take_contact(lane, slot, contacts[at]);
        }
        true
    }

    fn step(&mut self) {
        self.lanes.step();
    }

    fn give_back(&self, lane: usize, robot: &mut Articulation, contacts: &mut [&mut Contact]) -> bool {
        if !(self.lanes.has(lane) && self.lanes.has_stepped(lane)) {
            return false;
        }
        self.lanes.give_back(lane, robot);
        for (contact, slot) in contacts.iter_mut().zip(self.slots_of_lanes[lane]) {
            self.lanes.give_contact_back(lane, slot, contact);
        }
        true
    }
}

//! Robots of one tree in one world that touch nothing, or only immovable robots. Several of them step at
//! once, with contacts that the world has found.

use std::fmt::Debug;
use std::sync::Arc;

use glamx::DVec3;
use pulp::{Simd, WithSimd};

use super::clearance::LaneClearance;
use super::feet::{MAX_FEET, MAX_VELOCITIES, can_be_foot, is_simple};
use super::robot::{LaneRobot, Stepping, fits_lanes};
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::island::MANY;
use crate::dynamics::lane::vectorized;
use crate::dynamics::real::Real as _;
use crate::dynamics::{Articulation, Integrator, Tree};

/// Number of parts of steps for which slots of contacts are kept if there is no room for others. Making room
/// allocates.
const KEPT_FOR: u32 = 100;

/// Robots in lanes, for a step or a part of it. A robot that lanes cannot take does the step alone, with the
/// same bits.
pub trait Crowd: Debug + Send {
    /// Returns the maximum number of robots at once.
    fn width(&self) -> usize;

    /// Begins a step of `h` seconds, with gravity.
    fn begin_step(&mut self, gravity: DVec3, h: f64, integrator: Integrator);

    /// Empties all lanes.
    fn clear(&mut self);

    /// Makes room for the contacts of the robot of this index in the world. Returns false if lanes cannot
    /// take them. Robots that had room before may have none afterwards, and are then not taken.
    fn has_room(&mut self, index: usize, contacts: &[&mut Contact]) -> bool;

    /// Copies a robot into a lane. Returns false if it must step alone.
    fn take(&mut self, lane: usize, index: usize, robot: &Articulation, contacts: &[&mut Contact]) -> bool;

    /// Advances all taken robots.
    fn step(&mut self);

    /// Writes the result of a lane to its robot. Returns false if the robot must step alone; it is then
    /// unchanged.
    fn give_back(&self, lane: usize, robot: &mut Articulation, contacts: &mut [&mut Contact]) -> bool;
}

/// Returns lanes for robots of a tree, at least `least` of them. Returns `None` if the processor has no
/// vectors for that, or such robots do not fit lanes.
pub fn crowd(tree: &Arc<Tree>, least: usize) -> Option<Box<dyn Crowd>> {
    vectorized(usize::MAX, Make(tree, least)).ok().flatten()
}

struct Make<'a>(&'a Arc<Tree>, usize);

impl WithSimd for Make<'_> {
    type Output = Option<Box<dyn Crowd>>;

    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self(tree, least) = self;
        let is_small = tree.velocity_count <= MAX_VELOCITIES;
        if S::F64_LANES < least || !is_small || !fits_lanes(tree) {
            return None;
        }
        Some(Box::new(Members {
            lanes: LaneRobot::new(simd, tree, DVec3::ZERO, (1.0, 1), Integrator::Leapfrog),
            can_touch: (0..tree.bodies.len()).map(|body| can_be_foot(tree, body)).collect(),
            touched: Vec::new(),
            slots: vec![[0; MAX_FEET]; S::F64_LANES],
            kept_for: 0,
        }))
    }
}

/// Body of a contact, and which of the two robots it belongs to.
type Touched = (usize, usize);

#[derive(Debug)]
struct Members<S: Simd> {
    lanes: LaneRobot<S>,
    /// Whether lanes can take contacts of each body.
    can_touch: Vec<bool>,
    /// Slots for contacts; each robot's contacts follow this order.
    touched: Vec<Touched>,
    /// Slot of each contact of the robot, by lane.
    slots: Vec<[usize; MAX_FEET]>,
    /// Number of parts of steps for which slots are still kept.
    kept_for: u32,
}

/// Returns the body and the side of a contact that belong to the robot of this index.
fn touched(index: usize, contact: &Contact) -> (Option<usize>, usize) {
    let side = usize::from(contact.robots[0] != index);
    (contact.point.bodies[side], side)
}

/// Returns the next slot of a contact.
fn slot(slots: &[Touched], next: usize, own: Touched) -> Option<usize> {
    slots[next..].iter().position(|slot| *slot == own).map(|at| next + at)
}

impl<S: Simd> Members<S> {
    /// Returns the body and the side of a contact if lanes can take it; `own` are all contacts of its robot.
    fn known(&self, index: usize, own: &[&mut Contact], contact: &Contact) -> Option<Touched> {
        let (body, side) = touched(index, contact);
        let body = body.filter(|body| self.can_touch[*body])?;
        let is_fixed = contact.point.bodies[1 - side].is_none();
        let on_body = own.iter().filter(|other| touched(index, other).0 == Some(body)).count();
        (is_fixed && on_body < MANY && is_simple(&contact.point.surface)).then_some((body, side))
    }
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
        let zero = self.lanes.occupied.splat(0.0);
        self.lanes.occupied = zero;
        // A state that was not finite may have made it NaN.
        self.lanes.clearance = LaneClearance::endless(zero);
        // The robots may have other modes from now on.
        self.lanes.modes.fill(None);
    }

    fn has_room(&mut self, index: usize, contacts: &[&mut Contact]) -> bool {
        if contacts.is_empty() {
            return true;
        }
        let fits = contacts.len() <= MAX_FEET && !self.lanes.tree.fixed_base;
        let (mut next, mut missing) = (0, 0);
        for contact in contacts {
            let Some(own) = self.known(index, contacts, contact).filter(|_| fits) else { return false };
            match slot(&self.touched, next, own) {
                Some(at) => next = at + 1,
                None => missing += 1,
            }
        }
        if missing == 0 {
            return true;
        }
        if self.touched.len() + missing > MAX_FEET {
            if self.kept_for > 0 {
                return false;
            }
            self.kept_for = KEPT_FOR;
            self.touched.clear();
        }
        let mut next = 0;
        for contact in contacts {
            let Some(own) = self.known(index, contacts, contact) else { return false };
            next = slot(&self.touched, next, own).unwrap_or_else(|| {
                self.touched.insert(next, own);
                next
            }) + 1;
        }
        self.lanes.set_given_contacts(&self.touched);
        true
    }

    fn take(&mut self, lane: usize, index: usize, robot: &Articulation, contacts: &[&mut Contact]) -> bool {
        if !self.lanes.take(lane, robot) {
            return false;
        }
        self.lanes.take_no_contacts(lane);
        let mut next = 0;
        for (at, contact) in contacts.iter().enumerate() {
            let own = self.known(index, contacts, contact);
            let Some(slot) = own.and_then(|own| slot(&self.touched, next, own)) else {
                self.lanes.release(lane);
                return false;
            };
            next = slot + 1;
            self.slots[lane][at] = slot;
            self.lanes.take_contact(lane, slot, contact);
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
        for (contact, slot) in contacts.iter_mut().zip(self.slots[lane]) {
            self.lanes.give_contact_back(lane, slot, contact);
        }
        true
    }
}

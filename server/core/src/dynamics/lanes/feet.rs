//! Feet: balls of a robot that touch planes, as lanes know them; or any contacts with immovable robots, if a
//! world finds them.
//!
//! Other shapes of a robot that could touch a plane are guarded: lanes do not do a step in which they are
//! near.

use std::collections::BTreeSet;

use glamx::{DMat3, DPose3, DVec3};
use pulp::Simd;

use super::foot_points::{FootContact, choose};
use super::foot_solver::FootSolver;
use super::robot::LaneRobot;
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::side::Side;
use crate::dynamics::contact_point::{LOOK_AHEAD, Surface};
use crate::dynamics::direct::is_worth_it;
use crate::dynamics::island::{MANY, find_spans};
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::lane::vectors::{Matrix, Vector};
use crate::dynamics::real::{MaskOf as _, MatrixOf as _, Real as _, VectorOf as _};
use crate::dynamics::tree::Tree;

/// Maximum number of pairs of a ball and a plane; robots with more of them step alone.
pub const MAX_FEET: usize = 8;

/// Maximum number of velocities of a robot with feet: the memory for feet grows with their square.
pub(super) const MAX_VELOCITIES: usize = 128;

/// Margin by which a guarded shape is enlarged, metres: far above rounding.
const ROUNDING: f64 = 1e-6;

/// A moving ball and a fixed plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootPair {
    /// Indices of the two robots, the smaller first.
    pub robots: [usize; 2],
    /// Collider of each robot, by index.
    pub colliders: [usize; 2],
    /// Side of the ball, 0 or 1.
    pub side: usize,
    /// Body of the ball.
    pub body: usize,
    /// Link of each robot, by index.
    pub links: [usize; 2],
    /// Radius of the ball, metres.
    pub radius: f64,
    /// Axes of the ball in its body.
    pub body_from_ball: DPose3,
    /// Axes of the plane in the world.
    pub plane: DPose3,
    /// Normal of the plane, in its axes.
    pub normal: DVec3,
}

/// A moving shape that is not a ball, and a plane that it may touch.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    /// Body of the shape.
    pub body: usize,
    /// Centre of a box around it, in the body's axes, metres.
    pub middle: DVec3,
    /// Axes of that box, in the body's.
    pub axes: DMat3,
    /// Half of its lengths, metres.
    pub half: DVec3,
    /// Largest distance between the body's origin and the sphere around the shape, metres; the look-ahead for
    /// contacts takes its speed from it.
    pub reach: f64,
    /// Normal of the plane, world.
    pub normal: DVec3,
    /// Height of the plane along its normal, metres.
    pub height: f64,
}

/// Feet of all copies.
#[derive(Debug)]
pub(super) struct Feet<S: Simd> {
    /// Pairs for which lanes find contacts; empty if the world does.
    pub(super) pairs: Vec<FootPair>,
    /// Touched body and its side, for each possible contact.
    pub(super) touched: Vec<(usize, usize)>,
    pub(super) guards: Vec<Guard>,
    /// Contacts by pair.
    pub(super) contacts: Vec<FootContact<S>>,
    /// Contacts before the step.
    before: Vec<FootContact<S>>,
    /// Combined surfaces, by lane, then by pair.
    surfaces: Vec<Surface>,
    /// Pairs of each body with many pairs, for which the world may sum its responses differently, see
    /// [`MANY`].
    crowded: Vec<Vec<usize>>,
    /// Numbers of contacts for which the world does not solve directly.
    swept: Vec<f64>,
    pub(super) solver: FootSolver<S>,
}

impl<S: Simd> Feet<S> {
    /// Returns feet without pairs.
    pub(super) fn none(zero: Lanes<S>) -> Self {
        Self {
            pairs: Vec::new(),
            touched: Vec::new(),
            guards: Vec::new(),
            contacts: Vec::new(),
            before: Vec::new(),
            surfaces: Vec::new(),
            crowded: Vec::new(),
            swept: Vec::new(),
            solver: FootSolver::new(zero, 0),
        }
    }

    /// Returns the bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.pairs[..])
            + size_of_val(&self.guards[..])
            + 2 * size_of_val(&self.contacts[..])
            + size_of_val(&self.surfaces[..])
            + self.solver.bytes()
    }

    /// Returns the range of a lane in `surfaces`.
    fn of_lane(&self, lane: usize) -> std::ops::Range<usize> {
        lane * self.pairs.len()..(lane + 1) * self.pairs.len()
    }

    /// Returns the lanes in which a body has [`MANY`] contacts or more.
    #[inline(always)]
    fn are_crowded(&self) -> Mask<S> {
        let zero = self.solver.zero();
        let mut any = zero.lt(zero);
        for pairs in &self.crowded {
            let mut count = zero;
            for &index in pairs {
                count += self.contacts[index].is_there;
            }
            any = any | zero.splat(MANY as f64).le(count);
        }
        any
    }

    /// Returns the lanes in which the world would solve the touching feet directly, if it can.
    #[inline(always)]
    pub(super) fn are_solved_directly(&self) -> Mask<S> {
        let zero = self.solver.zero();
        let mut direct = zero.le(zero);
        if self.swept.is_empty() {
            return direct;
        }
        let mut count = zero;
        for contact in &self.contacts {
            count += contact.is_there;
        }
        for &swept in &self.swept {
            direct = direct & !count.equals(zero.splat(swept));
        }
        direct
    }

    /// Stores the contacts, for lanes that do not complete the step.
    pub(super) fn begin(&mut self) {
        self.before.copy_from_slice(&self.contacts);
    }

    /// Restores a lane.
    pub(super) fn put_back(&mut self, lane: usize) {
        for (contact, before) in self.contacts.iter_mut().zip(&self.before) {
            contact.put_back(lane, before);
        }
    }
}

/// Returns whether lanes can handle such surfaces: rigid, without rebound, and without friction against
/// rolling and spinning.
pub(super) fn is_simple(surface: &Surface) -> bool {
    let Surface { friction: _, restitution, rolling_friction, spinning_friction, stiffness, damping: _ } =
        *surface;
    [restitution, rolling_friction, spinning_friction, stiffness] == [0.0; 4]
}

impl<S: Simd> LaneRobot<S> {
    /// Sets the feet of robots with a free root, before any lane has a copy; pairs are in the order of
    /// contacts.
    pub fn set_feet(&mut self, pairs: &[FootPair], guards: &[Guard]) {
        debug_assert!(pairs.is_sorted_by_key(|pair| (pair.robots, pair.colliders)), "the order of contacts");
        let touched: Vec<(usize, usize)> = pairs.iter().map(|pair| (pair.body, pair.side)).collect();
        self.set_given_contacts(&touched);
        self.feet.surfaces = vec![Surface::default(); pairs.len() * S::F64_LANES];
        self.feet.pairs = pairs.to_vec();
        self.feet.guards = guards.to_vec();
    }

    /// Makes lanes take contacts from the caller, by touched body and side, in their order.
    pub fn set_given_contacts(&mut self, touched: &[(usize, usize)]) {
        let zero = self.occupied.splat(0.0);
        let tree = &*self.tree;
        let mut solver = FootSolver::new(zero, tree.velocity_count);
        solver.set_tree(tree);
        solver.set_feet(touched.iter().map(|(body, _)| columns(tree, *body)));
        let count = touched.len();
        let of_body = |body: usize| (0..count).filter(|&index| touched[index].0 == body).collect();
        let bodies: BTreeSet<usize> = touched.iter().map(|(body, _)| *body).collect();
        let crowded = bodies.into_iter().map(of_body).filter(|of_body: &Vec<usize>| of_body.len() >= MANY);
        let swept = (1..=count).filter(|&contacts| !is_worth_it(tree.velocity_count, contacts));
        self.feet = Feet {
            crowded: crowded.collect(),
            swept: swept.map(|contacts| contacts as f64).collect(),
            pairs: Vec::new(),
            touched: touched.to_vec(),
            guards: Vec::new(),
            contacts: vec![FootContact::none(zero); count],
            before: vec![FootContact::none(zero); count],
            surfaces: Vec::new(),
            solver,
        };
    }

    /// Removes all contacts of a copy in a lane.
    pub fn take_no_contacts(&mut self, lane: usize) {
        for contact in &mut self.feet.contacts {
            contact.is_there.set(lane, 0.0);
        }
    }

    /// Sets a contact of a copy in a lane; its surfaces must be [simple](is_simple).
    pub fn take_contact(&mut self, lane: usize, index: usize, contact: &Contact) {
        self.feet.contacts[index].set(lane, contact);
        self.feet.solver.feet[index].friction.set(lane, contact.point.surface.friction);
    }

    /// Writes the results of a given contact.
    pub fn give_contact_back(&self, lane: usize, index: usize, contact: &mut Contact) {
        let FootContact { impulse, is_least, total, .. } = &self.feet.contacts[index];
        (contact.impulse, contact.turning_impulse) = (impulse.get(lane), DVec3::ZERO);
        contact.is_least = is_least.get(lane) == 1.0;
        contact.total = total.get(lane);
    }

    /// Sets the contacts of a copy in a lane, and the combined surfaces of each pair. `surfaces` are `None`
    /// if its planes are not at the lanes' poses. Returns false if it has contacts that lanes do not know;
    /// the lane is then empty.
    pub fn take_contacts(
        &mut self,
        lane: usize,
        (contacts, surfaces): (&[Contact], Option<&[Surface]>),
    ) -> bool {
        let surfaces = surfaces.filter(|surfaces| surfaces.len() == self.feet.pairs.len());
        let own = self.feet.of_lane(lane);
        self.take_no_contacts(lane);
        let surfaces = surfaces.filter(|surfaces| surfaces.iter().all(is_simple));
        let mut fits = surfaces.is_some();
        if let Some(surfaces) = surfaces {
            self.feet.surfaces[own].copy_from_slice(surfaces);
            for (foot, surface) in self.feet.solver.feet.iter_mut().zip(surfaces) {
                foot.friction.set(lane, surface.friction);
            }
        }
        for contact in contacts {
            let is_of =
                |pair: &FootPair| (pair.robots, pair.colliders) == (contact.robots, contact.point.colliders);
            match self.feet.pairs.iter().position(is_of) {
                Some(index) if self.feet.contacts[index].is_there.get(lane) == 0.0 => {
                    self.feet.contacts[index].set(lane, contact);
                }
                _ => fits = false,
            }
        }
        if !fits {
            self.occupied.set(lane, 0.0);
        }
        fits
    }

    /// Returns the contacts of a copy, in their order.
    pub fn contacts(&self, lane: usize) -> impl Iterator<Item = Contact> {
        let Feet { pairs, contacts, surfaces, .. } = &self.feet;
        let surfaces = &surfaces[self.feet.of_lane(lane)];
        let all = pairs.iter().zip(contacts).zip(surfaces);
        all.filter_map(move |((pair, contact), surface)| contact.get(lane, pair, *surface))
    }

    /// Returns whether copies touch with feet.
    pub fn has_feet(&self) -> bool {
        !self.feet.touched.is_empty()
    }

    /// Computes the origins of bodies, base axes.
    #[inline(always)]
    fn update_origins(&mut self) {
        let zero = self.occupied.splat(0.0);
        let base = Vector::zero(zero);
        for i in 0..self.bodies.len() {
            let above = self.tree.bodies[i].parent.map_or(base, |parent| self.bodies[parent].origin);
            let at = &mut self.bodies[i];
            at.origin = above + at.reach;
        }
    }

    /// Finds the contacts of feet; sums of impulses restart if the step `begins`. Returns the lanes in which
    /// another shape may touch a plane, or a body has many contacts.
    #[inline(always)]
    pub(super) fn find_feet(&mut self, begins: bool) -> Mask<S> {
        self.update_origins();
        if self.feet.pairs.is_empty() {
            self.meet_given();
        } else {
            self.find_points(begins);
        }
        self.near_planes() | self.feet.are_crowded()
    }

    /// Returns the lanes in which a guarded shape is so near a plane that contacts of it could be found.
    #[inline(always)]
    fn near_planes(&self) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let mut near = zero.lt(zero);
        for guard in &self.feet.guards {
            let at = &self.bodies[guard.body];
            let normal = Vector::broadcast(self.simd, guard.normal);
            let axes = at.rotation.after(Matrix::broadcast(self.simd, &guard.axes));
            let along = axes.transposed_times(normal);
            let half = along.x.abs() * zero.splat(guard.half.x)
                + along.y.abs() * zero.splat(guard.half.y)
                + along.z.abs() * zero.splat(guard.half.z);
            let middle = at.origin + at.rotation.times(Vector::broadcast(self.simd, guard.middle));
            let above = middle.dot(normal) - zero.splat(guard.height + ROUNDING) - half;
            let farthest = zero.splat(guard.reach + ROUNDING);
            let speed = at.velocity.linear.length() + at.velocity.angular.length() * farthest;
            let margin = zero.splat(self.slack) + zero.splat(LOOK_AHEAD * self.stepping.h) * speed;
            near = near | !margin.lt(above);
        }
        near
    }

    /// Stores the results of contacts in lanes that touch and complete their step. `least` are the lanes
    /// whose impulses are the least ones.
    #[inline(always)]
    pub(super) fn keep_contacts(&mut self, touching: Mask<S>, least: Mask<S>) {
        let Feet { contacts, solver, .. } = &mut self.feet;
        for (contact, foot) in contacts.iter_mut().zip(&solver.feet) {
            let impulse = foot.world_impulse();
            contact.impulse = choose(touching, impulse, contact.impulse);
            contact.total = choose(touching, contact.total + impulse, contact.total);
            contact.is_least = touching.select(least.numbers(), contact.is_least);
        }
    }

    /// Returns the lanes whose initial impulses are the least ones of the previous step.
    #[inline(always)]
    pub(super) fn were_least(&self) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let mut all = zero.le(zero);
        for contact in &self.feet.contacts {
            all = all & !(zero.lt(contact.is_there) & contact.is_least.equals(zero));
        }
        all
    }
}

/// Returns whether a body of a tree in lanes can have a foot. Each joint between it and a free root must have
/// a column of J.
pub fn can_be_foot(tree: &Tree, body: usize) -> bool {
    let root = tree.root_velocities();
    let above = std::iter::successors(Some(body), |body| tree.bodies[*body].parent);
    let joints = above.filter(|body| *body > 0).count();
    let is_small = tree.velocity_count <= MAX_VELOCITIES;
    is_small && root > 0 && body > 0 && columns(tree, body).len() == root + joints
}

/// Returns the velocities that move a body, from the root on. The flags say whether each is added to the
/// second of the two sums of the one-robot step.
fn columns(tree: &Tree, body: usize) -> Vec<(usize, bool)> {
    let side = Side { len: tree.velocity_count, ..Side::default() };
    let side = find_spans(side, tree, [Some(body), None]);
    let spans = side.spans.into_iter().filter(|span| span.len > 0);
    spans.flat_map(|span| span.range().enumerate().map(|(k, velocity)| (velocity, k % 2 == 1))).collect()
}

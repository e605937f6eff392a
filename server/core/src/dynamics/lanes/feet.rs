//! Feet: balls of a robot that touch planes, as lanes know them.
//!
//! Where a foot is found to touch is a few operations on turned frames, which are done for one lane after the other by who looks for
//! contacts in the one-robot step too ([`FootSearch`]); all that follows of it is done for all lanes at once. What else of a robot
//! could come to a plane is guarded: a step in which it is near is none of lanes.

use glamx::{DMat3, DPose3, DQuat, DVec3};
use pulp::Simd;

use super::foot_solver::FootSolver;
use super::number::{Lanes, Mask};
use super::robot::LaneRobot;
use super::step::LOOK_AHEAD;
use super::vectors::{Matrix, Vector};
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::side::Side;
use crate::dynamics::contact_point::{ContactPoint, Surface};
use crate::dynamics::island::find_spans;
use crate::dynamics::kinematics::BodyMotion;
use crate::dynamics::tree::Tree;

/// Pairs of a ball and a plane at the most: robots with more of them touch by themselves.
pub const MOST_FEET: usize = 8;

/// A guarded shape is taken for this much larger than it is, metres: far above rounding.
const ROUNDING: f64 = 1e-6;

/// A ball that moves and a plane that does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootPair {
    /// Indices of the two robots, the smaller first.
    pub robots: [usize; 2],
    /// Index of each one's collider.
    pub colliders: [usize; 2],
    /// Which of the two is the ball's.
    pub side: usize,
    /// The body of the ball.
    pub body: usize,
}

/// A shape that moves and is no ball, and a plane that it may touch.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    /// The body that it is of.
    pub body: usize,
    /// The middle of a box around it, in the body's axes.
    pub middle: DVec3,
    /// The axes of that box, in the body's.
    pub axes: DMat3,
    /// Half of its lengths.
    pub half: DVec3,
    /// The plane's normal, world.
    pub normal: DVec3,
    /// The plane's height along it.
    pub height: f64,
}

/// Who finds where feet touch, as the one-robot step does.
pub trait FootSearch {
    /// Where a pair touches or is about to, of a copy whose body moves so.
    fn find(&mut self, pair: usize, motion: BodyMotion) -> Option<ContactPoint>;
}

/// A robot without feet.
pub struct NoFeet;

impl FootSearch for NoFeet {
    fn find(&mut self, _: usize, _: BodyMotion) -> Option<ContactPoint> {
        None
    }
}

/// The feet of all copies.
#[derive(Debug)]
pub(super) struct Feet<S: Simd> {
    pub(super) pairs: Vec<FootPair>,
    pub(super) guards: Vec<Guard>,
    /// By lane, then by pair.
    contacts: Vec<Option<Contact>>,
    /// The same before the step.
    before: Vec<Option<Contact>>,
    /// What the two surfaces are like together; in the same order.
    surfaces: Vec<Surface>,
    pub(super) solver: FootSolver<S>,
}

impl<S: Simd> Feet<S> {
    /// None.
    pub(super) fn none(zero: Lanes<S>) -> Self {
        Self {
            pairs: Vec::new(),
            guards: Vec::new(),
            contacts: Vec::new(),
            before: Vec::new(),
            surfaces: Vec::new(),
            solver: FootSolver::new(zero, 0),
        }
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.pairs[..])
            + size_of_val(&self.guards[..])
            + 2 * size_of_val(&self.contacts[..])
            + size_of_val(&self.surfaces[..])
            + self.solver.bytes()
    }

    /// Where those of a lane are.
    fn of_lane(&self, lane: usize) -> std::ops::Range<usize> {
        lane * self.pairs.len()..(lane + 1) * self.pairs.len()
    }

    /// Keeps the contacts, for lanes whose step is not done.
    pub(super) fn begin(&mut self) {
        self.before.copy_from_slice(&self.contacts);
    }

    /// Puts a lane back.
    pub(super) fn put_back(&mut self, lane: usize) {
        let own = self.of_lane(lane);
        self.contacts[own.clone()].copy_from_slice(&self.before[own]);
    }
}

/// Whether lanes know what such surfaces do: they are rigid, do not rebound, and let what rolls roll.
pub fn is_simple(surface: &Surface) -> bool {
    let Surface { friction: _, restitution, rolling_friction, spinning_friction, stiffness, damping: _ } =
        *surface;
    [restitution, rolling_friction, spinning_friction, stiffness] == [0.0; 4]
}

impl<S: Simd> LaneRobot<S> {
    /// Has lanes touch with these, before there is a copy in any; pairs are in the order of contacts. Of robots with a free root.
    pub fn set_feet(&mut self, pairs: &[FootPair], guards: &[Guard]) {
        let zero = self.is_taken.same(0.0);
        let tree = &*self.tree;
        let columns = |pair: &FootPair| columns(tree, pair.body);
        let mut solver = FootSolver::new(zero, tree.velocity_count);
        solver.set_tree(tree);
        solver.set_feet(pairs.iter().map(columns));
        let count = pairs.len() * S::F64_LANES;
        self.feet = Feet {
            pairs: pairs.to_vec(),
            guards: guards.to_vec(),
            contacts: vec![None; count],
            before: vec![None; count],
            surfaces: vec![Surface::default(); count],
            solver,
        };
    }

    /// Gives a copy in a lane its contacts, and what the surfaces of each pair are like together. False where it has contacts of
    /// which lanes know nothing; then the lane is empty.
    pub fn take_contacts(&mut self, lane: usize, contacts: &[Contact], surfaces: &[Surface]) -> bool {
        let own = self.feet.of_lane(lane);
        self.feet.contacts[own.clone()].fill(None);
        let mut fits = surfaces.len() == self.feet.pairs.len() && surfaces.iter().all(is_simple);
        if fits {
            self.feet.surfaces[own.clone()].copy_from_slice(surfaces);
            for (foot, surface) in self.feet.solver.feet.iter_mut().zip(surfaces) {
                foot.friction.set(lane, surface.friction);
            }
        }
        for contact in contacts {
            let is_of =
                |pair: &FootPair| (pair.robots, pair.colliders) == (contact.robots, contact.point.colliders);
            match self.feet.pairs.iter().position(is_of) {
                Some(index) if self.feet.contacts[own.start + index].is_none() => {
                    self.feet.contacts[own.start + index] = Some(*contact);
                }
                _ => fits = false,
            }
        }
        if !fits {
            self.is_taken.set(lane, 0.0);
        }
        fits
    }

    /// The contacts of a copy, in their order.
    pub fn contacts(&self, lane: usize) -> impl Iterator<Item = &Contact> {
        self.feet.contacts[self.feet.of_lane(lane)].iter().flatten()
    }

    /// Whether copies touch with feet.
    pub fn has_feet(&self) -> bool {
        !self.feet.pairs.is_empty()
    }

    /// Where bodies are, base's axes.
    #[inline(always)]
    fn update_origins(&mut self) {
        let zero = self.is_taken.same(0.0);
        let base = Vector { x: zero, y: zero, z: zero };
        for i in 0..self.bodies.len() {
            let above = self.tree.bodies[i].parent.map_or(base, |parent| self.bodies[parent].origin);
            let at = &mut self.bodies[i];
            at.origin = above + at.reach;
        }
    }

    /// Finds where feet touch, of all lanes that have a copy. Where something else may touch a plane; `begins` where sums of
    /// impulses begin anew.
    #[inline(always)]
    pub(super) fn find_feet(&mut self, search: &mut dyn FootSearch, begins: bool) -> Mask<S> {
        self.update_origins();
        let near = self.near_planes();
        for lane in (0..S::F64_LANES).filter(|lane| self.is_taken.get(*lane) == 1.0) {
            let (mut last, mut motion) = (usize::MAX, None);
            for index in 0..self.feet.pairs.len() {
                let body = self.feet.pairs[index].body;
                if body != last {
                    (last, motion) = (body, Some(self.motion(lane, body)));
                }
                let slot = lane * self.feet.pairs.len() + index;
                let Some(mut point) = motion.and_then(|motion| search.find(index, motion)) else {
                    self.feet.contacts[slot] = None;
                    self.feet.solver.feet[index].forget(lane);
                    continue;
                };
                point.surface = self.feet.surfaces[slot];
                let mut contact = Contact::new(self.feet.pairs[index].robots, point);
                if let Some(known) = &self.feet.contacts[slot] {
                    contact.go_on_from(known, begins);
                    contact.follow(known);
                }
                let origin = self.bodies[body].origin.get(lane);
                self.feet.solver.feet[index].meet(lane, &contact, self.feet.pairs[index].side, origin);
                self.feet.contacts[slot] = Some(contact);
            }
        }
        near
    }

    /// Where a body of a copy is and how it moves; see [`Articulation::body_motion`](crate::dynamics::Articulation::body_motion).
    /// The base is where the world is, of a robot whose root is free.
    #[inline(always)]
    fn motion(&self, lane: usize, body: usize) -> BodyMotion {
        let at = &self.bodies[body];
        let (base, turn) = (DPose3::IDENTITY, DQuat::IDENTITY);
        let own = DQuat::from_mat3(&at.rotation.get(lane));
        BodyMotion {
            pose: DPose3::from_parts(base.transform_point(at.origin.get(lane)), (turn * own).normalize()),
            linear: turn * at.velocity.linear.get(lane),
            angular: turn * at.velocity.angular.get(lane),
        }
    }

    /// Where a guarded shape is so near a plane that contacts of it could be found.
    #[inline(always)]
    fn near_planes(&self) -> Mask<S> {
        let zero = self.is_taken.same(0.0);
        let mut near = zero.lt(zero);
        for guard in &self.feet.guards {
            let at = &self.bodies[guard.body];
            let normal = Vector::splat(self.simd, guard.normal);
            let axes = at.rotation.after(Matrix::splat(self.simd, &guard.axes));
            let along = axes.transposed_times(normal);
            let half = along.x.abs() * zero.same(guard.half.x)
                + along.y.abs() * zero.same(guard.half.y)
                + along.z.abs() * zero.same(guard.half.z);
            let middle = at.origin + at.rotation.times(Vector::splat(self.simd, guard.middle));
            let above = middle.dot(normal) - zero.same(guard.height + ROUNDING) - half;
            let farthest = zero.same(guard.middle.length() + guard.half.length());
            let Vector { x, y, z } = at.velocity.angular;
            let spin = (x * x + y * y + z * z).sqrt();
            let linear = at.velocity.linear;
            let speed = linear.dot(linear).sqrt() + spin * farthest;
            let margin = zero.same(self.slack) + zero.same(LOOK_AHEAD * self.stepping.h) * speed;
            near = near | !margin.lt(above);
        }
        near
    }

    /// Keeps what contacts have come to in lanes that touch, where the rest of their step is done. `least` are those whose impulses
    /// are the least ones.
    #[inline(always)]
    pub(super) fn keep_contacts(&mut self, touching: Mask<S>, least: Mask<S>) {
        let (touching, least) = (touching.numbers(), least.numbers());
        let count = self.feet.pairs.len();
        for (index, foot) in self.feet.solver.feet.iter().enumerate() {
            let impulse = foot.world_impulse();
            for lane in (0..S::F64_LANES).filter(|lane| touching.get(*lane) == 1.0) {
                if let Some(contact) = &mut self.feet.contacts[lane * count + index] {
                    contact.impulse = impulse.get(lane);
                    contact.turning_impulse = DVec3::ZERO;
                    contact.is_least = least.get(lane) == 1.0;
                    contact.total += contact.impulse;
                }
            }
        }
    }

    /// Where impulses that a lane begins with are the least of the step before.
    #[inline(always)]
    pub(super) fn were_least(&self) -> Mask<S> {
        let zero = self.is_taken.same(0.0);
        let mut all = zero.same(1.0);
        let count = self.feet.pairs.len();
        for (slot, contact) in self.feet.contacts.iter().enumerate() {
            if contact.as_ref().is_some_and(|contact| !contact.is_least) {
                all.set(slot / count, 0.0);
            }
        }
        zero.lt(all)
    }
}

/// Whether a body of a tree that lanes take can have a foot: each joint between it and a free root has a column of J.
pub fn can_be_foot(tree: &Tree, body: usize) -> bool {
    let root = tree.root_velocities();
    let above = std::iter::successors(Some(body), |body| tree.bodies[*body].parent);
    let joints = above.filter(|body| *body > 0).count();
    root > 0 && body > 0 && columns(tree, body).len() == root + joints
}

/// The velocities that move a body, from the root on, and whether each is added to the second of the two sums that the one-robot
/// step has.
fn columns(tree: &Tree, body: usize) -> Vec<(usize, bool)> {
    let side = Side { len: tree.velocity_count, ..Side::default() };
    let side = find_spans(side, tree, [Some(body), None]);
    let spans = side.spans.into_iter().filter(|span| span.len > 0);
    spans.flat_map(|span| span.range().enumerate().map(|(k, velocity)| (velocity, k % 2 == 1))).collect()
}

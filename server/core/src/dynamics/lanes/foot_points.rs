//! Contact points of feet, for all copies: the narrow phase of a ball and a plane. It also copies the data
//! that a contact inherits from the previous step. See [`collision`](crate::collision), `narrow.rs` and
//! `colliders.rs`.
//!
//! Identity matrices and turns, and sums with zero, are kept: they mimic the world's operations, to the bit.

use glamx::{DPose3, DQuat};
use pulp::Simd;

use super::feet::FootPair;
use super::pose::Pose;
use super::robot::LaneRobot;
use crate::dynamics::constraint::contact::{Contact, STEADY};
use crate::dynamics::contact_point::{ContactPoint, FASTEST_LOOKED_AHEAD, LOOK_AHEAD, Surface};
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::lane::vectors::Vector;
use crate::dynamics::real::{MaskOf as _, MatrixOf as _, Real as _, VectorOf as _};

/// Contact of a pair, for all copies; see [`Contact`]. Undefined where there is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootContact<S: Simd> {
    /// 1 where it touches or is about to.
    pub(super) is_there: Lanes<S>,
    pub(super) on: [Vector<S>; 2],
    pub(super) position: Vector<S>,
    pub(super) normal: Vector<S>,
    pub(super) distance: Lanes<S>,
    pub(super) impulse: Vector<S>,
    /// 1 where the impulse is the least one.
    pub(super) is_least: Lanes<S>,
    pub(super) total: Vector<S>,
    moved: Vector<S>,
    wanders: Vector<S>,
}

impl<S: Simd> FootContact<S> {
    /// Returns no contact.
    pub(super) fn none(zero: Lanes<S>) -> Self {
        let vector = Vector::zero(zero);
        Self {
            is_there: zero,
            on: [vector; 2],
            position: vector,
            normal: vector,
            distance: zero,
            impulse: vector,
            is_least: zero,
            total: vector,
            moved: vector,
            wanders: vector,
        }
    }

    /// Copies the contact of a copy.
    pub(super) fn set(&mut self, lane: usize, contact: &Contact) {
        let Contact { point, impulse, is_least, total, moved, wanders, .. } = contact;
        self.is_there.set(lane, 1.0);
        self.on[0].set(lane, point.on[0]);
        self.on[1].set(lane, point.on[1]);
        self.position.set(lane, point.position);
        self.normal.set(lane, point.normal);
        self.distance.set(lane, point.distance);
        self.impulse.set(lane, *impulse);
        self.is_least.set(lane, f64::from(*is_least));
        self.total.set(lane, *total);
        self.moved.set(lane, *moved);
        self.wanders.set(lane, *wanders);
    }

    /// Returns the contact of a copy, for a pair with this combined surface.
    pub(super) fn get(&self, lane: usize, pair: &FootPair, surface: Surface) -> Option<Contact> {
        let mut bodies = [None; 2];
        bodies[pair.side] = Some(pair.body);
        let point = ContactPoint {
            colliders: pair.colliders,
            links: pair.links,
            bodies,
            on: [self.on[0].get(lane), self.on[1].get(lane)],
            position: self.position.get(lane),
            normal: self.normal.get(lane),
            distance: self.distance.get(lane),
            surface,
        };
        let contact = Contact {
            impulse: self.impulse.get(lane),
            is_least: self.is_least.get(lane) == 1.0,
            total: self.total.get(lane),
            moved: self.moved.get(lane),
            wanders: self.wanders.get(lane),
            ..Contact::new(pair.robots, point)
        };
        (self.is_there.get(lane) == 1.0).then_some(contact)
    }

    /// Copies one lane from another state.
    pub(super) fn put_back(&mut self, lane: usize, from: &Self) {
        let vectors = |of: &Self| {
            let Self { on: [a, b], position, normal, impulse, total, moved, wanders, .. } = *of;
            [a, b, position, normal, impulse, total, moved, wanders].map(|vector| vector.get(lane))
        };
        let [a, b, position, normal, impulse, total, moved, wanders] = vectors(from);
        self.on[0].set(lane, a);
        self.on[1].set(lane, b);
        self.position.set(lane, position);
        self.normal.set(lane, normal);
        self.impulse.set(lane, impulse);
        self.total.set(lane, total);
        self.moved.set(lane, moved);
        self.wanders.set(lane, wanders);
        self.is_there.set(lane, from.is_there.get(lane));
        self.distance.set(lane, from.distance.get(lane));
        self.is_least.set(lane, from.is_least.get(lane));
    }
}

/// Returns the first in lanes where the mask is true, else the second.
#[inline(always)]
pub(super) fn choose<S: Simd>(mask: Mask<S>, yes: Vector<S>, no: Vector<S>) -> Vector<S> {
    Vector { x: mask.select(yes.x, no.x), y: mask.select(yes.y, no.y), z: mask.select(yes.z, no.z) }
}

impl<S: Simd> LaneRobot<S> {
    /// Starts with the given contacts.
    #[inline(always)]
    pub(super) fn meet_given(&mut self) {
        for (index, (body, side)) in self.feet.touched.iter().enumerate() {
            let origin = self.bodies[*body].origin;
            self.feet.solver.feet[index].meet(self.simd, &self.feet.contacts[index], *side, origin);
        }
    }

    /// Finds the contact points of feet. Sums of impulses restart if the step `begins`.
    #[inline(always)]
    pub(super) fn find_points(&mut self, begins: bool) {
        let (mut last, mut frame) = (usize::MAX, Pose::broadcast(self.simd, &DPose3::IDENTITY));
        for index in 0..self.feet.pairs.len() {
            let pair = self.feet.pairs[index];
            if pair.body != last {
                (last, frame) = (pair.body, self.frame(pair.body));
            }
            self.find_point(&pair, index, frame, begins);
        }
    }

    /// Returns the pose of a body, world; see
    /// [`Articulation::body_motion`](crate::dynamics::Articulation::body_motion). The base of a robot with a
    /// free root is the world's origin.
    #[inline(always)]
    fn frame(&self, body: usize) -> Pose<S> {
        let at = &self.bodies[body];
        let base = Pose::broadcast(self.simd, &DPose3::IDENTITY);
        let own = super::free::Quaternion::of(at.rotation);
        Pose { rotation: base.rotation.after(own).normalized(), translation: base.point(at.origin) }
    }

    #[inline(always)]
    fn find_point(&mut self, pair: &FootPair, index: usize, frame: Pose<S>, begins: bool) {
        let zero = self.occupied.splat(0.0);
        let still = Vector::zero(zero);
        let turn = super::free::Quaternion::broadcast(self.simd, DQuat::IDENTITY);
        let radius = zero.splat(pair.radius);
        let ball = frame.after(Pose::broadcast(self.simd, &pair.body_from_ball));
        let plane = Pose::broadcast(self.simd, &pair.plane);
        let own_normal = Vector::broadcast(self.simd, pair.normal);
        let at = &self.bodies[pair.body];
        let (linear, angular) = (turn.times(at.velocity.linear), turn.times(at.velocity.angular));
        // Distance around it within which contacts are looked for.
        let middle = ball.translation + ball.rotation.matrix().times(still);
        let velocity = linear + angular.cross(middle - frame.translation);
        let speed = velocity.length() + angular.length() * radius;
        let ahead = zero.splat(LOOK_AHEAD * self.stepping.h);
        let margin = zero.splat(self.slack) + ahead * speed;
        let drift = velocity * ahead;
        let most = zero.splat(self.slack) + ahead * zero.splat(FASTEST_LOOKED_AHEAD);
        let within = ((margin - drift.length()).max(zero) + drift.length()).min(margin).min(most);
        let height = (middle - plane.translation).dot(plane.rotation.times(own_normal));
        let is_far = within.lt(height - radius);
        // From here on in the axes of the first of the two.
        let (first, second) = if pair.side == 0 { (ball, plane) } else { (plane, ball) };
        let between = first.inverse().after(second);
        let (on_first, on_second, normal, distance);
        if pair.side == 0 {
            let out = between.rotation.times(own_normal);
            let height = (still - between.translation).dot(out);
            distance = height - radius;
            on_first = still - out * radius;
            on_second = between.rotation.inverse().times((still - out * height) - between.translation);
            normal = -out;
        } else {
            let inward = between.rotation.inverse().times(-own_normal);
            let above = between.point(still);
            let height = above.dot(own_normal);
            distance = height - radius;
            on_first = above - own_normal * height;
            on_second = still + inward * radius;
            normal = own_normal;
        }
        let is_there = distance.lt(within) & !is_far;
        let position = first.point(on_first + normal * (distance / zero.splat(2.0)));
        let contact = &mut self.feet.contacts[index];
        let persists = zero.lt(contact.is_there) & is_there;
        let moved = position - contact.position;
        let is_steady = (moved - contact.moved).length().lt(zero.splat(STEADY) * moved.length());
        contact.wanders = choose(persists & is_steady, moved, still);
        contact.moved = choose(persists, moved, still);
        contact.impulse = choose(persists, contact.impulse, still);
        contact.total = if begins { still } else { choose(persists, contact.total, still) };
        contact.is_least = persists.select(contact.is_least, zero);
        contact.is_there = is_there.numbers();
        contact.on = [on_first, on_second];
        contact.position = position;
        contact.normal = first.rotation.times(normal);
        contact.distance = distance;
        let contact = *contact;
        self.feet.solver.feet[index].meet(self.simd, &contact, pair.side, at.origin);
    }
}

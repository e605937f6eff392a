//! Where the shapes of two robots touch, or are about to.

use std::fmt;

use glamx::{DPose3, DVec3};
use parry3d_f64::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher as _};
use parry3d_f64::shape::Shape;

use super::colliders::{Placed, RobotColliders};
use super::filter::Filter;
use super::fixed_pair::FixedPairScratch;
use super::plane::outermost;
use super::reduce::{MOST, reduce};
use crate::dynamics::contact_point::ContactPoint;

/// Finds touching points. Keeps its memory from step to step, and no more.
#[derive(Default)]
pub struct Narrow {
    manifold: ContactManifold<(), ()>,
    /// Position and distance, in the first shape's axes.
    points: Vec<(DVec3, f64)>,
    /// The same points on the second shape, in its axes.
    opposite: Vec<DVec3>,
    near: Vec<usize>,
    pub(super) fixed_pairs: FixedPairScratch,
}

impl fmt::Debug for Narrow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("narrow phase")
    }
}

impl Narrow {
    /// Calls `found` with each point where two robots touch or are about to, in a fixed order.
    pub fn between(
        &mut self,
        [a, b]: [&RobotColliders; 2],
        filter: Filter<'_>,
        mut found: impl FnMut(ContactPoint),
    ) {
        // Of the second robot only what is near the first is looked at with each of the first's.
        let mut near = std::mem::take(&mut self.near);
        near.clear();
        near.extend((0..b.placed.len()).filter(|&j| b.placed[j].bounds.meets(&a.bounds)));
        for (i, first) in a.placed.iter().enumerate() {
            if !first.bounds.meets(&b.bounds) {
                continue;
            }
            for &j in &near {
                let second = &b.placed[j];
                let moves = first.body.is_some() || second.body.is_some();
                if moves && first.bounds.meets(&second.bounds) && filter.allows(first, second) {
                    self.pair([i, j], [a, b], [first, second], &mut found);
                }
            }
        }
        self.near = near;
    }

    pub(super) fn pair(
        &mut self,
        colliders: [usize; 2],
        robots: [&RobotColliders; 2],
        [a, b]: [&Placed; 2],
        found: &mut impl FnMut(ContactPoint),
    ) {
        let (shape_a, shape_b) = (robots[0].shape(a), robots[1].shape(b));
        let within = a.margin + b.margin;
        if far_above(shape_a, a, b, within) || far_above(shape_b, b, a, within) {
            return;
        }
        let a_from_b = a.world_from_shape.inverse() * b.world_from_shape;
        let Some(normal) = self.find(shape_a, shape_b, &a_from_b, within) else { return };
        let mut kept = [0; MOST];
        let count = reduce(&self.points, normal, &mut kept);
        let world_normal = a.world_from_shape.rotation * normal;
        for &i in &kept[..count] {
            let (on_a, distance) = self.points[i];
            let point = a.world_from_shape.transform_point(on_a + normal * (distance / 2.0));
            found(ContactPoint {
                colliders,
                links: [a.link, b.link],
                bodies: [a.body, b.body],
                on: [on_a, self.opposite[i]],
                position: point,
                normal: world_normal,
                distance,
                surface: a.surface.against(b.surface),
            });
        }
    }

    /// Fills in the points and gives the normal, in the first shape's axes.
    fn find(&mut self, a: &dyn Shape, b: &dyn Shape, a_from_b: &DPose3, within: f64) -> Option<DVec3> {
        self.points.clear();
        self.opposite.clear();
        if let Some(plane) = a.as_halfspace() {
            let inward = a_from_b.rotation.inverse() * -plane.normal;
            outermost(b, inward, |point, radius| {
                let height = a_from_b.transform_point(point).dot(plane.normal);
                if height - radius < within {
                    let above = a_from_b.transform_point(point);
                    self.points.push((above - plane.normal * height, height - radius));
                    self.opposite.push(point + inward * radius);
                }
            });
            return Some(plane.normal);
        }
        if let Some(plane) = b.as_halfspace() {
            let normal = a_from_b.rotation * plane.normal;
            outermost(a, -normal, |point, radius| {
                let height = (point - a_from_b.translation).dot(normal);
                if height - radius < within {
                    self.points.push((point - normal * radius, height - radius));
                    self.opposite.push(a_from_b.inverse_transform_point(point - normal * height));
                }
            });
            return Some(-normal);
        }
        // parry goes on from what a manifold has; this one has nothing.
        self.manifold.points.clear();
        self.manifold.local_n1 = DVec3::ZERO;
        self.manifold.local_n2 = DVec3::ZERO;
        let dispatcher = DefaultQueryDispatcher;
        dispatcher
            .contact_manifold_convex_convex(a_from_b, a, b, None, None, within, &mut self.manifold)
            .ok()?;
        for point in self.manifold.points.iter().filter(|point| point.dist < within) {
            self.points.push((point.local_p1, point.dist));
            self.opposite.push(point.local_p2);
        }
        let normal = self.manifold.local_n1;
        (!self.points.is_empty() && normal.is_finite()).then_some(normal)
    }
}

/// Whether a shape is a plane, and the sphere around another one is well above it: the bounds of a
/// plane are all of space, and tell nothing.
fn far_above(shape: &dyn Shape, plane: &Placed, other: &Placed, within: f64) -> bool {
    shape.as_halfspace().is_some_and(|half| {
        let normal = plane.world_from_shape.rotation * half.normal;
        let height = (other.world_middle() - plane.world_from_shape.translation).dot(normal);
        height - other.radius > within
    })
}

//! Where the shapes of two robots touch, or are about to.

use std::fmt;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher as _};
use rapier3d_f64::parry::shape::{Shape, ShapeType};

use super::colliders::{Placed, RobotColliders};
use super::facet_contact::FacetContact;
use super::facets::{Facets, relative};
use super::filter::Filter;
use super::fixed_pair::FixedPairScratch;
use super::hull::Graph;
use super::plane::outermost_beyond;
use super::reduce::{MOST, SAME, reduce};
use crate::dynamics::contact_point::ContactPoint;

/// Corners of a hull are looked for so much farther from a plane than they are taken, metres.
const ROUNDING: f64 = 1e-9;

/// Faces whose edges lie on each other are clipped with one of them moved aside by this, metres: far above rounding, and
/// too little to change what they carry.
const ASIDE: f64 = 1e-10;

/// Pairs of colliders that are looked at before it is asked again whether the step is interrupted.
const BETWEEN_INTERRUPTS: u32 = 256;

/// Finds touching points. Keeps its memory from step to step, and no more.
#[derive(Default)]
pub struct Narrow {
    manifold: ContactManifold<(), ()>,
    /// Position and distance, in the first shape's axes.
    points: Vec<(DVec3, f64)>,
    /// The same points on the second shape, in its axes.
    opposite: Vec<DVec3>,
    /// Colliders of the first robot that are near the second, and the other way round.
    near: [Vec<usize>; 2],
    /// Pairs of colliders whose bounds were compared, since it was set to 0.
    pub compared: u64,
    /// Pairs of colliders since it was asked whether the step is interrupted.
    since_asked: u32,
    facets: FacetContact,
    pub(super) fixed_pairs: FixedPairScratch,
}

impl fmt::Debug for Narrow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("narrow phase")
    }
}

impl Narrow {
    /// Calls `found` with each point where two robots touch or are about to, in a fixed order. False where it was
    /// interrupted.
    pub fn between(
        &mut self,
        [a, b]: [&RobotColliders; 2],
        filter: Filter<'_>,
        interrupt: &dyn Fn() -> bool,
        mut found: impl FnMut(ContactPoint),
    ) -> bool {
        // Only what is near the other robot is looked at, each with each.
        let mut near = std::mem::take(&mut self.near);
        let [near_b, near_a] = &mut near;
        a.near(&b.bounds, near_b);
        b.near(&a.bounds, near_a);
        self.compared += (near_b.len() * near_a.len()) as u64;
        let is_whole = near_b.iter().all(|&i| {
            let first = &a.placed[i];
            near_a.iter().all(|&j| {
                let second = &b.placed[j];
                let moves = first.body.is_some() || second.body.is_some();
                let may_touch = moves && first.bounds.meets(&second.bounds) && filter.allows(first, second);
                !may_touch
                    || (!self.is_interrupted(interrupt)
                        && self.pair([i, j], [a, b], [first, second], interrupt, &mut found))
            })
        });
        self.near = near;
        is_whole
    }

    /// To be called for each pair of colliders.
    pub(super) fn is_interrupted(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        self.since_asked += 1;
        let asks = self.since_asked >= BETWEEN_INTERRUPTS;
        if asks {
            self.since_asked = 0;
        }
        asks && interrupt()
    }

    /// The same of two colliders.
    pub(super) fn pair(
        &mut self,
        colliders: [usize; 2],
        robots: [&RobotColliders; 2],
        [a, b]: [&Placed; 2],
        interrupt: &dyn Fn() -> bool,
        found: &mut impl FnMut(ContactPoint),
    ) -> bool {
        let (shape_a, shape_b) = (robots[0].shape(a), robots[1].shape(b));
        let within = a.within(b);
        if a.sphere_gap(b) >= within || far_above(shape_a, a, b, within) || far_above(shape_b, b, a, within) {
            return true;
        }
        let facets = [robots[0].facets(a), robots[1].facets(b)];
        if facets.iter().any(Option::is_some) {
            return self.touch_facets(colliders, (facets, [shape_a, shape_b]), [a, b], interrupt, found);
        }
        let a_from_b = a.world_from_shape.inverse() * b.world_from_shape;
        let hulls = [robots[0].shape_and_graph(a), robots[1].shape_and_graph(b)];
        let Some(normal) = self.find(hulls, &a_from_b, within) else { return true };
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
        true
    }

    /// The same where one of the two is of triangles. Two of them touch nothing: what moves is convex.
    fn touch_facets(
        &mut self,
        colliders: [usize; 2],
        (facets, shapes): ([Option<Facets<'_>>; 2], [&dyn Shape; 2]),
        sides @ [a, b]: [&Placed; 2],
        interrupt: &dyn Fn() -> bool,
        found: &mut impl FnMut(ContactPoint),
    ) -> bool {
        let (first, surface) = match facets {
            [Some(surface), None] => (0, surface),
            [None, Some(surface)] => (1, surface),
            _ => return true,
        };
        let (fixed, other) = (sides[first], sides[1 - first]);
        let surface_from_shape = relative(&fixed.world_from_shape, &other.world_from_shape);
        let shape = (shapes[1 - first], other.middle(), other.radius);
        let within = a.within(b);
        let Some(points) = self.facets.find(surface, shape, &surface_from_shape, within, interrupt) else {
            return false;
        };
        for point in points {
            let out = fixed.world_from_shape.rotation * point.normal;
            let on = [point.on_surface, point.on_shape];
            let middle = point.on_surface + point.normal * (point.distance / 2.0);
            found(ContactPoint {
                colliders,
                links: [a.link, b.link],
                bodies: [a.body, b.body],
                on: [on[first], on[1 - first]],
                position: fixed.world_from_shape.transform_point(middle),
                normal: if first == 0 { out } else { -out },
                distance: point.distance,
                surface: a.surface.against(b.surface),
            });
        }
        true
    }

    /// Fills in the points and gives the normal, in the first shape's axes.
    fn find(
        &mut self,
        [(a, graph_a), (b, graph_b)]: [(&dyn Shape, Option<&Graph>); 2],
        a_from_b: &DPose3,
        within: f64,
    ) -> Option<DVec3> {
        self.points.clear();
        self.opposite.clear();
        if let Some(plane) = a.as_halfspace() {
            let inward = a_from_b.rotation.inverse() * -plane.normal;
            let least = a_from_b.translation.dot(plane.normal) - within - ROUNDING;
            outermost_beyond((b, graph_b), inward, least, |point, radius| {
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
            let least = -a_from_b.translation.dot(normal) - within - ROUNDING;
            outermost_beyond((a, graph_a), -normal, least, |point, radius| {
                let height = (point - a_from_b.translation).dot(normal);
                if height - radius < within {
                    self.points.push((point - normal * radius, height - radius));
                    self.opposite.push(a_from_b.inverse_transform_point(point - normal * height));
                }
            });
            return Some(-normal);
        }
        let mut normal = self.clip(a, b, a_from_b, within)?;
        let count = self.corners(within);
        self.take_points(DVec3::ZERO, within);
        if count < MOST && has_faces(a) && has_faces(b) {
            // Where edges of two faces lie on each other to rounding, parry finds neither the corners inside nor where
            // edges cross, or one corner twice: of boxes that are stacked exactly, three of four corners, two or none.
            let (u, v) = normal.any_orthonormal_pair();
            let aside = (u * 0.83 + v * 0.55) * ASIDE;
            let moved = DPose3::from_parts(a_from_b.translation + aside, a_from_b.rotation);
            let again = self.clip(a, b, &moved, within);
            if let Some(again) = again.filter(|_| self.corners(within) > count) {
                normal = again;
                self.take_points(a_from_b.rotation.inverse() * aside, within);
            }
        }
        (!self.points.is_empty()).then_some(normal)
    }

    /// Has parry find a manifold. The normal, in the first shape's axes, where they are that near.
    fn clip(&mut self, a: &dyn Shape, b: &dyn Shape, a_from_b: &DPose3, within: f64) -> Option<DVec3> {
        // parry goes on from what a manifold has; this one has nothing.
        self.manifold.points.clear();
        self.manifold.local_n1 = DVec3::ZERO;
        self.manifold.local_n2 = DVec3::ZERO;
        let dispatcher = DefaultQueryDispatcher;
        dispatcher
            .contact_manifold_convex_convex(a_from_b, a, b, None, None, within, &mut self.manifold)
            .ok()?;
        let normal = self.manifold.local_n1;
        (normal.is_finite() && normal != DVec3::ZERO).then_some(normal)
    }

    /// The points of the manifold that are apart from each other.
    fn corners(&self, within: f64) -> usize {
        let points = &self.manifold.points;
        let near = points.iter().enumerate().filter(|(_, point)| point.dist < within);
        near.filter(|(i, point)| {
            let same = |other: &DVec3| other.distance_squared(point.local_p1) < SAME * SAME;
            !points[..*i].iter().any(|other| other.dist < within && same(&other.local_p1))
        })
        .count()
    }

    /// Takes the points of the manifold, which was found with the second shape moved by this, in its axes.
    fn take_points(&mut self, moved: DVec3, within: f64) {
        self.points.clear();
        self.opposite.clear();
        for point in self.manifold.points.iter().filter(|point| point.dist < within) {
            self.points.push((point.local_p1, point.dist));
            self.opposite.push(point.local_p2 + moved);
        }
    }
}

/// Whether parry clips faces of it.
fn has_faces(shape: &dyn Shape) -> bool {
    matches!(shape.shape_type(), ShapeType::Cuboid | ShapeType::ConvexPolyhedron | ShapeType::Cylinder)
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

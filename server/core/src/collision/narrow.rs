//! Narrow phase: contacts of two robots' shapes that touch, or are about to.

use std::fmt;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::ContactManifold;
use rapier3d_f64::parry::query::details::contact_manifold_ball_ball;
use rapier3d_f64::parry::shape::{Ball, Shape, ShapeType};

use super::clip::{clip_convex, is_capsule};
use super::colliders::{Frame, Placed, RobotColliders};
use super::facet_contact::{Convex, FacetContact};
use super::facets::{Facets, relative};
use super::filter::Filter;
use super::hull::Graph;
use super::near_facets::NearFacets;
use super::plane::{ROUNDING, outermost_beyond};
use super::reduce::{MAX_POINTS, MERGE_DISTANCE, needs_middle, reduce};
use super::seams::{is_seam, seam_height};
use super::surface_contact::SurfaceContact;
use crate::dynamics::contact_point::{ContactPoint, SurfaceCombination};

/// Displacement of one of two clipped faces whose edges coincide, metres: far above rounding, and too small
/// to change their loads.
const MAX_TIE: f64 = 1e-10;

/// Number of pairs of colliders between two calls of the interrupt.
const BETWEEN_INTERRUPTS: u32 = 256;

/// Finds contact points. Reuses its memory, and keeps no other state.
#[derive(Default)]
pub struct NarrowPhase {
    manifold: ContactManifold<(), ()>,
    /// Position and distance of each point, in the first shape's axes.
    points: Vec<(DVec3, f64)>,
    /// Points on the second shape, in its axes.
    opposite: Vec<DVec3>,
    /// Colliders of the first robot near the second, and the other way round.
    near: [Vec<usize>; 2],
    /// Triangles of each robot near the other one.
    near_facets: NearFacets,
    /// Combination of touching surfaces; to be set before the search for contacts.
    pub combination: SurfaceCombination,
    /// Number of pairs of colliders whose bounds were compared, since it was set to 0.
    pub compared: u64,
    /// Number of pairs of colliders since the last call of the interrupt.
    since_asked: u32,
    facets: FacetContact,
    pub(super) surface_contact: SurfaceContact,
    pub(super) fixed_pairs: FixedPairScratch,
}

/// Scratch of a query of two robots that are fixed to the world, or of one.
#[derive(Default)]
pub(super) struct FixedPairScratch {
    /// Pairs that were ignored before the query.
    pub(super) before: Vec<[usize; 2]>,
    pub(super) points: Vec<ContactPoint>,
    /// Colliders of the first robot near the second, and of the second near one of the first.
    pub(super) near: [Vec<usize>; 2],
    /// Robots, 0 or 1, and their bodies with deep initial overlaps.
    pub(super) stuck: Vec<(usize, Option<usize>)>,
}

impl fmt::Debug for NarrowPhase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("narrow phase")
    }
}

impl NarrowPhase {
    /// Calls `found` with each contact point of two robots whose bounds meet, in a fixed order. Returns false
    /// if interrupted.
    pub fn between(
        &mut self,
        [a, b]: [&RobotColliders; 2],
        filter: Filter<'_>,
        interrupt: &dyn Fn() -> bool,
        mut found: impl FnMut(ContactPoint),
    ) -> bool {
        let mut facets = std::mem::take(&mut self.near_facets);
        facets.clear();
        if let ([first], [second]) = (&a.placed[..], &b.placed[..])
            && !(a.has_facets() || b.has_facets())
        {
            // Their bounds are the robots' bounds.
            self.compared += 1;
            let moves = first.body.is_some() || second.body.is_some();
            let is_whole = !(moves && filter.allows(first, second))
                || (!self.is_interrupted(interrupt)
                    && self.pair([0; 2], [a, b], [first, second], &facets, interrupt, &mut found));
            self.near_facets = facets;
            return is_whole;
        }
        // Only the colliders near the other robot, each with each.
        let mut near = std::mem::take(&mut self.near);
        let [near_b, near_a] = &mut near;
        a.near(&b.bounds, near_b);
        b.near(&a.bounds, near_a);
        self.compared += (near_b.len() * near_a.len()) as u64;
        facets.look(0, a, near_b, &b.bounds);
        facets.look(1, b, near_a, &a.bounds);
        let is_whole = near_b.iter().all(|&i| {
            let first = &a.placed[i];
            let first_bounds = facets.bounds(0, i).unwrap_or(&first.bounds);
            near_a.iter().all(|&j| {
                let second = &b.placed[j];
                let moves = first.body.is_some() || second.body.is_some();
                let meet = moves && first_bounds.meets(facets.bounds(1, j).unwrap_or(&second.bounds));
                let may_touch = meet && filter.allows(first, second);
                !may_touch
                    || (!self.is_interrupted(interrupt)
                        && self.pair([i, j], [a, b], [first, second], &facets, interrupt, &mut found))
            })
        });
        self.near = near;
        self.near_facets = facets;
        is_whole
    }

    /// Returns whether to stop. Call it for each pair of colliders.
    pub(super) fn is_interrupted(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        self.since_asked += 1;
        let asks = self.since_asked >= BETWEEN_INTERRUPTS;
        if asks {
            self.since_asked = 0;
        }
        asks && interrupt()
    }

    /// Like [`between`](Self::between) for two colliders, with the known triangles near robots.
    pub(super) fn pair(
        &mut self,
        colliders: [usize; 2],
        robots: [&RobotColliders; 2],
        [a, b]: [&Placed; 2],
        near: &NearFacets,
        interrupt: &dyn Fn() -> bool,
        found: &mut impl FnMut(ContactPoint),
    ) -> bool {
        let within = a.within(b);
        if a.sphere_gap(b) >= within {
            return true;
        }
        let [frame_a, frame_b] = [0, 1].map(|side| &robots[side].frames[colliders[side]]);
        let a_from_b = || frame_a.world_from_shape.inverse() * frame_b.world_from_shape;
        let normal = if a.is_ball && b.is_ball {
            // There may be thousands: their shapes need not be fetched.
            self.find_balls([a.radius, b.radius], &a_from_b(), within)
        } else {
            let (shape_a, shape_b) = (robots[0].shape(a), robots[1].shape(b));
            if far_above((shape_a, frame_a), b, within) || far_above((shape_b, frame_b), a, within) {
                return true;
            }
            let facets = [robots[0].facets(a), robots[1].facets(b)];
            if facets.iter().any(Option::is_some) {
                return self.touch_facets(colliders, (robots, facets), [a, b], near, interrupt, found);
            }
            let hulls = [robots[0].shape_and_graph(a), robots[1].shape_and_graph(b)];
            self.find(hulls, &a_from_b(), within)
        };
        let Some(normal) = normal else { return true };
        if let ([(on_a, _), ..], [on_b, ..], false) =
            (&self.points[..], &self.opposite[..], a.is_ball && b.is_ball)
        {
            let shapes = [robots[0].shape_and_graph(a), robots[1].shape_and_graph(b)];
            if is_seam(shapes, &a_from_b(), [*on_a, *on_b], normal, seam_height([a.radius, b.radius])) {
                return true;
            }
        }
        let mut kept = [0; MAX_POINTS];
        let mut count = reduce(&self.points, normal, &mut kept);
        let rolls_on_lines =
            || [robots[0].shape(a), robots[1].shape(b)].into_iter().all(|shape| !is_capsule(shape));
        if count == 2 && needs_middle([0, 1].map(|i| self.points[kept[i]].0)) && rolls_on_lines() {
            let [(p, d), (q, e)] = [0, 1].map(|i| self.points[kept[i]]);
            let opposite = self.opposite[kept[0]].midpoint(self.opposite[kept[1]]);
            kept[2] = self.points.len();
            count = 3;
            self.points.push((p.midpoint(q), 0.5 * (d + e)));
            self.opposite.push(opposite);
        }
        let world_normal = frame_a.world_from_shape.rotation * normal;
        for &i in &kept[..count] {
            let (on_a, distance) = self.points[i];
            let point = frame_a.world_from_shape.transform_point(on_a + normal * (distance / 2.0));
            found(ContactPoint {
                colliders,
                links: [a.link, b.link],
                bodies: [a.body, b.body],
                on: [on_a, self.opposite[i]],
                position: point,
                normal: world_normal,
                distance,
                surface: frame_a.surface.against(frame_b.surface, self.combination),
            });
        }
        true
    }

    /// Like [`pair`](Self::pair) if one of the two consists of triangles. Two such surfaces touch nothing:
    /// movable shapes are convex.
    fn touch_facets(
        &mut self,
        colliders: [usize; 2],
        (robots, facets): ([&RobotColliders; 2], [Option<Facets<'_>>; 2]),
        sides @ [a, b]: [&Placed; 2],
        near: &NearFacets,
        interrupt: &dyn Fn() -> bool,
        found: &mut impl FnMut(ContactPoint),
    ) -> bool {
        let (first, surface) = match facets {
            [Some(surface), None] => (0, surface),
            [None, Some(surface)] => (1, surface),
            _ => return true,
        };
        let other = sides[1 - first];
        let frames = [0, 1].map(|side| &robots[side].frames[colliders[side]]);
        let (fixed, of_other) = (frames[first], frames[1 - first]);
        let surface_from_shape = relative(&fixed.world_from_shape, &of_other.world_from_shape);
        let (shape, graph) = robots[1 - first].shape_and_graph(other);
        let shape = Convex {
            shape,
            graph,
            middle: of_other.middle,
            radius: other.radius,
            local_box: robots[1 - first].local_box(other),
            bounds: other.bounds.seen_from(&fixed.world_from_shape),
        };
        let (within, known) = (a.within(b), near.triangles(first, colliders[first]));
        let combination = self.combination;
        let Some(points) = self.facets.find((surface, known), &shape, &surface_from_shape, within, interrupt)
        else {
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
                surface: frames[0].surface.against(frames[1].surface, combination),
            });
        }
        true
    }

    /// Writes the contact point of two balls. Returns the normal, in the first one's axes.
    fn find_balls(&mut self, radii: [f64; 2], a_from_b: &DPose3, within: f64) -> Option<DVec3> {
        let [a, b] = radii.map(Ball::new);
        self.manifold.points.clear();
        contact_manifold_ball_ball(a_from_b, &a, &b, within, &mut self.manifold);
        self.take_points(DVec3::ZERO, within);
        (!self.points.is_empty()).then_some(self.manifold.local_n1)
    }

    /// Writes the contact points. Returns the normal, in the first shape's axes.
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
            outermost_beyond((b, graph_b), (inward, true), least, |point, radius| {
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
            outermost_beyond((a, graph_a), (-normal, true), least, |point, radius| {
                let height = (point - a_from_b.translation).dot(normal);
                if height - radius < within {
                    self.points.push((point - normal * radius, height - radius));
                    self.opposite.push(a_from_b.inverse_transform_point(point - normal * height));
                }
            });
            return Some(-normal);
        }
        let sides = [(a, graph_a), (b, graph_b)];
        let mut normal = self.clip(sides, a_from_b, within)?;
        let count = self.corners(within);
        self.take_points(DVec3::ZERO, within);
        if count < MAX_POINTS && has_faces(a) && has_faces(b) {
            // If edges of two faces coincide to rounding, parry misses corners inside and crossings of edges,
            // or finds a corner twice. For exactly stacked boxes it finds three of four corners, two or none.
            let (u, v) = normal.any_orthonormal_pair();
            let aside = (u * 0.83 + v * 0.55) * MAX_TIE;
            let moved = DPose3::from_parts(a_from_b.translation + aside, a_from_b.rotation);
            let again = self.clip(sides, &moved, within);
            if let Some(again) = again.filter(|_| self.corners(within) > count) {
                normal = again;
                self.take_points(a_from_b.rotation.inverse() * aside, within);
            }
        }
        (!self.points.is_empty()).then_some(normal)
    }

    /// Computes a manifold with parry. Returns the normal, in the first shape's axes, if the shapes are
    /// within the distance.
    fn clip(
        &mut self,
        sides: [(&dyn Shape, Option<&Graph>); 2],
        a_from_b: &DPose3,
        within: f64,
    ) -> Option<DVec3> {
        clip_convex(sides, None, a_from_b, within, &mut self.manifold)?;
        let normal = self.manifold.local_n1;
        (normal != DVec3::ZERO).then_some(normal)
    }

    /// Returns the number of the manifold's points that are distinct.
    fn corners(&self, within: f64) -> usize {
        let points = &self.manifold.points;
        let near = points.iter().enumerate().filter(|(_, point)| point.dist < within);
        near.filter(|(i, point)| {
            let same =
                |other: &DVec3| other.distance_squared(point.local_p1) < MERGE_DISTANCE * MERGE_DISTANCE;
            !points[..*i].iter().any(|other| other.dist < within && same(&other.local_p1))
        })
        .count()
    }

    /// Copies the points of the manifold, which was found with the second shape displaced by `moved`, in its
    /// axes.
    fn take_points(&mut self, moved: DVec3, within: f64) {
        self.points.clear();
        self.opposite.clear();
        for point in self.manifold.points.iter().filter(|point| point.dist < within) {
            self.points.push((point.local_p1, point.dist));
            self.opposite.push(point.local_p2 + moved);
        }
    }
}

/// Returns whether parry clips faces of a shape.
fn has_faces(shape: &dyn Shape) -> bool {
    matches!(
        shape.shape_type(),
        ShapeType::Cuboid | ShapeType::ConvexPolyhedron | ShapeType::Cylinder | ShapeType::Cone
    )
}

/// Returns whether a shape is a plane, and the sphere around another one is well above it. The bounds of a
/// plane are all of space, and reject nothing.
fn far_above((shape, plane): (&dyn Shape, &Frame), other: &Placed, within: f64) -> bool {
    shape.as_halfspace().is_some_and(|half| {
        let normal = plane.world_from_shape.rotation * half.normal;
        let height = (other.world_middle - plane.world_from_shape.translation).dot(normal);
        height - other.radius > within
    })
}

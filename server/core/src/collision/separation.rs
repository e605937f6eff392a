//! Distance of two shapes, or a lower bound of their overlap. It uses only GJK, which takes a hundredth of
//! the time that EPA needs for a depth.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::details::{
    closest_points_support_map_support_map, intersection_test_support_map_support_map,
};
use rapier3d_f64::parry::query::{ClosestPoints, DefaultQueryDispatcher, QueryDispatcher as _};
use rapier3d_f64::parry::shape::{Shape, SupportMap, TypedShape};

use super::plane::outermost;

/// Parts by which shapes are shrunk, in turn, to show that they overlap: the last ones show little more than
/// the overlap itself.
const PARTS: [f64; 6] = [0.25, 0.03, 4e-3, 5e-4, 6e-5, 8e-6];

/// Ball inside a shape, in the shape's axes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Inner {
    middle: DVec3,
    radius: f64,
}

impl Inner {
    /// Returns a ball about the centre, which need not be the largest one.
    pub(super) fn of(shape: &dyn Shape) -> Self {
        let (middle, radius) = match shape.as_typed_shape() {
            TypedShape::Ball(ball) => (DVec3::ZERO, ball.radius),
            TypedShape::Capsule(capsule) => ((capsule.segment.a + capsule.segment.b) / 2.0, capsule.radius),
            TypedShape::Cuboid(cuboid) => (DVec3::ZERO, cuboid.half_extents.min_element()),
            TypedShape::Cylinder(cylinder) => (DVec3::ZERO, cylinder.radius.min(cylinder.half_height)),
            TypedShape::Cone(cone) => {
                // The largest one: it touches the base and the side.
                let slant = cone.radius.hypot(2.0 * cone.half_height);
                let radius = 2.0 * cone.half_height * cone.radius / (cone.radius + slant);
                (DVec3::Y * (radius - cone.half_height), radius)
            }
            TypedShape::ConvexPolyhedron(hull) => {
                let points = hull.points();
                let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
                let way = |normal: DVec3| {
                    let far = points.iter().map(|point| (point - middle).dot(normal));
                    far.fold(f64::NEG_INFINITY, f64::max)
                };
                let radius = hull.faces().iter().map(|face| way(face.normal)).fold(f64::INFINITY, f64::min);
                // parry merges some faces that are nearly in one plane.
                (middle, if radius.is_finite() { 0.9 * radius.max(0.0) } else { 0.0 })
            }
            _ => (DVec3::ZERO, 0.0),
        };
        Self { middle, radius }
    }

    pub(super) fn radius(&self) -> f64 {
        self.radius
    }
}

/// A shape and a ball inside it.
#[derive(Clone, Copy)]
pub(super) struct Solid<'a> {
    pub(super) shape: &'a dyn Shape,
    pub(super) inner: &'a Inner,
}

impl<'a> Solid<'a> {
    fn shrunk(self, part: f64) -> Option<Shrunk<'a>> {
        Some(Shrunk { shape: self.shape.as_support_map()?, middle: self.inner.middle, part })
    }
}

/// A shape shrunk about the centre of the ball inside it. A convex shape contains, around each remaining
/// point, a ball of `1 - part` times the inner radius. It is the sum of itself times `part` and of itself
/// times `1 - part`.
struct Shrunk<'a> {
    shape: &'a dyn SupportMap,
    middle: DVec3,
    part: f64,
}

impl SupportMap for Shrunk<'_> {
    fn local_support_point(&self, direction: DVec3) -> DVec3 {
        self.middle + (self.shape.local_support_point(direction) - self.middle) * self.part
    }
}

/// Returns the distance of two shapes, metres. If they overlap, returns minus a lower bound of the depth: no
/// smaller displacement in any direction would separate them.
pub(super) fn separation(a: Solid<'_>, b: Solid<'_>, a_from_b: &DPose3) -> f64 {
    if let Some(height) = plane_separation(a.shape, b.shape, a_from_b) {
        return height;
    }
    if [a.shape, b.shape].iter().any(|shape| shape.as_composite_shape().is_some()) {
        // Triangles have no inside: their overlap has no known depth.
        return DefaultQueryDispatcher
            .distance(a_from_b, a.shape, b.shape)
            .map_or(0.0, |found| found.distance);
    }
    let radii = a.inner.radius + b.inner.radius;
    let middles = (a_from_b.transform_point(b.inner.middle)).distance(a.inner.middle);
    if middles < radii / 2.0 {
        return middles - radii;
    }
    let (Some(first), Some(second)) = (a.shape.as_support_map(), b.shape.as_support_map()) else {
        return 0.0;
    };
    match closest_points_support_map_support_map(a_from_b, first, second, f64::MAX) {
        ClosestPoints::WithinMargin(on_a, on_b) => on_a.distance(a_from_b.transform_point(on_b)),
        // GJK gave up.
        ClosestPoints::Disjoint => 0.0,
        ClosestPoints::Intersecting => {
            let shown = PARTS.iter().find(|part| overlap_shrunk(a, b, a_from_b, **part));
            shown.map_or(0.0, |part| -part * radii)
        }
    }
}

/// Returns whether two shapes provably overlap by this depth. Long shapes may do so without proof.
pub(super) fn overlap_by(depth: f64, a: Solid<'_>, b: Solid<'_>, a_from_b: &DPose3) -> bool {
    if let Some(height) = plane_separation(a.shape, b.shape, a_from_b) {
        return height < -depth;
    }
    let part = depth / (a.inner.radius + b.inner.radius);
    part < 1.0 && overlap_shrunk(a, b, a_from_b, part)
}

fn overlap_shrunk(a: Solid<'_>, b: Solid<'_>, a_from_b: &DPose3, part: f64) -> bool {
    match (a.shrunk(1.0 - part), b.shrunk(1.0 - part)) {
        (Some(a), Some(b)) => intersection_test_support_map_support_map(a_from_b, &a, &b),
        _ => false,
    }
}

/// Returns the height of one above the other if one is a plane.
fn plane_separation(a: &dyn Shape, b: &dyn Shape, a_from_b: &DPose3) -> Option<f64> {
    if let Some(plane) = a.as_halfspace() {
        return Some(height(b, a_from_b, plane.normal));
    }
    b.as_halfspace().map(|plane| height(a, &a_from_b.inverse(), plane.normal))
}

/// Returns the height of a shape's lowest point above a plane through the origin; infinite if it has none.
fn height(shape: &dyn Shape, plane_from_shape: &DPose3, normal: DVec3) -> f64 {
    let inward = plane_from_shape.rotation.inverse() * -normal;
    let mut lowest = f64::INFINITY;
    outermost(shape, inward, |point, radius| {
        lowest = lowest.min(plane_from_shape.transform_point(point).dot(normal) - radius);
    });
    lowest
}

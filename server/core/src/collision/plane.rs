//! Contacts of a shape with a half-space: its deepest corners, among all corners.
//!
//! parry uses one face of at most four corners, which a foot with a round sole rolls off.

use glamx::DVec3;
use rapier3d_f64::parry::shape::{Shape, TypedShape};

use super::hull::Graph;

/// Additional distance from a plane within which corners of a hull are searched, metres.
pub(super) const ROUNDING: f64 = 1e-9;

/// Like [`outermost`], for a shape that may be a hull with a graph, without corners that lie less than
/// `least` along the direction. On a `plane`, a leaning round shape has only the points of its rim. On
/// triangles it has all points, since a triangle may end between those of the rim.
pub(super) fn outermost_beyond(
    (shape, graph): (&dyn Shape, Option<&Graph>),
    (direction, plane): (DVec3, bool),
    least: f64,
    mut found: impl FnMut(DVec3, f64),
) {
    match (graph, shape.as_convex_polyhedron()) {
        (Some(graph), Some(hull)) => {
            graph.beyond(hull.points(), direction, least, |point| found(point, 0.0));
        }
        _ => {
            tips(shape, direction, &mut found);
            if !plane || is_flat(direction) {
                corners(shape, direction, &mut found);
            }
        }
    }
}

/// Calls `found` with each point of a shape, in its own axes, that may touch in `direction`, and with a
/// radius around the point.
pub(super) fn outermost(shape: &dyn Shape, direction: DVec3, mut found: impl FnMut(DVec3, f64)) {
    tips(shape, direction, &mut found);
    corners(shape, direction, &mut found);
}

/// Returns whether a shape that is round about y may stand on its base, tilted by at most three degrees.
/// Beyond that it rolls on its rim, and corners there would take the load as they come by.
fn is_flat(direction: DVec3) -> bool {
    direction.x.hypot(direction.z) < 0.05 * direction.length()
}

/// Finds four points of the base that a round shape stands on; they do not depend on the tilt.
fn corners(shape: &dyn Shape, direction: DVec3, found: &mut impl FnMut(DVec3, f64)) {
    let (radius, base) = match shape.as_typed_shape() {
        TypedShape::Cylinder(cylinder) => (cylinder.radius, cylinder.half_height.copysign(direction.y)),
        TypedShape::Cone(cone) if direction.y < 0.0 => (cone.radius, -cone.half_height),
        _ => return,
    };
    for corner in [DVec3::X, DVec3::Z, -DVec3::X, -DVec3::Z] {
        found(corner * radius + DVec3::Y * base, 0.0);
    }
}

/// Finds the other points.
fn tips(shape: &dyn Shape, direction: DVec3, found: &mut impl FnMut(DVec3, f64)) {
    match shape.as_typed_shape() {
        TypedShape::Ball(ball) => found(DVec3::ZERO, ball.radius),
        TypedShape::Capsule(capsule) => {
            found(capsule.segment.a, capsule.radius);
            found(capsule.segment.b, capsule.radius);
        }
        TypedShape::Cuboid(cuboid) => {
            let side = |i: u32, bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            for i in 0..8 {
                found(cuboid.half_extents * DVec3::new(side(i, 0), side(i, 1), side(i, 2)), 0.0);
            }
        }
        TypedShape::Cylinder(cylinder) => {
            let (radius, half) = (cylinder.radius, cylinder.half_height);
            let outward = DVec3::new(direction.x, 0.0, direction.z).normalize_or(DVec3::X);
            for end in [-half, half] {
                found(outward * radius + DVec3::Y * end, 0.0);
            }
        }
        TypedShape::Cone(cone) => {
            let (radius, half) = (cone.radius, cone.half_height);
            // The apex, and the lowest point of the base: on its side, a cone touches along a line.
            found(DVec3::Y * half, 0.0);
            let outward = DVec3::new(direction.x, 0.0, direction.z).normalize_or(DVec3::X);
            found(outward * radius - DVec3::Y * half, 0.0);
        }
        TypedShape::ConvexPolyhedron(hull) => hull.points().iter().for_each(|point| found(*point, 0.0)),
        _ => {}
    }
}

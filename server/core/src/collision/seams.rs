//! Seams: if shapes form one surface side by side, the edge between them stops nothing.
//!
//! A shape that slides over a surface lies some micrometres deep in it. It meets the side of the next shape
//! over no more than that depth, with a normal along the surface. Such a contact would stop it. If the shape
//! lies on or above another face at that edge, the face carries it and the contact is dropped.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::{Shape, SupportMap as _, Triangle, TypedShape};

use super::facets::{Facets, unit_normal};
use super::hull::Graph;
use super::hull_support::HullSupport;

/// Largest height of an edge that stops nothing, metres: a step of 0.05 mm, and the depth of a shape at rest.
const HEIGHT: f64 = 7e-5;

/// Largest part of a shape's radius that counts as such a height: a grain is not passed over because it is
/// small.
const PART: f64 = 0.01;

/// Cosine between a contact's normal and a face within which it is the face's normal, or a shape tips over
/// its edge: 0.3 degrees.
const SAME_FACE: f64 = 0.999_987;

/// Maximum number of faces that meet in a point; for hulls with more, the first ones count.
const FACES: usize = 8;

/// A convex shape, with the edges of a hull of many corners.
pub(super) type ConvexShape<'a> = (&'a dyn Shape, Option<&'a Graph>);

/// Returns the height over which an edge of one of two shapes of these radii stops nothing, metres.
pub(super) fn seam_height(radii: [f64; 2]) -> f64 {
    HEIGHT.min(PART * radii[0].min(radii[1]))
}

/// Returns whether a contact is with an edge that stops nothing. It is an edge of either shape, if the other
/// one lies on a face at that edge. `on` are points on each shape and `normal` is the first one's outward
/// normal, each in the axes of that point's shape. A plane has no edge, and lies on no face.
pub(super) fn is_seam(
    [a, b]: [ConvexShape<'_>; 2],
    a_from_b: &DPose3,
    on: [DVec3; 2],
    normal: DVec3,
    height: f64,
) -> bool {
    if [a, b].into_iter().any(|(shape, _)| shape.as_halfspace().is_some()) {
        return false;
    }
    passes(a, on[0], normal, height, || (b, *a_from_b))
        || passes(b, on[1], a_from_b.rotation.inverse() * -normal, height, || (a, a_from_b.inverse()))
}

/// Returns whether the other shape passes over the edge of a shape at a contact. Its pose is in the axes of
/// the shape.
fn passes<'a>(
    shape: ConvexShape<'_>,
    point: DVec3,
    normal: DVec3,
    height: f64,
    other: impl Fn() -> (ConvexShape<'a>, DPose3),
) -> bool {
    let mut faces = [(DVec3::ZERO, 0.0); FACES];
    let count = faces_at(shape.0, point, height, &mut faces);
    count > 1
        && faces[..count].iter().any(|&(face, offset)| {
            normal.dot(face) < SAME_FACE && {
                let (other, pose) = other();
                lowest(other, &pose, face).is_some_and(|lowest| (lowest - offset).abs() <= height)
            }
        })
}

/// Returns whether a shape passes over an edge of a triangle at a contact. The faces of a surface at an edge
/// are the triangle and the one beyond it, if they form no hollow. All is in the axes of the surface.
pub(super) fn passes_edge(
    surface: Facets<'_>,
    (id, triangle): (u32, &Triangle),
    (point, normal): (DVec3, DVec3),
    shape: ConvexShape<'_>,
    pose: &DPose3,
    height: f64,
) -> bool {
    let Some(own) = unit_normal(triangle) else { return false };
    let carries = |face: DVec3, at: DVec3| {
        normal.dot(face) < SAME_FACE
            && lowest(shape, pose, face).is_some_and(|lowest| (lowest - at.dot(face)).abs() <= height)
    };
    let sides: &[f64] = if matches!(surface, Facets::Field(_)) { &[1.0] } else { &[1.0, -1.0] };
    let corners = [triangle.a, triangle.b, triangle.c];
    (0..3).any(|edge| {
        let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
        let along = (to - from).normalize_or_zero();
        if (point - from).cross(along).length_squared() > height * height {
            return false;
        }
        let Some(next) = surface.beyond(id, edge) else {
            return sides.iter().any(|side| carries(own * *side, from));
        };
        let Some(other) = unit_normal(&next) else { return false };
        // The outward normals of the two faces: each has the other face below it.
        let middle = (next.a + next.b + next.c) / 3.0 - from;
        let outward = own * if middle.dot(own) > 0.0 { -1.0 } else { 1.0 };
        let beyond = other * if (corners[(edge + 2) % 3] - from).dot(other) > 0.0 { -1.0 } else { 1.0 };
        let is_ridge = sides.len() > 1 || own.dot(outward) > 0.0;
        is_ridge && (carries(outward, from) || carries(beyond, from))
    })
}

/// Returns the least coordinate of a convex shape along a direction, in the axes of its pose.
pub(super) fn lowest((shape, graph): ConvexShape<'_>, pose: &DPose3, direction: DVec3) -> Option<f64> {
    let down = pose.rotation.inverse() * -direction;
    let point = match HullSupport::of(shape, graph) {
        Some(hull) => hull.local_support_point(down),
        None => shape.as_support_map()?.local_support_point(down),
    };
    Some(pose.transform_point(point).dot(direction))
}

/// Writes the faces of a shape near a point: their outward normals and offsets along them. Returns their
/// number.
fn faces_at(shape: &dyn Shape, point: DVec3, near: f64, faces: &mut [(DVec3, f64); FACES]) -> usize {
    let mut count = 0;
    let mut add = |normal: DVec3, offset: f64| {
        if (point.dot(normal) - offset).abs() <= near && count < FACES {
            faces[count] = (normal, offset);
            count += 1;
        }
    };
    match shape.as_typed_shape() {
        TypedShape::Cuboid(cuboid) => {
            for axis in 0..3 {
                let side = 1.0f64.copysign(point[axis]);
                add(DVec3::AXES[axis] * side, cuboid.half_extents[axis]);
            }
        }
        TypedShape::Cylinder(cylinder) => {
            add(DVec3::Y * 1.0f64.copysign(point.y), cylinder.half_height);
            add(DVec3::new(point.x, 0.0, point.z).normalize_or_zero(), cylinder.radius);
        }
        TypedShape::Cone(cone) => {
            add(-DVec3::Y, cone.half_height);
            let outward = DVec3::new(point.x, 0.0, point.z).normalize_or_zero();
            let side = outward * (2.0 * cone.half_height) + DVec3::Y * cone.radius;
            let side = side.normalize();
            add(side, side.y * cone.half_height);
        }
        TypedShape::ConvexPolyhedron(hull) => {
            for face in hull.faces() {
                let corner = hull.vertices_adj_to_face()[face.first_vertex_or_edge as usize];
                add(face.normal, face.normal.dot(hull.points()[corner as usize]));
            }
        }
        _ => {}
    }
    count
}

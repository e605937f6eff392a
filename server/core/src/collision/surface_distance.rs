//! Nearest points and overlaps of a convex shape and a surface of triangles. Surfaces may have a million
//! triangles, so both end as soon as they are cancelled.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume as _};
use rapier3d_f64::parry::query::details::contact_support_map_support_map;
use rapier3d_f64::parry::query::{Contact, intersection_test};
use rapier3d_f64::parry::shape::{Shape, SupportMap, Triangle};

use super::convex_contact::convex_contact;
use super::facets::{Facets, above, unit_normal};
use super::plane::outermost;

/// Number of triangles between two calls of `is_cancelled`.
const BETWEEN_CANCELS: usize = 1_024;

/// Returns the nearest points of a surface and a convex shape that is at most `within` from it. The normal
/// leads from the first to the second; all is in the surface's axes. Below a height field, the depth is
/// measured from the triangle above the shape's centre. An overlap with a height field is not resolved
/// downwards. Returns `None` if they are farther apart, or `is_cancelled`.
///
/// Triangles are tested in the order of their bounds' distance from the shape's, until no other one can be
/// nearer. The distance between any two points of the two limits the search.
pub(super) fn nearest_on_surface(
    surface: Facets<'_>,
    shape: &dyn Shape,
    surface_from_shape: &DPose3,
    within: f64,
    is_cancelled: &dyn Fn() -> bool,
) -> Option<Contact> {
    let middle = surface_from_shape.transform_point(shape.compute_local_bounding_sphere().center);
    if let Some(triangle) = triangle_above(surface, middle) {
        return below(&triangle, shape, surface_from_shape).filter(|found| found.dist <= within);
    }
    let on_surface = surface.near(middle)?;
    let on_shape = shape.project_point(surface_from_shape, on_surface, true).point;
    // A little more, so that a shape exactly at the distance is found.
    let mut limit = within.max(0.0).min(on_surface.distance(on_shape)) * (1.0 + 1e-9) + 1e-9;
    let around = shape.compute_aabb(surface_from_shape);
    let mut ids = Vec::new();
    surface.within(&around.loosened(limit), &mut ids);
    let gap = |id: u32| {
        let triangle = surface.triangle(id)?;
        let gap = gap(&triangle_bounds(&triangle), &around);
        (gap <= limit).then_some((gap, id))
    };
    let mut nearest: Vec<(f64, u32)> = ids.into_iter().filter_map(gap).collect();
    nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best: Option<Contact> = None;
    for (count, (gap, id)) in nearest.into_iter().enumerate() {
        if count % BETWEEN_CANCELS == 0 && is_cancelled() {
            return None;
        }
        if gap > limit {
            break;
        }
        let Some(triangle) = surface.triangle(id) else { continue };
        if best.is_some_and(|best| is_farther(&triangle, (shape, surface_from_shape), &best)) {
            continue;
        }
        let sides = [(&triangle as &dyn Shape, &DPose3::IDENTITY), (shape, surface_from_shape)];
        let Some(mut found) = convex_contact(sides, limit) else { continue };
        if matches!(surface, Facets::Field(_)) && found.dist < 0.0 && found.normal1.y < 0.0 {
            found = out_of_ground(&triangle, (shape, surface_from_shape)).unwrap_or(found);
        }
        if best.is_none_or(|best| found.dist < best.dist) {
            limit = limit.min(found.dist.max(0.0));
            best = Some(found);
        }
    }
    best.filter(|found| found.dist <= within)
}

/// Returns whether a convex shape overlaps a surface, or is below it if it is a height field; `false` once
/// `is_cancelled`.
pub(super) fn overlaps_surface(
    surface: Facets<'_>,
    shape: &dyn Shape,
    surface_from_shape: &DPose3,
    is_cancelled: &dyn Fn() -> bool,
) -> bool {
    let middle = surface_from_shape.transform_point(shape.compute_local_bounding_sphere().center);
    if triangle_above(surface, middle).is_some() {
        return true;
    }
    let around = shape.compute_aabb(surface_from_shape);
    let mut ids = Vec::new();
    surface.within(&around, &mut ids);
    let mut count = 0;
    let mut going = ids.into_iter().take_while(|_| {
        count += 1;
        count % BETWEEN_CANCELS != 0 || !is_cancelled()
    });
    going.any(|id| {
        let near = surface.triangle(id).filter(|triangle| triangle_bounds(triangle).intersects(&around));
        near.is_some_and(|triangle| {
            let found = intersection_test(&DPose3::IDENTITY, &triangle, surface_from_shape, shape);
            found.is_ok_and(|found| found.intersecting)
        })
    })
}

fn triangle_above(surface: Facets<'_>, middle: DVec3) -> Option<Triangle> {
    match surface {
        Facets::Field(field) => above(field, middle),
        Facets::Mesh(..) => None,
    }
}

/// Returns the point of a shape that is deepest below the plane of a height field's triangle, if its centre
/// is below the triangle.
fn below(triangle: &Triangle, shape: &dyn Shape, surface_from_shape: &DPose3) -> Option<Contact> {
    let normal = unit_normal(triangle)?;
    let inward = surface_from_shape.rotation.inverse() * -normal;
    let mut lowest: Option<(f64, DVec3)> = None;
    outermost(shape, inward, |point, radius| {
        let at = surface_from_shape.transform_point(point) - normal * radius;
        let height = (at - triangle.a).dot(normal);
        if lowest.is_none_or(|(least, _)| height < least) {
            lowest = Some((height, at));
        }
    });
    let (height, at) = lowest?;
    Some(Contact::new(at - normal * height, at, normal, -normal, height))
}

/// Triangle of a height field with the ground below it.
struct Column {
    triangle: Triangle,
    /// Lower end, along parry's y.
    bottom: f64,
}

impl SupportMap for Column {
    fn local_support_point(&self, direction: DVec3) -> DVec3 {
        let Triangle { a, b, c } = self.triangle;
        let end = |corner: DVec3| if direction.y < 0.0 { corner.with_y(self.bottom) } else { corner };
        let [a, b, c] = [a, b, c].map(end);
        let farther = |p: DVec3, q: DVec3| if q.dot(direction) > p.dot(direction) { q } else { p };
        farther(farther(a, b), c)
    }
}

/// Returns the shortest displacement that separates a shape from a triangle that it overlaps and from the
/// ground below. For a triangle without ground, the way down could be shorter, as for a plate through which a
/// hill stands.
fn out_of_ground(triangle: &Triangle, (shape, surface_from_shape): (&dyn Shape, &DPose3)) -> Option<Contact> {
    let own = triangle_bounds(triangle);
    let around = shape.compute_aabb(surface_from_shape);
    // So deep that each way down is longer than the one up.
    let height = own.maxs.y - own.mins.y + around.maxs.y - around.mins.y;
    let column = Column { triangle: *triangle, bottom: own.mins.y.min(around.mins.y) - height };
    let support = shape.as_support_map()?;
    let mut found = contact_support_map_support_map(surface_from_shape, &column, support, 0.0)?;
    found.transform_by_mut(&DPose3::IDENTITY, surface_from_shape);
    let is_sound = found.dist.is_finite() && found.point1.is_finite() && found.point2.is_finite();
    (is_sound && found.normal1.is_finite()).then_some(found)
}

/// Returns whether a triangle is at least as far from a shape as the best result, by the plane between the
/// best points.
fn is_farther(
    triangle: &Triangle,
    (shape, surface_from_shape): (&dyn Shape, &DPose3),
    found: &Contact,
) -> bool {
    let normal = found.normal1;
    let Some(support) = shape.as_support_map() else { return false };
    let least = support.support_point(surface_from_shape, -normal).dot(normal);
    let most = [triangle.a, triangle.b, triangle.c].map(|corner| corner.dot(normal));
    let most = most.into_iter().fold(f64::NEG_INFINITY, f64::max);
    found.dist > 0.0 && least - most >= found.dist
}

/// Returns the box around a triangle.
pub(super) fn triangle_bounds(triangle: &Triangle) -> Aabb {
    let Triangle { a, b, c } = *triangle;
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

/// Returns the distance of two boxes.
pub(super) fn gap(a: &Aabb, b: &Aabb) -> f64 {
    (b.mins - a.maxs).max(a.mins - b.maxs).max(DVec3::ZERO).length()
}

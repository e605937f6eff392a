//! First contact of a convex shape with a height field on a straight path.
//!
//! parry's cast looks beyond the grid for the whole length of the path. On a path of constant height it looks
//! no farther than below the shape. Everything below the surface is in the ground, as for overlaps.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume as _};
use rapier3d_f64::parry::query::{ShapeCastOptions, ShapeCastStatus, cast_shapes};
use rapier3d_f64::parry::shape::{HeightField, Shape};

use super::facets::{Facets, above, ground};
use super::first_touch::{ShapeHit, first_touch};
use super::surface_distance::{nearest_on_surface, overlaps_surface, triangle_bounds};

/// Number of triangles between two calls of `is_cancelled`.
const BETWEEN_CANCELS: usize = 256;

/// Margin of boxes, metres, and as a part of their size: far above rounding.
const ROUNDING: f64 = 1e-9;

/// Options of casts: up to the end of the path, and from its start if shapes overlap there.
pub(super) const OPTIONS: ShapeCastOptions = ShapeCastOptions {
    max_time_of_impact: 1.0,
    target_distance: 0.0,
    stop_at_penetration: true,
    compute_impact_geometry_on_penetration: true,
};

/// Returns the first contact of a convex shape that moves by `way` with a field or its ground, all in the
/// field's axes. Also returns `None` once `is_cancelled`.
pub(super) fn cast_at_field(
    field: &HeightField,
    shape: &dyn Shape,
    field_from_shape: &DPose3,
    way: DVec3,
    is_cancelled: &dyn Fn() -> bool,
) -> Option<ShapeHit> {
    shape.as_support_map()?;
    let surface = Facets::Field(field);
    let middle = field_from_shape.transform_point(shape.compute_local_bounding_sphere().center);
    if ground(field).intersects(&shape.compute_aabb(field_from_shape))
        && overlaps_surface(surface, shape, field_from_shape, is_cancelled)
    {
        let nearest = nearest_on_surface(surface, shape, field_from_shape, 0.0, is_cancelled);
        let (point, normal) = nearest.map_or((middle, DVec3::Y), |found| (found.point1, found.normal1));
        return Some(ShapeHit { fraction: 0.0, point, normal });
    }
    let from_beside = enter_ground(field, middle, way);
    let from_above = first_triangle(field, (shape, field_from_shape), way, is_cancelled);
    match (from_beside, from_above) {
        (Some(beside), Some(above)) => Some(if above.fraction <= beside.fraction { above } else { beside }),
        (beside, above) => beside.or(above),
    }
}

/// Returns where a point outside of the ground enters it through one of its sides or from below.
fn enter_ground(field: &HeightField, from: DVec3, way: DVec3) -> Option<ShapeHit> {
    let ground = ground(field);
    let (fraction, _) = times_within(&ground, from, way)?;
    let point = (from + way * fraction).clamp(ground.mins, ground.maxs);
    above(field, point)?;
    // The sides have no triangles with a normal.
    Some(ShapeHit { fraction, point, normal: -way.normalize_or_zero() })
}

/// Returns the first contact with the triangles of the surface. The path is divided into pieces, each with
/// the triangles below it: after a contact within a piece the rest is skipped.
fn first_triangle(
    field: &HeightField,
    (shape, field_from_shape): (&dyn Shape, &DPose3),
    way: DVec3,
    is_cancelled: &dyn Fn() -> bool,
) -> Option<ShapeHit> {
    let start = shape.compute_aabb(field_from_shape);
    let half = start.half_extents();
    // From a distance of the shape's size: parry may miss a contact of a cast that begins while the two
    // touch.
    let near = field.root_aabb().add_half_extents(2.0 * half);
    let (begin, end) = times_within(&near, start.center(), way)?;
    let from = DPose3::from_parts(field_from_shape.translation + way * begin, field_from_shape.rotation);
    let (around, along) = (shape.compute_aabb(&from), way * (end - begin));
    let reach = half * (1.0 + ROUNDING) + DVec3::splat(ROUNDING);
    let pieces = pieces(field, half, along);
    let mut best: Option<ShapeHit> = None;
    let mut ids: Vec<u32> = Vec::new();
    let mut looked_at = 0;
    for piece in 0..pieces {
        let [first, last] = [piece, piece + 1].map(|at| at as f64 / pieces as f64);
        if best.is_some_and(|best| best.fraction <= first) {
            break;
        }
        let swept = around.translated(along * first).merged(&around.translated(along * last));
        ids.clear();
        field.map_elements_in_local_aabb(&swept.loosened(ROUNDING), &mut |id, _triangle| ids.push(id));
        for &id in &ids {
            if looked_at % BETWEEN_CANCELS == 0 && is_cancelled() {
                return None;
            }
            looked_at += 1;
            let Some(triangle) = field.triangle_at_id(id) else { continue };
            let limit = best.map_or(1.0, |best| best.fraction);
            let grown = triangle_bounds(&triangle).add_half_extents(reach);
            let times = times_within(&grown, around.center(), along);
            if times.is_none_or(|(enters, _)| enters > limit) {
                continue;
            }
            let hit = cast_shapes(&DPose3::IDENTITY, DVec3::ZERO, &triangle, &from, along, shape, OPTIONS);
            let Ok(Some(hit)) = hit else { continue };
            let is_sound = hit.status != ShapeCastStatus::Failed && hit.time_of_impact.is_finite();
            if is_sound && best.is_none_or(|best| hit.time_of_impact < best.fraction) {
                let fraction = hit.time_of_impact.clamp(0.0, 1.0);
                let still = (&triangle as &dyn Shape, &DPose3::IDENTITY);
                let touched = first_touch(still, (shape, &from), along, fraction);
                let cast = ShapeHit { fraction, point: hit.witness1, normal: hit.normal1 };
                best = Some(touched.unwrap_or(cast));
            }
        }
    }
    best.map(|hit| ShapeHit { fraction: begin + (end - begin) * hit.fraction, ..hit })
}

/// Returns the number of pieces of a path: each as long as a cell, or as the shape. There are not many more
/// than the grid has cells on a side, since only the path near the field counts.
fn pieces(field: &HeightField, half: DVec3, along: DVec3) -> usize {
    let of = |along: f64, cell: f64, half: f64| along.abs() / cell.max(2.0 * half);
    let [x, z] = [of(along.x, field.cell_width(), half.x), of(along.z, field.cell_height(), half.z)];
    x.max(z).ceil().max(1.0) as usize
}

/// Returns the first and last part of a path, 0 to 1, within a box; `None` if it does not enter it.
fn times_within(bounds: &Aabb, from: DVec3, way: DVec3) -> Option<(f64, f64)> {
    let least = (bounds.mins - from).to_array();
    let most = (bounds.maxs - from).to_array();
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for ((least, most), way) in least.into_iter().zip(most).zip(way.to_array()) {
        if way == 0.0 {
            if least > 0.0 || most < 0.0 {
                return None;
            }
            continue;
        }
        let (a, b) = (least / way, most / way);
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    (first <= last).then_some((first, last))
}

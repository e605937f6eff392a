//! Overlaps of a shape, and its first contact on a straight path.

use std::collections::BTreeSet;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume as _};
use rapier3d_f64::parry::query::{ShapeCastStatus, cast_shapes, intersection_test};
use rapier3d_f64::parry::shape::Shape;

use super::facets::relative;
use super::field_cast::{OPTIONS, cast_at_field};
use super::first_touch::{ShapeHit, first_touch};
use super::rays::RayHit;
use super::scene::{PlacedShape, QueryShape, Scene};
use super::surface_distance::overlaps_surface;

/// Smallest length of a path, metres.
const SHORTEST: f64 = 1e-9;

/// Order of hits: the fraction, and the robot and its collider.
type HitOrder = (f64, (usize, usize));

impl Scene {
    /// Returns robots and links that overlap a shape, in order. With `bounds_only`, those whose boxes along
    /// the world's axes meet the shape's. Everything below a height field is inside it. Stops as soon as
    /// `is_cancelled`.
    pub fn overlaps(
        &self,
        shape: &QueryShape,
        pose: DPose3,
        bounds_only: bool,
        is_cancelled: &dyn Fn() -> bool,
    ) -> BTreeSet<(usize, usize)> {
        let pose = pose * shape.own_from_shape;
        let bounds = shape.shape.compute_aabb(&pose);
        let near = self.near(&bounds).take_while(|_| !is_cancelled());
        let overlapping = near.filter(|placed| {
            if bounds_only && !placed.is_plane() {
                return placed.bounds.intersects(&bounds);
            }
            let theirs = &placed.world_from_shape;
            placed.facets().map_or_else(
                || {
                    let found = intersection_test(&pose, &*shape.shape, theirs, &*placed.shape);
                    found.is_ok_and(|found| found.intersecting)
                },
                |surface| overlaps_surface(surface, &*shape.shape, &relative(theirs, &pose), is_cancelled),
            )
        });
        overlapping.map(|placed| (placed.robot, placed.link)).collect()
    }

    /// Returns the first contact of a shape that moves by `way` from a pose, without turning. A shape that
    /// overlaps something at the start meets it there, as does a shape below a height field. At equal
    /// positions the first robot and its first shape count.
    pub fn cast_shape(
        &self,
        shape: &QueryShape,
        pose: DPose3,
        way: DVec3,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Option<RayHit> {
        let pose = pose * shape.own_from_shape;
        let start = shape.shape.compute_aabb(&pose);
        let swept = start.merged(&Aabb::new(start.mins + way, start.maxs + way));
        let mut first: Option<(HitOrder, RayHit)> = None;
        for placed in self.near(&swept).take_while(|_| !is_cancelled()) {
            let theirs = &placed.world_from_shape;
            let hit = match placed.shape.as_heightfield() {
                Some(field) => {
                    let their_way = theirs.rotation.inverse() * way;
                    let from = relative(theirs, &pose);
                    cast_at_field(field, &*shape.shape, &from, their_way, is_cancelled)
                }
                None => cast_at(placed, &*shape.shape, &pose, way),
            };
            let Some(hit) = hit else { continue };
            let key = (hit.fraction, placed.key());
            if first.as_ref().is_some_and(|(known, _)| *known <= key) {
                continue;
            }
            let normal = theirs.rotation * hit.normal;
            let found = RayHit {
                robot: placed.robot,
                link: placed.link,
                fraction: hit.fraction,
                point: theirs.transform_point(hit.point),
                normal: if normal.is_finite() { normal } else { -way.normalize_or_zero() },
            };
            first = Some((key, found));
        }
        first.map(|(_, hit)| hit)
    }
}

/// Returns the contact of a shape that moves by `way` with one that is not a height field, in the axes of the
/// latter.
fn cast_at(placed: &PlacedShape, shape: &dyn Shape, pose: &DPose3, way: DVec3) -> Option<ShapeHit> {
    let theirs = &placed.world_from_shape;
    // parry finds no overlap if nothing moves.
    let way = if way.length() < SHORTEST { DVec3::Z * SHORTEST } else { way };
    let hit = cast_shapes(pose, way, shape, theirs, DVec3::ZERO, &*placed.shape, OPTIONS).ok()??;
    if hit.status == ShapeCastStatus::Failed || !hit.time_of_impact.is_finite() {
        return None;
    }
    let fraction = hit.time_of_impact.clamp(0.0, 1.0);
    let cast = ShapeHit { fraction, point: hit.witness2, normal: hit.normal2 };
    // The contact with a plane is exact, and overlaps at the start are met there.
    if placed.is_plane() || fraction == 0.0 {
        return Some(cast);
    }
    let triangle = placed.shape.as_trimesh().map(|mesh| mesh.triangle(hit.subshape2));
    let still: &dyn Shape = match &triangle {
        Some(triangle) => triangle,
        None => &*placed.shape,
    };
    let moving = (shape, &relative(theirs, pose));
    let touched = first_touch((still, &DPose3::IDENTITY), moving, theirs.rotation.inverse() * way, fraction);
    Some(touched.unwrap_or(cast))
}

//! Ray casts on the shapes of robots, placed at their links' poses.

use std::cell::Cell;

use glamx::DVec3;
use rapier3d_f64::parry::query::Ray;

use super::scene::{PlacedShape, Scene};

/// Hit of a ray on a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Robot, as passed to [`posed_shapes`](super::scene::posed_shapes).
    pub robot: usize,
    /// Link, by index.
    pub link: usize,
    /// Part of the path from the ray's start to its end, 0 to 1.
    pub fraction: f64,
    /// Point, world.
    pub point: DVec3,
    /// Outward normal of the surface, world.
    pub normal: DVec3,
}

/// Difference of fractions below which both shapes are tested, so that the choice of the first does not
/// depend on the tree.
const EQUAL_DISTANCE: f64 = 1e-12;

/// Order of hits: fraction, robot and its collider, and index in the scene; the least is the first.
type HitOrder = (f64, (usize, usize), usize);

impl Scene {
    /// Returns the first hit on the path from `from` to `to`, world points, of shapes that are `is_wanted`. A
    /// path that starts inside a shape hits it at its start. At equal positions the first robot and its first
    /// shape count.
    pub fn cast(&self, from: DVec3, to: DVec3, is_wanted: impl Fn(&PlacedShape) -> bool) -> Option<RayHit> {
        let way = to - from;
        let ray = Ray::new(from, way);
        let (_, _, index) = self.first(&ray, is_wanted)?;
        let placed = self.shapes.get(index)?;
        let meets =
            |ray: &Ray| placed.shape.cast_ray_and_get_normal(&placed.world_from_shape, ray, 1.0, true);
        let hit = beside(placed, &ray, meets)?;
        Some(RayHit {
            robot: placed.robot,
            link: placed.link,
            fraction: hit.time_of_impact,
            point: from + way * hit.time_of_impact,
            normal: outward(hit.normal, way),
        })
    }

    /// Returns the part of the path from `from` to `to` up to the first hit. Without the normal it costs
    /// half.
    pub fn fraction(&self, from: DVec3, to: DVec3, is_wanted: impl Fn(&PlacedShape) -> bool) -> Option<f64> {
        self.first(&Ray::new(from, to - from), is_wanted).map(|(fraction, ..)| fraction)
    }

    fn first(&self, ray: &Ray, is_wanted: impl Fn(&PlacedShape) -> bool) -> Option<HitOrder> {
        let first: Cell<Option<HitOrder>> = Cell::new(None);
        let meets = |index: usize, most: f64| {
            let placed = self.shapes.get(index).filter(|placed| is_wanted(placed))?;
            let meets = |ray: &Ray| placed.shape.cast_ray(&placed.world_from_shape, ray, most.min(1.0), true);
            let fraction = beside(placed, ray, meets)?;
            let this = (fraction, placed.key(), index);
            if first.get().is_none_or(|known| this < known) {
                first.set(Some(this));
            }
            Some(fraction + EQUAL_DISTANCE * (1.0 + fraction))
        };
        // The end of the path counts, and parry's search accepts only hits before its limit.
        let mut most = 1.0 + EQUAL_DISTANCE;
        for index in self.bounded..self.shapes.len() {
            most = meets(index, most).map_or(most, |fraction| fraction.min(most));
        }
        self.tree.cast_ray(ray, most, |leaf, most| meets(leaf as usize, most));
        first.get()
    }
}

/// Displacement of additional rays, as a part of the coordinates of the start.
const RAY_OFFSET: f64 = 1e-10;

/// Returns the hit of a ray. Through a corner or along an edge of triangles it can pass between them by
/// rounding. Then the first hit of three rays close around it counts.
fn beside<T>(placed: &PlacedShape, ray: &Ray, meets: impl Fn(&Ray) -> Option<T>) -> Option<T> {
    let met = meets(ray);
    if met.is_some() || !placed.is_surface() {
        return met;
    }
    let along = ray.dir.normalize_or_zero();
    if along == DVec3::ZERO {
        return met;
    }
    let (first, second) = (along.any_orthonormal_vector(), along.cross(along.any_orthonormal_vector()));
    let far = RAY_OFFSET * (1.0 + ray.origin.abs().max_element());
    let around = [(1.0, 0.0), (-0.5, 0.75), (-0.5, -0.75)];
    around.iter().find_map(|(a, b)| meets(&Ray::new(ray.origin + far * (*a * first + *b * second), ray.dir)))
}

/// Returns the normal of a hit. A ray may be so long that its hit rounds to a ball's centre, which has no
/// normal: the result then opposes the ray.
fn outward(normal: DVec3, way: DVec3) -> DVec3 {
    if normal.is_finite() { normal } else { -way.normalize_or_zero() }
}

//! What a ray hits.

use glamx::DVec3;
use parry3d_f64::query::Ray;

use super::RobotColliders;

/// Where a ray meets a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Index of the link.
    pub link: usize,
    /// The part of the way from the ray's start to its end, 0 to 1.
    pub fraction: f64,
    /// World.
    pub point: DVec3,
    /// Out of the surface, world.
    pub normal: DVec3,
}

/// The first hit of the way from `from` to `to`, world points, with a robot's colliders. A way
/// that starts inside a shape hits it at its start.
pub fn cast(robot: &RobotColliders, from: DVec3, to: DVec3) -> Option<RayHit> {
    let way = to - from;
    let ray = Ray::new(from, way);
    let mut best: Option<RayHit> = None;
    for placed in &robot.placed {
        let most = best.map_or(1.0, |hit| hit.fraction);
        let shape = robot.shape(placed);
        let Some(hit) = shape.cast_ray_and_get_normal(&placed.world_from_shape, &ray, most, true) else {
            continue;
        };
        if best.is_none_or(|best| hit.time_of_impact < best.fraction) {
            best = Some(RayHit {
                link: placed.link,
                fraction: hit.time_of_impact,
                point: from + way * hit.time_of_impact,
                normal: hit.normal,
            });
        }
    }
    best
}

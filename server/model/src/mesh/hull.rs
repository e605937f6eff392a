//! Convex hulls of vertices.
//!
//! Computing a hull may take time and memory in the square of the vertices: 20,000 on two circles took a
//! minute and 14 GB.

use glamx::DVec3;

use super::Triangles;
use crate::limits;

/// Maximum number of vertices for a hull: half a second and 700 MB at worst.
pub(crate) const MAX_VERTICES: usize = 3_000;

/// Reason why there is no hull.
#[derive(Debug)]
pub(crate) enum NoHull {
    /// There are too many vertices.
    Corners(String),
    /// The vertices lie in one plane, are fewer than four, or have too large coordinates.
    Volume,
}

/// Returns vertices and triangles of the hull.
pub(crate) fn of_corners(corners: &[DVec3]) -> Result<Triangles, NoHull> {
    let count = corners.len();
    if count > MAX_VERTICES {
        let why = format!(
            "it has {count} corners and no face; the limit is {MAX_VERTICES}: their convex hull is computed"
        );
        return Err(NoHull::Corners(why));
    }
    let is_near = |corner: &DVec3| corner.abs().max_element() <= limits::MAGNITUDE;
    if count < 4 || !corners.iter().all(is_near) {
        return Err(NoHull::Volume);
    }
    let hull = parry3d_f64::transformation::try_convex_hull(corners).map_err(|_| NoHull::Volume)?;
    // Vertices in one plane have a hull with two sides.
    if has_volume(&hull) { Ok(hull) } else { Err(NoHull::Volume) }
}

fn has_volume((corners, faces): &Triangles) -> bool {
    let Some(origin) = corners.first() else { return false };
    let corner = |index: u32| corners.get(index as usize).map_or(DVec3::ZERO, |corner| corner - origin);
    let volume: f64 = faces.iter().map(|[a, b, c]| corner(*a).dot(corner(*b).cross(corner(*c))) / 6.0).sum();
    let size = corners.iter().map(|each| each.distance(*origin)).fold(0.0, f64::max);
    volume > 1e-12 * size.powi(3)
}

/// Returns the farthest points in `directions` directions, each once. The directions are spread evenly over
/// the sphere (a Fibonacci lattice). Their hull lies within the hull of all points.
pub fn extremes(points: &[DVec3], directions: usize) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let mut kept: Vec<usize> = (0..directions)
        .filter_map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / directions as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let direction = DVec3::new(across * cos, across * sin, z);
            let along = |index: usize| points.get(index).map_or(0.0, |point| point.dot(direction));
            (0..points.len()).max_by(|a, b| along(*a).total_cmp(&along(*b)))
        })
        .collect();
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().filter_map(|index| points.get(index).copied()).collect()
}

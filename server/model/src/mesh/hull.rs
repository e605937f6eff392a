//! The convex hull of corners without faces.

use glamx::DVec3;

use super::Triangles;
use crate::limits;

/// Corners of which a hull is computed.
const MOST: usize = 20_000;

/// Why there is none.
#[derive(Debug)]
pub(crate) enum NoHull {
    /// There are too many.
    Corners(String),
    /// They are in one plane, or not in space.
    Volume,
}

/// Corners and triangles of the hull.
pub(crate) fn of_corners(corners: &[DVec3]) -> Result<Triangles, NoHull> {
    let count = corners.len();
    if count > MOST {
        let why =
            format!("it has {count} corners and no face; the most is {MOST}: their convex hull is computed");
        return Err(NoHull::Corners(why));
    }
    let is_near = |corner: &DVec3| corner.abs().max_element() <= limits::MAGNITUDE;
    if count < 4 || !corners.iter().all(is_near) {
        return Err(NoHull::Volume);
    }
    let hull = parry3d_f64::transformation::try_convex_hull(corners).map_err(|_| NoHull::Volume)?;
    // Corners in one plane have a hull of two sides.
    if has_volume(&hull) { Ok(hull) } else { Err(NoHull::Volume) }
}

fn has_volume((corners, faces): &Triangles) -> bool {
    let Some(origin) = corners.first() else { return false };
    let corner = |index: u32| corners.get(index as usize).map_or(DVec3::ZERO, |corner| corner - origin);
    let volume: f64 = faces.iter().map(|[a, b, c]| corner(*a).dot(corner(*b).cross(corner(*c))) / 6.0).sum();
    let size = corners.iter().map(|each| each.distance(*origin)).fold(0.0, f64::max);
    volume > 1e-12 * size.powi(3)
}

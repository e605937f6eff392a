//! Simplification of hulls: some corners whose convex hull is nearly the hull of many points. It bounds the
//! cost of a contact with a hull, and the time to make one.

use glamx::DVec3;
use rapier3d_f64::parry::transformation::try_convex_hull;
use simd_model::extremes;

/// Largest distance of corners outside of the simpler hull's faces, if [`MAX_POINTS`] corners are enough for it. It
/// is a part of half the longest side of their box.
pub(super) const TOLERANCE: f64 = 5e-3;

/// Maximum number of corners of a simpler hull. A ball of 30,000 corners is within two and a half times
/// [`TOLERANCE`] with this number.
const MAX_POINTS: usize = 512;

/// Number of initial directions whose extreme corners are taken.
const FIRST: usize = 32;

/// Number of directions whose extreme corners replace points without a computable hull.
const DIRECTIONS: usize = 256;

/// Number of points above which only the farthest from the centre in each direction are used.
const MANY: usize = 20_000;

/// Number of cells along each side of a cube's face that distinguish directions.
const SIDE: usize = 64;

/// Returns corners among the points, and the largest distance of any other point outside of their hull's
/// faces, metres.
///
/// It starts with a few, and adds the farthest point beyond each face until none is farther than the
/// tolerance. See Barber, Dobkin and Huhdanpaa, "The Quickhull algorithm for convex hulls" (1996), ended
/// early.
pub(super) fn simplified(points: &[DVec3]) -> (Vec<DVec3>, f64) {
    let Some(first) = points.first() else { return (Vec::new(), 0.0) };
    let (least, most) = points.iter().fold((*first, *first), |(l, m), point| (l.min(*point), m.max(*point)));
    let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
    let tolerance = TOLERANCE * half.max_element();
    let mut outside = candidates(points, middle);
    let mut kept = extremes(points, FIRST);
    loop {
        let Some(planes) = planes(&kept) else {
            let kept = extremes(points, DIRECTIONS);
            let error =
                planes_of_all(&kept).map_or(half.length(), |planes| farthest_outside(points, &planes));
            return (kept, error);
        };
        let mut beyond: Vec<(f64, DVec3)> = vec![(tolerance, DVec3::ZERO); planes.len()];
        // A point inside stays inside of all later hulls.
        outside.retain(|point| {
            let (face, height) = highest(*point, &planes);
            if height > beyond[face].0 {
                beyond[face] = (height, *point);
            }
            height > 0.0
        });
        beyond.retain(|(height, _)| *height > tolerance);
        if beyond.is_empty() || kept.len() >= MAX_POINTS {
            let error = farthest_outside(points, &planes);
            return (kept, error);
        }
        beyond.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Not all at once: one may cover the next.
        let some = (kept.len() / 2).min(MAX_POINTS - kept.len()).max(1);
        kept.extend(beyond.into_iter().take(some).map(|(_, point)| point));
    }
}

/// Plane, as its outward normal and its distance from the origin along it.
type Plane = (DVec3, f64);

fn planes(points: &[DVec3]) -> Option<Vec<Plane>> {
    planes_of_all(points).filter(|planes| !planes.is_empty())
}

/// Returns the planes of a hull's faces, if there is a hull.
fn planes_of_all(points: &[DVec3]) -> Option<Vec<Plane>> {
    let (corners, faces) = try_convex_hull(points).ok()?;
    let plane = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|corner| corners.get(corner as usize).copied().unwrap_or_default());
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some((normal, a.dot(normal)))
    };
    Some(faces.iter().filter_map(plane).collect())
}

/// Returns the plane that a point lies highest above, and the height.
fn highest(point: DVec3, planes: &[Plane]) -> (usize, f64) {
    let mut found = (0, f64::NEG_INFINITY);
    for (index, (normal, along)) in planes.iter().enumerate() {
        let height = point.dot(*normal) - along;
        if height > found.1 {
            found = (index, height);
        }
    }
    found
}

fn farthest_outside(points: &[DVec3], planes: &[Plane]) -> f64 {
    points.iter().map(|point| highest(*point, planes).1).fold(0.0, f64::max)
}

/// Returns all points, or if there are very many, the farthest from the centre in each direction.
fn candidates(points: &[DVec3], middle: DVec3) -> Vec<DVec3> {
    if points.len() <= MANY {
        return points.to_vec();
    }
    let mut cells: Vec<Option<(f64, DVec3)>> = vec![None; 6 * SIDE * SIDE];
    for point in points {
        let way = *point - middle;
        let far = way.length_squared();
        if let Some(cell) = cells.get_mut(super::hull::cell::<SIDE>(way))
            && cell.is_none_or(|(known, _)| far > known)
        {
            *cell = Some((far, *point));
        }
    }
    cells.into_iter().flatten().map(|(_, point)| point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(count: u32, radius: f64) -> Vec<DVec3> {
        let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let corner = |i: u32| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (sin, cos) = (golden * f64::from(i)).sin_cos();
            let across = (1.0 - z * z).sqrt();
            DVec3::new(across * cos, across * sin, z) * radius
        };
        (0..count).map(corner).collect()
    }

    /// Heights above the planes again, here over all pairs.
    fn error(points: &[DVec3], kept: &[DVec3]) -> f64 {
        farthest_outside(points, &planes(kept).unwrap())
    }

    #[test]
    fn a_ball_of_many_corners_keeps_its_form_within_the_tolerance() {
        for count in [2_000, 30_000] {
            let points = ball(count, 0.016);
            let (kept, said) = simplified(&points);
            assert!(kept.len() <= MAX_POINTS && kept.len() > 100, "{}", kept.len());
            assert!((said - error(&points, &kept)).abs() < 1e-15 && said < 2.5 * TOLERANCE * 0.016, "{said}");
            assert!(kept.iter().all(|corner| points.contains(corner)));
        }
    }

    /// A box with a grid of corners on each side needs its eight.
    #[test]
    fn flat_meshes_keep_few_corners() {
        let mut points = Vec::new();
        for i in 0..=20 {
            for j in 0..=20 {
                let (u, v) = (f64::from(i) / 10.0 - 1.0, f64::from(j) / 10.0 - 1.0);
                for side in [-1.0, 1.0] {
                    points.extend([DVec3::new(u, v, side), DVec3::new(u, side, v), DVec3::new(side, u, v)]);
                }
            }
        }
        let (kept, said) = simplified(&points);
        assert!(kept.len() <= FIRST && said < 1e-12, "{} {said}", kept.len());
        for x in [-1.0, 1.0] {
            assert!(kept.contains(&DVec3::new(x, x, x)));
        }
    }

    #[test]
    fn corners_without_a_hull_are_thinned_out() {
        let line: Vec<DVec3> = (0..5_000).map(|i| DVec3::X * f64::from(i)).collect();
        let (kept, _) = simplified(&line);
        assert!(kept.contains(&line[0]) && kept.contains(&line[4_999]) && kept.len() <= DIRECTIONS);
        assert!(simplified(&[]).0.is_empty());
    }
}

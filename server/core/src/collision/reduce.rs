//! Reduction of contacts: four points carry the same load as any number.

use glamx::DVec3;

/// Maximum number of points of one contact.
pub(super) const MAX_POINTS: usize = 4;

/// Weight of depth relative to distance along the surface in the choice of points. A tilted box keeps the
/// touching edge, and a lying one its corners.
const DEPTH_WEIGHT: f64 = 10.0;

/// Distance below which points are one, metres.
pub(super) const MERGE_DISTANCE: f64 = 1e-5;

/// Largest distance of points from the line between the outermost two at which they count as on it, metres.
const LINE_WIDTH: f64 = 1e-5;

/// Smallest length of a line, metres; a shorter one is a point.
const LEAST_LINE: f64 = 1e-4;

/// Selects the points to keep, given by position and distance, all in the axes of the normal. They are the
/// outermost in one direction, the one farthest from it, and those that add the most area on either side of
/// their line. The direction is fixed to the axes, so that a resting contact keeps its points. If the points
/// are on a line, the two ends are kept. Writes their indices.
pub(super) fn reduce(points: &[(DVec3, f64)], normal: DVec3, kept: &mut [usize; MAX_POINTS]) -> usize {
    let count = outermost(points, normal, kept);
    if count > 2
        && let Some(ends) = line_ends(points, &kept[..count])
    {
        kept[..2].copy_from_slice(&ends);
        return 2;
    }
    count
}

/// Returns the two ends of points that lie on a line.
fn line_ends(points: &[(DVec3, f64)], kept: &[usize]) -> Option<[usize; 2]> {
    let first = *kept.first()?;
    let farthest_from = |from: usize| {
        let way = |i: &usize| points[*i].0.distance_squared(points[from].0);
        kept.iter().copied().max_by(|a, b| way(a).total_cmp(&way(b)))
    };
    let end = farthest_from(first)?;
    let other = farthest_from(end)?;
    let (a, b) = (points[end].0, points[other].0);
    let along = (b - a).try_normalize()?;
    let length = a.distance(b);
    // A rim is deepest between two points of its circle.
    let is_on_line = |i: &usize| {
        let (place, distance) = points[*i];
        let part = (place - a).dot(along) / length;
        let off = distance - (points[end].1 + part * (points[other].1 - points[end].1));
        (place - a).cross(along).length() < LINE_WIDTH && off.abs() < LINE_WIDTH
    };
    kept.iter().all(is_on_line).then_some([end, other])
}

/// Returns whether two points are the ends of a line that needs a third point in its middle.
///
/// Friction at two ends holds one of them when a line turns about its normal, so that a wheel would roll at
/// its end. It resists turning with m w N / 2. With a third of the load in the middle, the wheel rolls there,
/// and the resistance is m w N / 3. A line under even load has m w N / 4.
pub(super) fn needs_middle(ends: [DVec3; 2]) -> bool {
    ends[0].distance_squared(ends[1]) > LEAST_LINE * LEAST_LINE
}

/// Like [`reduce`], whether or not the points are on a line.
fn outermost(points: &[(DVec3, f64)], normal: DVec3, kept: &mut [usize; MAX_POINTS]) -> usize {
    let mut count = 0;
    let known = |kept: &[usize], i: usize| {
        kept.iter()
            .any(|&k| k == i || points[k].0.distance_squared(points[i].0) < MERGE_DISTANCE * MERGE_DISTANCE)
    };
    if points.len() <= MAX_POINTS {
        for i in 0..points.len() {
            if !known(&kept[..count], i) {
                kept[count] = i;
                count += 1;
            }
        }
        return count;
    }
    let (u, v) = normal.any_orthonormal_pair();
    // A direction to which few shapes have a perpendicular edge.
    let start = u * 0.83 + v * 0.55;
    let Some((first, a)) = best(points, |_| false, |point| point.dot(start)) else { return 0 };
    kept[0] = first;
    count = 1;
    let Some((second, b)) = best(points, |i| known(&kept[..count], i), |point| point.distance(a)) else {
        return count;
    };
    kept[1] = second;
    count = 2;
    let across = normal.cross(b - a).normalize_or(v);
    for side in [across, -across] {
        if let Some((next, _)) = best(points, |i| known(&kept[..count], i), |point| (point - a).dot(side)) {
            kept[count] = next;
            count += 1;
        }
    }
    count
}

/// Returns the point of the best score and depth, and its index; on ties the last one. `known` is called only
/// for candidates, since there may be a hundred points.
fn best(
    points: &[(DVec3, f64)],
    known: impl Fn(usize) -> bool,
    score: impl Fn(DVec3) -> f64,
) -> Option<(usize, DVec3)> {
    let mut best: Option<(usize, f64)> = None;
    for (i, &(point, distance)) in points.iter().enumerate() {
        let weighed = score(point) - DEPTH_WEIGHT * distance;
        if best.is_none_or(|(_, most)| weighed.total_cmp(&most).is_ge()) && !known(i) {
            best = Some((i, weighed));
        }
    }
    best.map(|(i, _)| (i, points[i].0))
}

//! Four points of contact carry what any number of them would.

use glamx::DVec3;

/// Points of one contact at the most.
pub(super) const MOST: usize = 4;

/// Depth counts this many times what distance along the surface does when points are chosen:
/// of a tilted box the edge that touches, of one that lies flat the corners.
const DEPTH_WEIGHT: f64 = 10.0;

/// Points nearer to each other than this are one, metres.
pub(super) const SAME: f64 = 1e-5;

/// Points that lie beside the line between the outermost two by less than this are on it, metres.
const LINE_WIDTH: f64 = 1e-5;

/// A line shorter than this is a point, metres.
const LEAST_LINE: f64 = 1e-4;

/// Indices of the points that are kept, of points given by place and distance, all in the
/// same axes as the normal: the outermost in one direction, the one farthest from it, and the two
/// that add the most area on either side of the line between them. The direction is fixed to the
/// axes, so that a contact keeps its points while it rests. Of points on a line the two ends.
pub(super) fn reduce(points: &[(DVec3, f64)], normal: DVec3, kept: &mut [usize; MOST]) -> usize {
    let count = outermost(points, normal, kept);
    if count > 2
        && let Some(ends) = line_ends(points, &kept[..count])
    {
        kept[..2].copy_from_slice(&ends);
        return 2;
    }
    count
}

/// The two ends of points that lie on a line.
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

/// Whether two points are the ends of a line that needs a third one in its middle.
///
/// Friction at two ends holds one of them whenever a line turns about its normal, so that a wheel would roll where its end does, and resists
/// turning with m w N / 2. With a third of the load in the middle that is where it rolls, and m w N / 3; a line under even load has m w N / 4.
pub(super) fn needs_middle(ends: [DVec3; 2]) -> bool {
    ends[0].distance_squared(ends[1]) > LEAST_LINE * LEAST_LINE
}

/// As [`reduce`], whether or not the points are on a line.
fn outermost(points: &[(DVec3, f64)], normal: DVec3, kept: &mut [usize; MOST]) -> usize {
    let mut count = 0;
    let known = |kept: &[usize], i: usize| {
        kept.iter().any(|&k| k == i || points[k].0.distance_squared(points[i].0) < SAME * SAME)
    };
    if points.len() <= MOST {
        for i in 0..points.len() {
            if !known(&kept[..count], i) {
                kept[count] = i;
                count += 1;
            }
        }
        return count;
    }
    let (u, v) = normal.any_orthonormal_pair();
    // A direction that few shapes have an edge across.
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

/// The point of the best score and depth, and its index; of equals the last one. What is known is asked only of
/// what would be the best, since there may be a hundred points.
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

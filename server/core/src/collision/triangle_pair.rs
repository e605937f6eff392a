//! Two triangles: the points where they are near each other, and the line in which they cross.

use glamx::DVec3;

/// The corners of a triangle.
pub(super) type Corners = [DVec3; 3];

/// The edges of a triangle, as pairs of corners.
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Squared lengths below this are 0, square metres.
const TINY: f64 = 1e-24;

/// Calls `found` with pairs of points, one on each triangle, that are at most `limit` apart.
///
/// The pairs are the nearest points of each two edges, and each corner with the point of the other triangle straight below
/// it. They include the nearest points of two triangles that do not cross.
pub(super) fn near_points(a: &Corners, b: &Corners, limit: f64, mut found: impl FnMut([DVec3; 2], f64)) {
    let (above_a, above_b) = (heights(a, b), heights(b, a));
    if is_beyond(&above_a, limit) || is_beyond(&above_b, limit) {
        return;
    }
    let mut offer = |on: [DVec3; 2]| {
        let distance = on[0].distance(on[1]);
        if distance <= limit {
            found(on, distance);
        }
    };
    for (corner, height) in b.iter().zip(above_a.1) {
        let below = *corner - above_a.0 * height;
        if height.abs() <= limit && contains(a, above_a.0, below) {
            offer([below, *corner]);
        }
    }
    for (corner, height) in a.iter().zip(above_b.1) {
        let below = *corner - above_b.0 * height;
        if height.abs() <= limit && contains(b, above_b.0, below) {
            offer([*corner, below]);
        }
    }
    for [i, j] in EDGES {
        for [k, l] in EDGES {
            offer(nearest_of_segments([a[i], a[j]], [b[k], b[l]]));
        }
    }
}

/// The ends of the line in which two triangles cross; `None` where they do not, or lie in one plane.
pub(super) fn crossing(a: &Corners, b: &Corners) -> Option<[DVec3; 2]> {
    let (above_a, above_b) = (heights(a, b), heights(b, a));
    if is_beyond(&above_a, 0.0) || is_beyond(&above_b, 0.0) {
        return None;
    }
    let mut points = [DVec3::ZERO; 6];
    let mut count = 0;
    for (edges_of, heights, face, normal) in [(b, above_a.1, a, above_a.0), (a, above_b.1, b, above_b.0)] {
        for [i, j] in EDGES {
            if (heights[i] > 0.0) != (heights[j] > 0.0) {
                let part = heights[i] / (heights[i] - heights[j]);
                let point = edges_of[i].lerp(edges_of[j], part);
                if contains(face, normal, point) {
                    points[count] = point;
                    count += 1;
                }
            }
        }
    }
    let first = *points[..count].first()?;
    let farthest = |from: DVec3| {
        let way = |p: &DVec3| p.distance_squared(from);
        points[..count].iter().copied().max_by(|p, q| way(p).total_cmp(&way(q))).unwrap_or(from)
    };
    let end = farthest(first);
    Some([end, farthest(end)])
}

/// The normal of a triangle, of unit length unless it is a line.
pub(super) fn normal(corners: &Corners) -> DVec3 {
    (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero()
}

/// The normal of a triangle, and how far above its plane the corners of another one are.
fn heights(face: &Corners, other: &Corners) -> (DVec3, [f64; 3]) {
    let normal = normal(face);
    (normal, other.map(|corner| (corner - face[0]).dot(normal)))
}

/// Whether a triangle lies on one side of a plane, farther from it than a distance.
fn is_beyond((normal, heights): &(DVec3, [f64; 3]), distance: f64) -> bool {
    *normal != DVec3::ZERO
        && (heights.iter().all(|height| *height > distance)
            || heights.iter().all(|height| *height < -distance))
}

/// Whether a point of a triangle's plane lies in it.
fn contains(corners: &Corners, normal: DVec3, point: DVec3) -> bool {
    normal != DVec3::ZERO
        && EDGES
            .iter()
            .all(|[i, j]| (corners[*j] - corners[*i]).cross(point - corners[*i]).dot(normal) >= 0.0)
}

/// The nearest points of two segments (Ericson, "Real-Time Collision Detection", 2005, 5.1.9).
fn nearest_of_segments([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> [DVec3; 2] {
    let (along, other, between) = (b - a, d - c, a - c);
    let (aa, bb, f) = (along.length_squared(), other.length_squared(), other.dot(between));
    let (s, t);
    if aa <= TINY {
        s = 0.0;
        t = if bb <= TINY { 0.0 } else { (f / bb).clamp(0.0, 1.0) };
    } else {
        let e = along.dot(between);
        if bb <= TINY {
            t = 0.0;
            s = (-e / aa).clamp(0.0, 1.0);
        } else {
            let ab = along.dot(other);
            let across = aa * bb - ab * ab;
            let first =
                if across > 1e-12 * aa * bb { ((ab * f - e * bb) / across).clamp(0.0, 1.0) } else { 0.0 };
            let second = (ab * first + f) / bb;
            t = second.clamp(0.0, 1.0);
            s = if second == t { first } else { ((ab * t - e) / aa).clamp(0.0, 1.0) };
        }
    }
    [a + along * s, c + other * t]
}

/// The point of a triangle that is nearest to another point (Ericson, 5.1.5).
pub(super) fn nearest_to([a, b, c]: &Corners, point: DVec3) -> DVec3 {
    let (ab, ac, ap) = (*b - *a, *c - *a, point - *a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bp = point - *b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return *a + ab * (d1 / (d1 - d3));
    }
    let cp = point - *c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return *a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return *b + (*c - *b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    *a + ab * (vb / sum) + ac * (vc / sum)
}

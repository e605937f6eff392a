//! Contacts of two moving surfaces of triangles: links of one robot whose convex hulls overlap while their
//! meshes are apart.
//!
//! A contact holds the two surfaces [`SHELL`] apart. So they do not cross, and each contact has the direction
//! between two nearest points; surfaces that cross have no such points. If a fast motion still makes them
//! cross, they are moved along the direction in which their common volume shrinks fastest.

use glamx::{DPose3, DVec3};

use super::facet_contact::{FacetPoint, MAX_PAIR_POINTS, SAME_DIRECTION};
use super::reduce::{MAX_POINTS, MERGE_DISTANCE, reduce};
use super::triangle_pair::{crossing, near_points, normal};
use super::triangle_tree::{TreeScratch, TriangleTree};

/// Surfaces that touch are held this far apart, metres.
pub(super) const SHELL: f64 = 5e-4;

/// Pairs of near points of two surfaces that are looked at. Surfaces that lie flat on each other may have
/// more: then the first ones count.
const MAX_NEAR_PAIRS: usize = 512;

/// Near points are a contact if neither has a nearer one on the other surface, except for this part of their
/// distance.
const NEARER: f64 = 0.05;

/// Minimum of that difference, metres.
const LEAST_NEARER: f64 = 1e-7;

/// The part of a distance that is shown as a bound below it: to show all of it takes longer.
const BOUND: f64 = 0.75;

/// Points that are nearer than this cross, metres: they have no direction.
const CROSSING: f64 = 1e-9;

/// A surface that is cut by less than this part of the cut's length, squared, has no direction out.
const LEAST_AREA: f64 = 1e-6;

/// Finds such points. Keeps its memory, and no more.
#[derive(Debug, Default)]
pub(super) struct SurfaceContact {
    scratch: TreeScratch,
    /// In the first one's axes.
    near: Vec<FacetPoint>,
    /// Lines in which triangles cross.
    lines: Vec<[DVec3; 2]>,
    group: Vec<usize>,
    places: Vec<(DVec3, f64)>,
    kept: Vec<FacetPoint>,
}

impl SurfaceContact {
    /// How far two surfaces are apart, metres: 0 where they cross. If that is more than `exact`, a bound
    /// below it.
    pub(super) fn distance(&mut self, trees: [&TriangleTree; 2], a_from_b: &DPose3, exact: f64) -> f64 {
        let mut least = f64::INFINITY;
        let bound = |least: f64| least.min(exact.max(BOUND * least));
        TriangleTree::visit_pairs(trees, a_from_b, &mut self.scratch, f64::INFINITY, |a, b| {
            near_points(a, b, bound(least), |_, distance| least = least.min(distance));
            if least > 0.0 && crossing(a, b).is_some() {
                least = 0.0;
            }
            bound(least)
        });
        bound(least)
    }

    /// Returns points where two surfaces are nearer than `within` plus [`SHELL`]. A point of each surface is
    /// in that surface's axes. `None` if they cross and have no direction out.
    pub(super) fn find(
        &mut self,
        trees @ [a, b]: [&TriangleTree; 2],
        a_from_b: &DPose3,
        within: f64,
    ) -> Option<&[FacetPoint]> {
        let Self { scratch, near, lines, kept, .. } = self;
        near.clear();
        lines.clear();
        kept.clear();
        let limit = within + SHELL;
        let mut area = DVec3::ZERO;
        let mut origin = None;
        TriangleTree::visit_pairs(trees, a_from_b, scratch, limit, |one, other| {
            near_points(one, other, limit, |[on_a, on_b], distance| {
                let is_known = |known: &FacetPoint| {
                    known.on_surface.distance_squared(on_a) < MERGE_DISTANCE * MERGE_DISTANCE
                        && known.on_shape.distance_squared(on_b) < MERGE_DISTANCE * MERGE_DISTANCE
                };
                if distance > CROSSING && near.len() < MAX_NEAR_PAIRS && !near.iter().any(is_known) {
                    let normal = (on_b - on_a) / distance;
                    near.push(FacetPoint { on_surface: on_a, on_shape: on_b, normal, distance });
                }
            });
            if lines.len() < MAX_NEAR_PAIRS
                && let Some([p, q]) = crossing(one, other)
            {
                // With the part of the first surface that is inside of the second one on its left.
                let along = normal(one).cross(normal(other));
                let [p, q] = if (q - p).dot(along) < 0.0 { [q, p] } else { [p, q] };
                let origin = *origin.get_or_insert(p);
                area += 0.5 * (p - origin).cross(q - origin);
                lines.push([p, q]);
            }
            limit
        });
        near.retain(|point| {
            let least = point.distance - (NEARER * point.distance).max(LEAST_NEARER);
            a.distance_to(point.on_shape, scratch, point.distance) >= least
                && b.distance_to(a_from_b.inverse_transform_point(point.on_surface), scratch, point.distance)
                    >= least
        });
        near.iter_mut().for_each(|point| {
            point.on_surface += point.normal * (0.5 * SHELL);
            point.on_shape -= point.normal * (0.5 * SHELL);
            point.distance -= SHELL;
        });
        near.extend(way_out(lines, area));
        if near.is_empty() && !lines.is_empty() {
            return None;
        }
        self.reduce();
        let b_from_a = a_from_b.inverse();
        self.kept.iter_mut().for_each(|point| point.on_shape = b_from_a.transform_point(point.on_shape));
        Some(&self.kept)
    }

    /// Keeps at most [`MAX_POINTS`] points of each direction.
    fn reduce(&mut self) {
        let Self { near, group, places, kept, .. } = self;
        while kept.len() <= MAX_PAIR_POINTS - MAX_POINTS {
            let deepest = near.iter().min_by(|a, b| a.distance.total_cmp(&b.distance));
            let Some(&FacetPoint { normal, .. }) = deepest else { return };
            group.clear();
            places.clear();
            for (i, point) in near.iter().enumerate() {
                if point.normal.dot(normal) >= SAME_DIRECTION {
                    group.push(i);
                    places.push((point.on_surface, point.distance));
                }
            }
            let mut chosen = [0; MAX_POINTS];
            let count = reduce(places, normal, &mut chosen);
            kept.extend(chosen[..count].iter().map(|&i| near[group[i]]));
            near.retain(|point| point.normal.dot(normal) < SAME_DIRECTION);
        }
    }
}

/// Returns a point in the middle of the line in which surfaces cross, and the direction in which their common
/// volume shrinks fastest. The direction is the area vector of the first surface inside the second one.
fn way_out(lines: &[[DVec3; 2]], area: DVec3) -> Option<FacetPoint> {
    let length: f64 = lines.iter().map(|[p, q]| p.distance(*q)).sum();
    let middle = lines.iter().map(|[p, q]| p.midpoint(*q) * p.distance(*q)).sum::<DVec3>() / length;
    let normal = (area.length() > LEAST_AREA * length * length).then(|| area.normalize())?;
    let half = normal * (0.5 * SHELL);
    Some(FacetPoint { on_surface: middle + half, on_shape: middle - half, normal, distance: -SHELL })
}

//! Nearest points of shapes: distance or penetration depth of links.

use std::collections::BTreeMap;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::{Contact, contact};
use rapier3d_f64::parry::shape::{Segment, Shape};

use super::facets::relative;
use super::plane::outermost;
use super::scene::PlacedShape;
use super::surface_distance::{gap, nearest_on_surface};

/// Maximum number of pairs of shapes whose bounds are compared in one query.
pub const MAX_BOUNDS: usize = 10_000_000;

/// Maximum number of pairs of shapes whose distance is computed in one query.
pub const MAX_DISTANCES: usize = 100_000;

/// Nearest points of two links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Robots, as passed to [`posed_shapes`](super::scene::posed_shapes).
    pub robots: [usize; 2],
    /// Links, by index.
    pub links: [usize; 2],
    /// Point on the surface of each, world.
    pub points: [DVec3; 2],
    /// Unit normal from the first to the second, world.
    pub normal: DVec3,
    /// Distance between the surfaces, metres. If they overlap: minus the length of the shortest displacement
    /// that separates them.
    pub distance: f64,
}

/// Selection of pairs.
#[derive(Clone, Copy, Debug)]
pub struct DistanceFilter {
    /// Maximum distance of a pair, metres; may be infinite.
    pub within: f64,
    /// Whether only the nearest pair is wanted.
    pub nearest_only: bool,
}

/// Number of pairs of shapes that exceeds the maximum, and the maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooMany(pub usize, pub usize);

/// Two shapes, and a lower bound of their bounds' distance.
type Pair<'a> = (f64, &'a PlacedShape, &'a PlacedShape);

/// Returns the nearest points of each pair of links that `is_wanted`, in the order of robots and links. It
/// uses GJK, and EPA if they overlap (van den Bergen, "Collision Detection in Interactive 3D Environments",
/// 2003). Pairs of two triangle surfaces are left out. Stops as soon as `is_cancelled`.
///
/// # Errors
/// Returns an error for more than [`MAX_BOUNDS`] pairs of shapes, or [`MAX_DISTANCES`] near each other. If
/// only the nearest pair is wanted, the latter are pairs whose bounds are nearer to each other than the
/// farthest points of another pair's.
pub fn closest_points(
    [a, b]: [&[PlacedShape]; 2],
    wanted: DistanceFilter,
    is_wanted: impl Fn(&PlacedShape, &PlacedShape) -> bool,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<Vec<Closest>, TooMany> {
    let count = a.len().saturating_mul(b.len());
    if count > MAX_BOUNDS {
        return Err(TooMany(count, MAX_BOUNDS));
    }
    let mut pairs: Vec<Pair<'_>> = Vec::new();
    // Overlapping shapes have bounds that meet, at any depth.
    let mut most_gap = wanted.within.max(0.0);
    for first in a {
        if is_cancelled() {
            return Ok(Vec::new());
        }
        let measured = b.iter().filter(|second| !(first.is_surface() && second.is_surface()));
        let near = measured.map(|second| (bounds_gap(first, second), first, second));
        pairs.extend(near.filter(|(gap, one, other)| *gap <= most_gap && is_wanted(one, other)));
        if pairs.len() > MAX_DISTANCES && wanted.nearest_only {
            most_gap = pairs.iter().map(|(_, one, other)| bounds_span(one, other)).fold(most_gap, f64::min);
            pairs.retain(|(gap, ..)| *gap <= most_gap);
        }
        if pairs.len() > MAX_DISTANCES {
            return Err(TooMany(pairs.len(), MAX_DISTANCES));
        }
    }
    // Likely nearest pairs come first, so that the rest needs no distance.
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1.key(), x.2.key()).cmp(&(y.1.key(), y.2.key()))));
    let mut found: BTreeMap<([usize; 2], [usize; 2]), Closest> = BTreeMap::new();
    let mut nearest = wanted.within;
    for (gap, first, second) in pairs.into_iter().take_while(|_| !is_cancelled()) {
        let key = ([first.robot, second.robot], [first.link, second.link]);
        let known = found.get(&key).map_or(wanted.within, |known| known.distance);
        let within = if wanted.nearest_only { nearest } else { known };
        if gap > within.max(0.0) {
            continue;
        }
        let Some(closest) = closest(first, second, within, is_cancelled) else { continue };
        if closest.distance < known || !found.contains_key(&key) {
            nearest = nearest.min(closest.distance);
            found.insert(key, closest);
        }
    }
    let mut found: Vec<Closest> = found.into_values().collect();
    if wanted.nearest_only {
        let nearest = found.iter().copied().min_by(|x, y| x.distance.total_cmp(&y.distance));
        found = nearest.into_iter().collect();
    }
    Ok(found)
}

/// Returns the distance between the bounds of two shapes; a plane has unlimited bounds.
fn bounds_gap(a: &PlacedShape, b: &PlacedShape) -> f64 {
    if a.is_plane() || b.is_plane() {
        return f64::NEG_INFINITY;
    }
    gap(&a.solid_bounds(), &b.solid_bounds())
}

/// Returns the largest distance between any points of the bounds of two shapes; the shapes are not farther
/// apart.
fn bounds_span(a: &PlacedShape, b: &PlacedShape) -> f64 {
    if a.is_plane() || b.is_plane() {
        return f64::INFINITY;
    }
    let (a, b) = (a.solid_bounds(), b.solid_bounds());
    (b.maxs - a.mins).max(a.maxs - b.mins).length()
}

/// Returns the nearest points of two shapes within a distance.
fn closest(
    a: &PlacedShape,
    b: &PlacedShape,
    within: f64,
    is_cancelled: &dyn Fn() -> bool,
) -> Option<Closest> {
    let robots = [a.robot, b.robot];
    let links = [a.link, b.link];
    if let Some((point, below, normal, distance)) = over_plane(a, b) {
        let found = Closest { robots, links, points: [below, point], normal, distance };
        return (distance <= within).then_some(found);
    }
    if let Some((point, below, normal, distance)) = over_plane(b, a) {
        let found = Closest { robots, links, points: [point, below], normal: -normal, distance };
        return (distance <= within).then_some(found);
    }
    let on_surface = |surface: &PlacedShape, other: &PlacedShape| {
        let surface_from_other = relative(&surface.world_from_shape, &other.world_from_shape);
        let mut found =
            nearest_on_surface(surface.facets()?, &*other.shape, &surface_from_other, within, is_cancelled)?;
        found.transform_by_mut(&surface.world_from_shape, &surface.world_from_shape);
        Some(found)
    };
    let found = match [a.is_surface(), b.is_surface()] {
        [false, false] => {
            convex_contact([(&*a.shape, &a.world_from_shape), (&*b.shape, &b.world_from_shape)], within)
        }
        [true, false] => on_surface(a, b),
        [false, true] => on_surface(b, a).map(Contact::flipped),
        [true, true] => None,
    };
    let found = found.filter(|found| found.dist <= within)?;
    Some(Closest {
        robots,
        links,
        points: [found.point1, found.point2],
        normal: found.normal1,
        distance: found.dist,
    })
}

/// Returns the nearest points of two convex shapes that are about within a distance, in the axes of their
/// poses.
pub(super) fn convex_contact([a, b]: [(&dyn Shape, &DPose3); 2], within: f64) -> Option<Contact> {
    let [(core_a, around_a), (core_b, around_b)] = [core(a.0), core(b.0)];
    let around = around_a + around_b;
    // A little more, so that a shape exactly at the distance is found.
    let margin = (within + around).max(0.0) * (1.0 + 1e-9) + 1e-9;
    let mut found = contact(a.1, core_a, b.1, core_b, margin).ok()??;
    if found.dist > TOUCHING {
        found = refined([(core_a, a.1), (core_b, b.1)], found);
        found.point1 += found.normal1 * around_a;
        found.point2 -= found.normal1 * around_b;
        found.dist -= around;
    } else if let (Some(one), Some(other)) = (core_a.as_segment(), core_b.as_segment()) {
        found = crossing([one, other], [a.1, b.1], found, [around_a, around_b]);
    } else {
        if around > 0.0 {
            found = contact(a.1, a.0, b.1, b.0, 0.0).ok()??;
        }
        found = deeper([a, b], found);
    }
    let is_sound = found.dist.is_finite() && found.point1.is_finite() && found.point2.is_finite();
    (is_sound && found.normal1.is_finite()).then_some(found)
}

/// Returns the contact of two capsules whose segments meet: the shortest way out is perpendicular to both.
fn crossing(
    [one, other]: [&Segment; 2],
    [pose, other_pose]: [&DPose3; 2],
    found: Contact,
    [around, other_around]: [f64; 2],
) -> Contact {
    let along = pose.rotation * (one.b - one.a).normalize_or(DVec3::X);
    let across =
        along.cross(other_pose.rotation * (other.b - other.a)).normalize_or(along.any_orthonormal_vector());
    let (on_one, on_other) = (found.point1 + across * around, found.point2 - across * other_around);
    Contact::new(on_one, on_other, across, -across, -(around + other_around))
}

/// Distance up to which shapes touch, metres: the rounding of a 0, when no depth was found.
const TOUCHING: f64 = 1e-12;

/// Displacements to retry an overlap from, as parts of the smaller shape's size.
const RETRY_OFFSETS: [f64; 4] = [1e-6, 1e-5, 1e-4, 1e-3];

/// Unit directions of these displacements; the last ones are oblique to the axes of most shapes.
const WAYS: [DVec3; 5] =
    [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.48, 0.6, 0.64), DVec3::new(-0.64, 0.48, 0.6)];

/// Retries overlaps of zero depth from displaced poses. If the centres of two shapes lie on an axis of both,
/// EPA may begin with a segment through the origin. It then ends with a depth of 0. Results from displaced
/// poses are right to about a hundredth, as EPA is for round shapes.
fn deeper([a, b]: [(&dyn Shape, &DPose3); 2], found: Contact) -> Contact {
    let size = a.0.compute_local_bounding_sphere().radius.min(b.0.compute_local_bounding_sphere().radius);
    for aside in RETRY_OFFSETS.map(|part| part * size) {
        if !aside.is_finite() || found.dist < -aside {
            break;
        }
        let moved = WAYS.into_iter().filter_map(|axis| {
            let pose = DPose3::from_parts(b.1.translation + axis * aside, b.1.rotation);
            contact(a.1, a.0, &pose, b.0, 0.0).ok()?
        });
        let deepest = moved.min_by(|x, y| x.dist.total_cmp(&y.dist));
        // Shapes that only touch are at most as deep, from a displaced pose, as the displacement.
        if let Some(deepest) = deepest.filter(|deepest| deepest.dist < found.dist - 4.0 * aside) {
            return deepest;
        }
    }
    found
}

/// Returns a core and a radius: the shape is all points within the radius of its core. For a capsule it is
/// its segment, otherwise the shape.
fn core(shape: &dyn Shape) -> (&dyn Shape, f64) {
    match shape.as_capsule() {
        Some(capsule) => (&capsule.segment, capsule.radius),
        None => (shape, 0.0),
    }
}

/// Maximum number of projections of the nearest points onto the other shape.
const REFINEMENTS: usize = 64;

/// Change of a distance below which projection ends, metres.
const SAME_DISTANCE: f64 = 1e-11;

/// Refines nearest points: GJK ends within some 1e-6 m of the distance of round shapes. Each of two convex
/// shapes' nearest points is the projection of the other one. Alternate projections only come nearer (Cheney
/// and Goldstein, "Proximity maps for convex sets", 1959).
fn refined([a, b]: [(&dyn Shape, &DPose3); 2], found: Contact) -> Contact {
    let project =
        |(shape, pose): (&dyn Shape, &DPose3), point: DVec3| shape.project_point(pose, point, true).point;
    let (mut on_a, mut on_b, mut distance) = (found.point1, found.point2, found.dist);
    for _ in 0..REFINEMENTS {
        let next_a = project(a, on_b);
        let next_b = project(b, next_a);
        let next = next_a.distance(next_b);
        // NaN fails this too.
        if next.partial_cmp(&distance) != Some(std::cmp::Ordering::Less) || next == 0.0 {
            break;
        }
        let change = distance - next;
        (on_a, on_b, distance) = (next_a, next_b, next);
        if change < SAME_DISTANCE {
            break;
        }
    }
    let normal = ((on_b - on_a) / distance).normalize_or(found.normal1);
    Contact::new(on_a, on_b, normal, -normal, distance)
}

/// Returns the lowest point of a shape over a plane, the point below it on the plane, the plane's normal and
/// the height. Returns `None` if the first is not a plane, or both are. parry 0.31 inverts the relative pose if
/// the plane comes second.
fn over_plane(plane: &PlacedShape, other: &PlacedShape) -> Option<(DVec3, DVec3, DVec3, f64)> {
    let half = plane.shape.as_halfspace()?;
    let normal = plane.world_from_shape.rotation * half.normal;
    let inward = other.world_from_shape.rotation.inverse() * -normal;
    let mut lowest: Option<(f64, DVec3)> = None;
    outermost(&*other.shape, inward, |point, radius| {
        let on_surface = other.world_from_shape.transform_point(point) - normal * radius;
        let height = (on_surface - plane.world_from_shape.translation).dot(normal);
        if lowest.is_none_or(|(least, _)| height < least) {
            lowest = Some((height, on_surface));
        }
    });
    let (height, point) = lowest?;
    Some((point, point - normal * height, normal, height))
}

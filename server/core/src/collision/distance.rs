//! The nearest points of shapes: how far links are apart, or by how much they overlap.

use std::collections::BTreeMap;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::{Contact, contact};
use rapier3d_f64::parry::shape::{Segment, Shape};

use super::facets::relative;
use super::plane::outermost;
use super::scene::PlacedShape;
use super::surface_distance::{gap, nearest_on_surface};

/// Pairs of shapes whose bounds are looked at in one question.
pub const MOST_BOUNDS: usize = 10_000_000;

/// Pairs of shapes whose distance is computed in one question.
pub const MOST_DISTANCES: usize = 100_000;

/// The nearest points of two links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// As they were given to [`posed_shapes`](super::scene::posed_shapes).
    pub robots: [usize; 2],
    /// Indices of the links.
    pub links: [usize; 2],
    /// On each one's surface, world.
    pub points: [DVec3; 2],
    /// From the first to the second, of unit length, world.
    pub normal: DVec3,
    /// Between the surfaces, metres. Where they overlap: minus the length of the shortest move that parts them.
    pub distance: f64,
}

/// Which pairs are wanted.
#[derive(Clone, Copy, Debug)]
pub struct DistanceFilter {
    /// Pairs that are farther apart are left out, metres; may be infinite.
    pub within: f64,
    /// Only the nearest of all.
    pub nearest_only: bool,
}

/// Too many pairs of shapes: how many, and how many there may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooMany(pub usize, pub usize);

/// Two shapes, and how far their bounds are apart at the least.
type Pair<'a> = (f64, &'a PlacedShape, &'a PlacedShape);

/// The nearest points of each pair of links of which `is_wanted`, in the order of robots and links. By GJK, and EPA
/// where they overlap (van den Bergen, "Collision Detection in Interactive 3D Environments", 2003). Of two surfaces of
/// triangles there are none. Gives up as soon as `is_cancelled`.
///
/// # Errors
/// Returns an error if there are more than [`MOST_BOUNDS`] pairs of shapes, or [`MOST_DISTANCES`] near each other: where only the
/// nearest is wanted, whose bounds are nearer to each other than the farthest points of those of another pair.
pub fn closest_points(
    [a, b]: [&[PlacedShape]; 2],
    wanted: DistanceFilter,
    is_wanted: impl Fn(&PlacedShape, &PlacedShape) -> bool,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<Vec<Closest>, TooMany> {
    let count = a.len().saturating_mul(b.len());
    if count > MOST_BOUNDS {
        return Err(TooMany(count, MOST_BOUNDS));
    }
    let mut pairs: Vec<Pair<'_>> = Vec::new();
    // What overlaps has bounds that meet, however deep it is.
    let mut most_gap = wanted.within.max(0.0);
    for first in a {
        if is_cancelled() {
            return Ok(Vec::new());
        }
        let measured = b.iter().filter(|second| !(first.is_surface() && second.is_surface()));
        let near = measured.map(|second| (bounds_gap(first, second), first, second));
        pairs.extend(near.filter(|(gap, one, other)| *gap <= most_gap && is_wanted(one, other)));
        if pairs.len() > MOST_DISTANCES && wanted.nearest_only {
            most_gap = pairs.iter().map(|(_, one, other)| bounds_span(one, other)).fold(most_gap, f64::min);
            pairs.retain(|(gap, ..)| *gap <= most_gap);
        }
        if pairs.len() > MOST_DISTANCES {
            return Err(TooMany(pairs.len(), MOST_DISTANCES));
        }
    }
    // What is likely to be nearest comes first, so that the rest needs no distance.
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

/// How far the bounds of two shapes are apart; those of a plane are all of space.
fn bounds_gap(a: &PlacedShape, b: &PlacedShape) -> f64 {
    if a.is_plane() || b.is_plane() {
        return f64::NEG_INFINITY;
    }
    gap(&a.solid_bounds(), &b.solid_bounds())
}

/// How far any point of the bounds of two shapes is from any of the other at the most; the shapes are not farther apart.
fn bounds_span(a: &PlacedShape, b: &PlacedShape) -> f64 {
    if a.is_plane() || b.is_plane() {
        return f64::INFINITY;
    }
    let (a, b) = (a.solid_bounds(), b.solid_bounds());
    (b.maxs - a.mins).max(a.maxs - b.mins).length()
}

/// The nearest points of two shapes, where they are within a distance.
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

/// The nearest points of two convex shapes where they are about within a distance, in the axes in which their poses are.
pub(super) fn convex_contact([a, b]: [(&dyn Shape, &DPose3); 2], within: f64) -> Option<Contact> {
    let [(core_a, around_a), (core_b, around_b)] = [core(a.0), core(b.0)];
    let around = around_a + around_b;
    // A little more, so that one at the very distance is found.
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

/// Of two capsules whose segments meet: the shortest way out is across both.
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

/// What is no farther apart touches, metres: a depth that was not found comes with the rounding of a 0.
const TOUCHING: f64 = 1e-12;

/// Parts of the size of the smaller of two shapes that overlap, by which one is moved to be looked at once more.
const ASIDE: [f64; 4] = [1e-6, 1e-5, 1e-4, 1e-3];

/// The ways in which it is moved, of unit length: the last ones are across those of most shapes.
const WAYS: [DVec3; 5] =
    [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.48, 0.6, 0.64), DVec3::new(-0.64, 0.48, 0.6)];

/// What overlaps by nothing is looked at once more from beside: where the middles of two shapes lie on an axis of both, EPA may begin with
/// a segment through the origin, and ends with a depth of 0. What is found beside is right to about a hundredth, as EPA is with round
/// sides.
fn deeper([a, b]: [(&dyn Shape, &DPose3); 2], found: Contact) -> Contact {
    let size = a.0.compute_local_bounding_sphere().radius.min(b.0.compute_local_bounding_sphere().radius);
    for aside in ASIDE.map(|part| part * size) {
        if !aside.is_finite() || found.dist < -aside {
            break;
        }
        let moved = WAYS.into_iter().filter_map(|axis| {
            let pose = DPose3::from_parts(b.1.translation + axis * aside, b.1.rotation);
            contact(a.1, a.0, &pose, b.0, 0.0).ok()?
        });
        let deepest = moved.min_by(|x, y| x.dist.total_cmp(&y.dist));
        // What only touches is as deep from beside as it was moved, at the most.
        if let Some(deepest) = deepest.filter(|deepest| deepest.dist < found.dist - 4.0 * aside) {
            return deepest;
        }
    }
    found
}

/// What a shape is all points within a distance of: the segment of a capsule. Others are themselves.
fn core(shape: &dyn Shape) -> (&dyn Shape, f64) {
    match shape.as_capsule() {
        Some(capsule) => (&capsule.segment, capsule.radius),
        None => (shape, 0.0),
    }
}

/// Projections of the nearest points onto the other shape at the most.
const REFINEMENTS: usize = 64;

/// A change of a distance that is not worth another projection, metres.
const SAME_DISTANCE: f64 = 1e-11;

/// GJK ends within some 1e-6 m of the distance of round shapes. Each of two convex shapes' nearest points is the
/// projection of the other one: projected in turn, they only come nearer (Cheney and Goldstein, "Proximity maps for convex
/// sets", 1959).
fn refined([a, b]: [(&dyn Shape, &DPose3); 2], found: Contact) -> Contact {
    let project =
        |(shape, pose): (&dyn Shape, &DPose3), point: DVec3| shape.project_point(pose, point, true).point;
    let (mut on_a, mut on_b, mut distance) = (found.point1, found.point2, found.dist);
    for _ in 0..REFINEMENTS {
        let next_a = project(a, on_b);
        let next_b = project(b, next_a);
        let next = next_a.distance(next_b);
        // Not where it is no number.
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

/// The lowest point of a shape over a plane, the one below it on the plane, the plane's normal and the height; `None`
/// where the first is no plane, or both are. parry 0.31 takes the pose of the one in the axes of the other the wrong
/// way round where the plane comes second.
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

//! Nearest points of shapes: distance or penetration depth of links.

use std::collections::BTreeMap;

use glamx::DVec3;
use rapier3d_f64::parry::query::Contact;

use super::convex_contact::convex_contact;
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

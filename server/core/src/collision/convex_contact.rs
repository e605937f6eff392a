//! Nearest points of two convex shapes.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::{Contact, contact};
use rapier3d_f64::parry::shape::{Segment, Shape};

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

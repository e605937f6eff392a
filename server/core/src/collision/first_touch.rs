//! First contact of a convex shape that moves in a straight line.
//!
//! parry's casts are accurate to some 1e-6 of the path. Round shapes may slide far along each other within
//! that. A cast that ends within 1e-4 of the path returns the points that were nearest at its start. On a
//! path of hundreds of metres both are centimetres.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::Shape;

use super::convex_contact::convex_contact;

/// Distance before the end of a cast at which the search starts, as a part of the path: far above its error.
const BEFORE: f64 = 1e-5;

/// Distance at which shapes touch, metres: the direction between their nearest points is undefined below it.
/// Farther away it is a part of the coordinates, far above their rounding.
const SURFACE_DISTANCE: f64 = 1e-9;
const ROUNDING: f64 = 1e-12;

/// Maximum number of steps.
const STEPS: usize = 64;

/// Contact of a shape with another one, in the axes of that one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ShapeHit {
    /// Part of the path, 0 to 1.
    pub(super) fraction: f64,
    /// Point on the surface.
    pub(super) point: DVec3,
    /// Outward normal of the surface.
    pub(super) normal: DVec3,
}

/// Returns the first contact of a convex shape that moves by `way` from a pose with another one at rest. The
/// result is in the axes of the two poses. The search starts near the part of the path at which a cast ends.
/// Returns `None` if the two touch or overlap right before that, or if the path ends before.
///
/// The moving shape may advance until its nearest point is in the plane through the other one's, without
/// passing anything. This is conservative advancement: Mirtich, "Impulse-based Dynamic Simulation of Rigid
/// Body Systems" (1996).
pub(super) fn first_touch(
    still: (&dyn Shape, &DPose3),
    (shape, from): (&dyn Shape, &DPose3),
    way: DVec3,
    cast_fraction: f64,
) -> Option<ShapeHit> {
    let near = SURFACE_DISTANCE.max(ROUNDING * (from.translation.length() + way.length() * cast_fraction));
    let mut fraction = (cast_fraction - BEFORE).max(0.0);
    let mut touched: Option<ShapeHit> = None;
    for _ in 0..STEPS {
        let pose = DPose3::from_parts(from.translation + way * fraction, from.rotation);
        let Some(found) = convex_contact([still, (shape, &pose)], f64::INFINITY) else { break };
        let closing = -way.dot(found.normal1);
        // NaN fails both.
        let comes_nearer = found.dist > near && closing > 0.0;
        if !comes_nearer {
            break;
        }
        let step = found.dist / closing;
        fraction += step;
        touched = Some(ShapeHit { fraction, point: found.point2 + way * step, normal: found.normal1 });
    }
    touched.filter(|hit| hit.fraction <= 1.0 && hit.point.is_finite())
}

//! Where a shape that goes straight on first touches another one. parry's casts are right to some 1e-6 of the way. Round shapes go far along each
//! other within that, and what ends within 1e-4 of the way has the points that were nearest at its start: on a way of hundreds of metres
//! both are centimetres.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::Shape;

use super::distance::convex_contact;
use super::field_cast::ShapeHit;

/// It is looked from so much before where a cast ends, as a part of the way: far above its error.
const BEFORE: f64 = 1e-5;

/// Two that are as near as this touch, metres: the way between their nearest points has no direction that could be computed with. Farther
/// away it is a part of the coordinates, far above their rounding.
const NEAR: f64 = 1e-9;
const ROUNDING: f64 = 1e-12;

/// Steps at the most.
const STEPS: usize = 64;

/// Where a convex shape that goes by `way` from a pose first touches another one that does not move, in the axes of the two poses, near
/// the part of the way where a cast ends. `None` where the two are not apart right before that, and where the way ends before they touch.
///
/// The moving one may go on until its nearest point is in the plane through that of the other one, and has passed nothing then: Mirtich,
/// "Impulse-based Dynamic Simulation of Rigid Body Systems" (1996), conservative advancement.
pub(super) fn first_touch(
    still: (&dyn Shape, &DPose3),
    (shape, from): (&dyn Shape, &DPose3),
    way: DVec3,
    cast_fraction: f64,
) -> Option<ShapeHit> {
    let near = NEAR.max(ROUNDING * (from.translation.length() + way.length() * cast_fraction));
    let mut fraction = (cast_fraction - BEFORE).max(0.0);
    let mut touched: Option<ShapeHit> = None;
    for _ in 0..STEPS {
        let pose = DPose3::from_parts(from.translation + way * fraction, from.rotation);
        let Some(found) = convex_contact([still, (shape, &pose)], f64::INFINITY) else { break };
        let closing = -way.dot(found.normal1);
        // Neither is so where it is no number.
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

//! Arcs of points on bodies at constant velocities: the second-order displacement of a step.
//!
//! A step moves a point of a body by h v + h²/2 a, to second order. v is its new velocity, and a = J' qd its
//! acceleration with constant qd (Featherstone eq. 2.45, 3.42). One part of it are the joints' velocity
//! products c, carried to the point. The other is w x v, which converts a spatial acceleration to a point's.
//! A free body's origin moves in a straight line, so its own w x v is subtracted.

use glamx::DVec3;

use super::real::{Real, VectorOf};
use super::scratch::BodyScratch;
use super::spatial::Spatial;
use super::tree::{JointType, Tree};

/// Returns the acceleration of a point of a body with constant velocities, m/s²; base axes. Needs kinematics.
pub(super) fn arc(tree: &Tree, bodies: &[BodyScratch], body: usize, point: DVec3) -> DVec3 {
    let at = &bodies[body];
    let mut sum = of_point(at.velocity, point - at.origin);
    let mut next = Some(body);
    while let Some(i) = next {
        let (body, at) = (&tree.bodies[i], &bodies[i]);
        sum += carried(at.velocity_product, point - at.origin);
        if let JointType::Free { .. } = body.joint_type {
            let above = body.parent.map_or(Spatial::ZERO, |parent| bodies[parent].velocity);
            sum -= straight(at.velocity - above.motion_at(at.reach));
        }
        next = body.parent;
    }
    sum
}

/// Returns w x v of a point at `arm` from the point that `velocity` belongs to.
#[inline(always)]
pub(super) fn of_point<R: Real>(velocity: Spatial<R>, arm: R::Vector) -> R::Vector {
    velocity.angular.cross(velocity.linear + velocity.angular.cross(arm))
}

/// Returns the linear part of a spatial acceleration at a point `arm` away.
#[inline(always)]
pub(super) fn carried<R: Real>(acceleration: Spatial<R>, arm: R::Vector) -> R::Vector {
    acceleration.linear + acceleration.angular.cross(arm)
}

/// Returns the term that a free joint with this velocity subtracts, so that its origin moves in a straight
/// line.
#[inline(always)]
pub(super) fn straight<R: Real>(own: Spatial<R>) -> R::Vector {
    own.angular.cross(own.linear)
}

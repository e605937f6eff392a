//! The arcs that points of bodies go along while velocities are constant: what a step moves a point by beside its velocity.
//!
//! A step moves a point of a body by h v + h²/2 a, to second order, where v is its new velocity and a = J' qd its acceleration with
//! constant qd (Featherstone eq. 2.45, 3.42): the joints' velocity products c, carried to the point, and w x v, which makes a spatial
//! acceleration that of a point. A free body's origin goes straight on, so its own w x v is taken off.

use glamx::DVec3;

use super::real::{Real, VectorOf};
use super::scratch::BodyScratch;
use super::spatial::Spatial;
use super::tree::{JointType, Tree};

/// The acceleration of a point of a body with constant velocities, m/s²; base axes. Needs kinematics.
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

/// w x v of a point that is `arm` away from where the velocity is that of.
#[inline(always)]
pub(super) fn of_point<R: Real>(velocity: Spatial<R>, arm: R::Vector) -> R::Vector {
    velocity.angular.cross(velocity.linear + velocity.angular.cross(arm))
}

/// The linear part of a spatial acceleration at a point that is `arm` away.
#[inline(always)]
pub(super) fn carried<R: Real>(acceleration: Spatial<R>, arm: R::Vector) -> R::Vector {
    acceleration.linear + acceleration.angular.cross(arm)
}

/// What a free joint with this velocity takes off, so that its origin goes straight on.
#[inline(always)]
pub(super) fn straight<R: Real>(own: Spatial<R>) -> R::Vector {
    own.angular.cross(own.linear)
}

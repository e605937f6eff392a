//! Damping of links: their motion decays, as in a medium, whether or not a joint holds them.

use glamx::DMat3;
use serde::{Deserialize, Serialize};
use simd_model::robot::Inertial;

use super::spatial::Spatial;

/// Damping of a link, 1/s.
///
/// It is the law of Bullet's articulated bodies. A link has mass m and inertia I, and its centre of mass
/// moves with v and w. It gets the force -m k v (1 + |v|) and the torque -I k' w (1 + |w|).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkDamping {
    /// k.
    pub linear: f64,
    /// k'.
    pub angular: f64,
}

impl LinkDamping {
    /// Maximum of both.
    pub const MAX: f64 = 1e6;

    /// Returns the force on a link, about its origin, in the axes of its motion. `rotation` turns the link's
    /// axes into those. In a step of `h` seconds the force stops no more than the motion; with `h` = 0 it is
    /// explicit, as in Bullet.
    pub fn force(self, inertial: &Inertial, rotation: &DMat3, motion: Spatial, h: f64) -> Spatial {
        let arm = *rotation * inertial.center_of_mass;
        let velocity = motion.linear + motion.angular.cross(arm);
        let force = velocity * (-inertial.mass * decay(self.linear, velocity.length(), h));
        let in_link = rotation.transpose() * motion.angular;
        let torque =
            *rotation * (inertial.inertia * in_link * -decay(self.angular, motion.angular.length(), h));
        Spatial::new(torque + arm.cross(force), force)
    }
}

/// Returns the part of a motion that an implicit step of `h` seconds loses per second.
fn decay(damping: f64, speed: f64, h: f64) -> f64 {
    let explicit = damping * (1.0 + speed);
    explicit / (1.0 + explicit * h)
}

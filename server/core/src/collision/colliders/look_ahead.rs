//! Distance around moving colliders within which contacts are looked for.

use glamx::DVec3;

use super::Placed;
use crate::dynamics::contact_point::{FASTEST_LOOKED_AHEAD, LOOK_AHEAD};
use crate::dynamics::kinematics::BodyMotion;

impl Placed {
    /// Sets the distance within which contacts are looked for, for this motion of its body, which turns at
    /// `spin` rad/s.
    pub(super) fn look_ahead(&mut self, motion: BodyMotion, spin: f64, slack: f64, h: f64) {
        let BodyMotion { pose, linear, angular } = motion;
        let velocity = linear + angular.cross(self.world_middle - pose.translation);
        let speed = velocity.length() + spin * self.radius;
        let ahead = |speed: f64| slack + LOOK_AHEAD * h * speed;
        self.set_margin(ahead(speed), velocity * (LOOK_AHEAD * h));
        // NaN becomes the bound too.
        self.margin = self.margin.min(ahead(FASTEST_LOOKED_AHEAD));
    }

    /// Sets the distance within which contacts are looked for; `drift` is the part for the motion of its
    /// centre.
    pub(super) fn set_margin(&mut self, margin: f64, drift: DVec3) {
        (self.margin, self.drift) = (margin, drift);
        self.beside_drift = (margin - drift.length()).max(0.0);
    }

    /// Returns the distance of the two within which contacts are looked for, metres. Common motion does not
    /// count: robots that fall beside each other do not meet.
    pub(in crate::collision) fn within(&self, other: &Self) -> f64 {
        let ahead = self.beside_drift + other.beside_drift + self.drift.distance(other.drift);
        ahead.min(self.margin + other.margin)
    }
}

//! Bullet's laws of contacts, position limits and speeds.
//!
//! Velocities correct errors of positions (Baumgarte), as far as they are corrected. Scripts for PyBullet depend on
//! it: a body that begins inside another one leaves with a real velocity, and may fly.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::contact_point::Surface;

/// Parameters of contacts, from `btContactSolverInfo`. The default is PyBullet's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BulletContacts {
    /// Part of an overlap that the velocity of a step removes (`erp2`).
    pub error_reduction: f64,
    /// Depth of resting points, metres (`linearSlop`).
    pub slop: f64,
    /// Minimum approach speed of a hit that bounces, m/s (`restitutionVelocityThreshold`).
    pub bounce_speed: f64,
}

impl Default for BulletContacts {
    fn default() -> Self {
        Self { error_reduction: 0.08, slop: 1e-5, bounce_speed: 0.2 }
    }
}

impl BulletContacts {
    /// Returns name, value and range of each parameter.
    pub fn ranges(self) -> [(&'static str, f64, RangeInclusive<f64>); 3] {
        let Self { error_reduction, slop, bounce_speed } = self;
        [
            ("error_reduction", error_reduction, 0.0..=1.0),
            ("slop", slop, 0.0..=0.1),
            ("bounce_speed", bounce_speed, 0.0..=1e6),
        ]
    }

    /// Returns the minimum normal velocity of a point after a step of `h` seconds, and the compliance of its
    /// row. `velocity` is the normal velocity without impulses of contacts.
    ///
    /// A point above the slop may arrive there. A deeper one leaves with a part of its depth per step, or of
    /// the depth of its spring. A rebound is added to both.
    pub(super) fn target(self, distance: f64, velocity: f64, surface: &Surface, h: f64) -> (f64, f64) {
        let (mut error_reduction, mut compliance) = (self.error_reduction, 0.0);
        if surface.stiffness > 0.0 {
            let hardness = h * surface.stiffness + surface.damping;
            error_reduction = h * surface.stiffness / hardness;
            compliance = 1.0 / (h * hardness);
        }
        let hits = velocity <= -self.bounce_speed;
        let rebound = if hits { -surface.restitution * velocity } else { 0.0 };
        let depth = -(distance + self.slop);
        let part = if depth < 0.0 { 1.0 } else { error_reduction };
        (rebound + part * depth / h, compliance)
    }
}

/// Distance of contact points, as a part of the size of the smaller shape (`gContactBreakingThreshold`).
const CONTACT_DISTANCE: f64 = 0.02;

/// Returns the distance within which points of two shapes of these sizes are contacts, metres. Faster bodies are
/// in each other before they touch.
pub fn within([a, b]: [f64; 2]) -> f64 {
    CONTACT_DISTANCE * a.min(b)
}

/// Part of the way beyond a limit that the velocity of a step removes (`erp`).
const LIMIT_ERROR_REDUCTION: f64 = 0.2;

/// Way beyond a limit from which a joint is stopped, but not brought back, rad or m
/// (`splitImpulsePenetrationThreshold`).
const LEFT_BEYOND: f64 = 0.04;

/// Maximum impulse of a limit in a step, N m s or N s.
pub(super) const MAX_LIMIT_IMPULSE: f64 = 100.0;

/// Maximum velocity of a coordinate, m/s or rad/s, unless a joint has another (`maxCoordinateVelocity`).
pub(super) const MAX_VELOCITY: f64 = 100.0;

/// Returns the bias of a limit's row for a joint at the limit or beyond, at a `distance` of at most 0.
pub(super) fn limit_bias(distance: f64, h: f64) -> f64 {
    if distance <= -LEFT_BEYOND { 0.0 } else { LIMIT_ERROR_REDUCTION * distance / h }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(distance: f64, velocity: f64, surface: Surface) -> (f64, f64) {
        let law = BulletContacts { error_reduction: 0.08, slop: 0.001, bounce_speed: 0.2 };
        law.target(distance, velocity, &surface, 0.01)
    }

    #[test]
    fn a_point_arrives_at_the_slop_and_an_overlap_is_a_velocity() {
        let near = |(target, compliance): (f64, f64), expected: f64| {
            assert!((target - expected).abs() < 1e-12 && compliance == 0.0, "{target} {expected}");
        };
        near(target(0.002, -5.0, Surface::default()), -0.3);
        near(target(-0.001, -5.0, Surface::default()), 0.0);
        near(target(-0.101, -5.0, Surface::default()), 0.8);
        let bouncing = Surface { restitution: 0.5, ..Surface::default() };
        near(target(-0.101, -5.0, bouncing), 0.8 + 2.5);
        near(target(0.002, -5.0, bouncing), -0.3 + 2.5);
        near(target(0.002, -0.19, bouncing), -0.3);
    }

    #[test]
    fn a_spring_pushes_from_the_slop_on() {
        let spring = Surface { stiffness: 1000.0, damping: 10.0, ..Surface::default() };
        let (velocity, compliance) = target(-0.101, 0.0, spring);
        assert!(
            (velocity - 5.0).abs() < 1e-12 && (compliance - 5.0).abs() < 1e-12,
            "{velocity} {compliance}"
        );
        assert!((target(0.002, 0.0, spring).0 + 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_limit_brings_back_what_is_just_beyond_it() {
        assert_eq!(limit_bias(0.0, 0.01), 0.0);
        assert!((limit_bias(-0.03, 0.01) + 0.6).abs() < 1e-12);
        assert_eq!(limit_bias(-0.05, 0.01), 0.0);
    }
}

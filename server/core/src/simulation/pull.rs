//! Springs that pull links to points of the world.

use glamx::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use crate::plain::vector3;
use crate::valid::{finite, sizes};

/// Maximum duration of a pull after its request, simulated seconds.
pub const MAX_PULL_DURATION: f64 = 60.0;
/// Default duration of a pull, simulated seconds: if a client that drags a link disappears, the link is let
/// go.
pub const DEFAULT_PULL_DURATION: f64 = 0.5;
/// Maximum stiffness, N/m, and maximum of the largest force, N.
pub(super) const MAX_PULL: f64 = 1e12;
/// Default stiffness for each kilogram of the link and of its load, 1/s^2: at one metre it accelerates with
/// about six times gravity.
pub(super) const DEFAULT_PULL_STIFFNESS: f64 = 60.0;
/// Default maximum force for each of these kilograms, m/s^2.
pub(super) const DEFAULT_PULL_ACCELERATION: f64 = 60.0;

/// Stiffest spring, as h^2 k / m, that a step of h seconds can follow. It acts on a mass m from the start of
/// the step.
const STIFFEST: f64 = 0.25;
/// Strongest damper, as h c / m, that a step can follow.
const MAX_DAMPING_RATIO: f64 = 0.5;
/// Maximum number of pulls on the links of one robot. Each new pull divides what a step can follow among all
/// of them.
pub(super) const MAX_PULLS: usize = 8;
/// Smallest mobility along the pull, as a part of the sum over all axes.
const LEAST_MOBILITY: f64 = 1e-3;

/// Spring with a critical damper between a point of a link and a point of the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActivePull {
    /// Link, by index; no other pull of the robot is on it.
    pub link: usize,
    /// Point in the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// Target, world, metres.
    #[serde(with = "vector3")]
    pub target: DVec3,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
    /// Maximum force, N.
    pub max_force: f64,
    /// Remaining simulated seconds.
    pub remaining: f64,
    /// Force on the point in the last part of a step, N, world.
    #[serde(with = "vector3")]
    pub force: DVec3,
}

impl ActivePull {
    /// Returns the force on the point at this position and velocity, N; metres, metres per second, all world.
    pub fn force_at(&self, point: DVec3, velocity: DVec3) -> DVec3 {
        let force = (self.target - point) * self.stiffness - velocity * self.damping;
        // A point that is too far away for computation is not pulled.
        if force.length_squared().is_finite() { force.clamp_length_max(self.max_force) } else { DVec3::ZERO }
    }

    /// Softens it to the stiffness that steps of `h` seconds can follow. This depends on the number of pulls
    /// on this robot and on the mobility of its point.
    pub(super) fn soften(&mut self, mobility: &DMat3, h: f64, pulls: usize) {
        let sum = trace(mobility);
        if sum.is_finite() && sum > 0.0 {
            // Those on one body add up.
            let share = 1.0 / pulls.max(1) as f64;
            self.stiffness = self.stiffness.min(share * STIFFEST / (h * h * sum));
            self.damping = self.damping.min(share * MAX_DAMPING_RATIO / (h * sum));
        }
    }

    /// Checks a pull from a file, for a robot with this number of links.
    pub(super) fn check(&self, links: usize) -> Result<(), String> {
        let Self { link, point, target, stiffness, damping, max_force, remaining, force } = self;
        if *link >= links {
            return Err(format!("a pull on its link {link}, of {links}"));
        }
        if !(0.0..=MAX_PULL_DURATION).contains(remaining) {
            return Err(format!("a pull for {remaining} s, which is not 0 to {MAX_PULL_DURATION}"));
        }
        sizes("pulls", [*stiffness, *damping, *max_force])?;
        finite("pulls", [point, target, force].into_iter().flat_map(|vector| vector.to_array()))
    }
}

/// Returns stiffness and damping of a pull with this stiffness towards a point that is `way` metres away.
/// `mobility` is the pulled point's, m/s for N s. The damper is critical for the mass that the pull moves in
/// its direction, 1 / (u' mobility u) kg. Both are limited to what steps of `h` seconds can follow. Returns
/// `None` if the point cannot move.
pub(super) fn spring(stiffness: f64, way: DVec3, mobility: &DMat3, h: f64) -> Option<(f64, f64)> {
    let sum = trace(mobility);
    if !(sum.is_finite() && sum > 0.0) {
        return None;
    }
    let along = match (*mobility * way).try_normalize() {
        Some(goes) => goes.dot(*mobility * goes),
        None => sum / 3.0,
    };
    let mass = 1.0 / along.max(LEAST_MOBILITY * sum);
    let stiffness = stiffness.min(STIFFEST / (h * h * sum));
    let damping = (2.0 * (stiffness * mass).sqrt()).min(MAX_DAMPING_RATIO / (h * sum));
    (stiffness.is_finite() && damping.is_finite()).then_some((stiffness, damping))
}

fn trace(mobility: &DMat3) -> f64 {
    mobility.x_axis.x + mobility.y_axis.y + mobility.z_axis.z
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mobility(of: [f64; 3]) -> DMat3 {
        DMat3::from_diagonal(DVec3::from_array(of))
    }

    #[test]
    fn the_damper_is_critical_for_the_mass_that_the_pull_moves() {
        // 2 kg: 2 sqrt(50 * 2) = 20 N s/m.
        let (stiffness, damping) = spring(50.0, DVec3::Y, &mobility([0.5; 3]), 1e-3).unwrap();
        assert_eq!(stiffness, 50.0);
        assert!((damping - 20.0).abs() < 1e-12, "{damping}");
        // A point that moves only along x has that mass, wherever the target is.
        let hinge = mobility([0.25, 0.0, 0.0]);
        let (_, damping) = spring(25.0, DVec3::new(0.1, 0.0, 5.0), &hinge, 1e-3).unwrap();
        assert!((damping - 20.0).abs() < 1e-12, "{damping}");
    }

    #[test]
    fn a_long_step_softens_what_it_could_not_follow() {
        let (stiffness, damping) = spring(1e9, DVec3::X, &mobility([1.0, 0.0, 0.0]), 0.1).unwrap();
        assert!((stiffness - 25.0).abs() < 1e-9 && (damping - 5.0).abs() < 1e-9, "{stiffness}, {damping}");
    }

    #[test]
    fn immovable_links_have_no_spring() {
        assert_eq!(spring(50.0, DVec3::X, &DMat3::ZERO, 1e-3), None);
        assert_eq!(spring(50.0, DVec3::X, &mobility([f64::NAN; 3]), 1e-3), None);
    }

    #[test]
    fn the_force_is_at_most_the_largest_one() {
        let pull = ActivePull {
            link: 0,
            point: DVec3::ZERO,
            target: DVec3::X,
            stiffness: 10.0,
            damping: 1.0,
            max_force: 4.0,
            remaining: 0.5,
            force: DVec3::ZERO,
        };
        assert_eq!(pull.force_at(DVec3::X * 0.8, DVec3::ZERO), DVec3::X * ((1.0 - 0.8) * 10.0));
        assert!((pull.force_at(DVec3::X * -9.0, DVec3::Y).length() - 4.0).abs() < 1e-12);
    }
}

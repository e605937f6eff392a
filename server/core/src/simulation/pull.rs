//! Springs that pull links to points of the world.

use glamx::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use crate::plain::vector3;
use crate::valid::{finite, sizes};

/// Simulated seconds that a pull may last at the most after it was asked for.
pub const MAX_PULL_DURATION: f64 = 60.0;
/// The same where nothing is said: a client that drags a link and goes away lets go.
pub const DEFAULT_PULL_DURATION: f64 = 0.5;
/// The largest stiffness, N/m, and the largest of maximal forces, N.
pub(super) const MAX_PULL: f64 = 1e12;
/// Stiffness where nothing is said, for each kilogram of the link and of what it carries, 1/s^2: a metre accelerates with
/// about six times gravity.
pub(super) const DEFAULT_PULL_STIFFNESS: f64 = 60.0;
/// The largest force where nothing is said, for each of these kilograms, m/s^2.
pub(super) const DEFAULT_PULL_ACCELERATION: f64 = 60.0;

/// What a step of h seconds can follow of a spring that acts on a mass m from its beginning on: h^2 k / m at the most.
const STIFFEST: f64 = 0.25;
/// The same of a damper: h c / m.
const MOST_DAMPED: f64 = 0.5;
/// Pulls on the links of one robot: whenever one comes, all of them share what a step can follow.
pub(super) const MOST_PULLS: usize = 8;
/// The mobility along the pull is at least this part of the sum over all axes.
const LEAST_MOBILITY: f64 = 1e-3;

/// A spring with a critical damper between a point of a link and a point of the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActivePull {
    /// Index of the link, which no other pull of the robot is on.
    pub link: usize,
    /// In the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// World, metres.
    #[serde(with = "vector3")]
    pub target: DVec3,
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
    /// N.
    pub max_force: f64,
    /// Simulated seconds that it still lasts.
    pub remaining: f64,
    /// What it applied at the point in the last part of a step, N, world.
    #[serde(with = "vector3")]
    pub force: DVec3,
}

impl ActivePull {
    /// The force on the point where it is here and moves like this, N; metres, metres per second, all world.
    pub fn force_at(&self, point: DVec3, velocity: DVec3) -> DVec3 {
        let force = (self.target - point) * self.stiffness - velocity * self.damping;
        // What is too far away to be computed with is not pulled.
        if force.length_squared().is_finite() { force.clamp_length_max(self.max_force) } else { DVec3::ZERO }
    }

    /// Makes it no stiffer than steps of `h` seconds can follow, with as many pulls on this robot as there are, where its point
    /// moves as `mobility` says.
    pub(super) fn soften(&mut self, mobility: &DMat3, h: f64, pulls: usize) {
        let sum = trace(mobility);
        if sum.is_finite() && sum > 0.0 {
            // Those on one body add up.
            let share = 1.0 / pulls.max(1) as f64;
            self.stiffness = self.stiffness.min(share * STIFFEST / (h * h * sum));
            self.damping = self.damping.min(share * MOST_DAMPED / (h * sum));
        }
    }

    /// What is wrong with one of a file, for a robot of so many links.
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

/// Stiffness and damping of a pull with this stiffness towards a point that is `way` metres away, for a point that moves as
/// `mobility` says (m/s for N s). The damper is critical for the mass that the pull moves: where it would go,
/// 1 / (u' mobility u) kg. Both are no larger than steps of `h` seconds can follow. `None` where the point cannot move.
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
    let damping = (2.0 * (stiffness * mass).sqrt()).min(MOST_DAMPED / (h * sum));
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
        // What moves along x alone is as heavy as that, wherever the target is.
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
    fn what_cannot_move_has_no_spring() {
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

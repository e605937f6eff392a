//! Contact points, which collision finds and dynamics solves.

use std::ops::RangeInclusive;

use glamx::DVec3;
use serde::{Deserialize, Serialize};
use simd_model::robot::Material;

use crate::plain::{two_vectors3, vector3};

/// One point where two colliders touch or are near.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct ContactPoint {
    /// Collider of each robot, by index.
    pub colliders: [usize; 2],
    /// Link of each robot, by index. Derived from the colliders when a contact is read.
    #[serde(skip)]
    pub links: [usize; 2],
    /// Body of each robot; `None` is the base. Derived like the links.
    #[serde(skip)]
    pub bodies: [Option<usize>; 2],
    /// Point on the surface of each collider, in its shape's axes, metres.
    #[serde(with = "two_vectors3")]
    pub on: [DVec3; 2],
    /// Midpoint between the surfaces, world, metres.
    #[serde(with = "vector3")]
    pub position: DVec3,
    /// Normal from the first to the second collider, world.
    #[serde(with = "vector3")]
    pub normal: DVec3,
    /// Distance between the surfaces, metres; negative inside.
    pub distance: f64,
    /// Combined surface of the two colliders.
    pub surface: Surface,
}

/// Properties of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Coulomb's coefficient of friction.
    pub friction: f64,
    /// Part of the approach speed that remains after a hit.
    pub restitution: f64,
    /// Largest torque against rolling, as a part of the normal force, metres.
    pub rolling_friction: f64,
    /// Largest torque against turning about the normal, as a part of the normal force, metres.
    pub spinning_friction: f64,
    /// Stiffness of the spring at each contact point, N/m, in [`STIFFNESS`]; 0 is rigid.
    pub stiffness: f64,
    /// Damping parallel to that spring, N s/m, at most [`MAX_DAMPING`].
    pub damping: f64,
}

/// Range of nonzero contact stiffnesses, N/m.
pub const STIFFNESS: RangeInclusive<f64> = 1e-3..=1e12;

/// Maximum damping of a contact, N s/m.
pub const MAX_DAMPING: f64 = 1e12;

/// Look-ahead distance, as a multiple of a shape's path in a step at its present velocity: other events in
/// the step may make it faster.
pub const LOOK_AHEAD: f64 = 2.0;

/// Highest speed that the look-ahead assumes, m/s. Faster bodies have mostly diverged, and would be solved
/// together with distant ones. A shape faster than this times [`LOOK_AHEAD`] may pass through objects thinner
/// than its path in a step.
pub const FASTEST_LOOKED_AHEAD: f64 = 1e3;

/// Rule that combines the coefficients of two touching surfaces. Other simulators have one of these each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SurfaceCombination {
    /// Lower friction, as in Gazebo, higher restitution, and larger friction against rolling and spinning: a
    /// ball that has some is braked on any floor. A default surface (friction 1, all else 0) therefore leaves
    /// the other one unchanged.
    #[default]
    Min,
    /// Products of frictions and of restitutions. Friction against rolling and spinning of each is multiplied
    /// by the other one's friction. Bullet's rule (`btManifoldResult`).
    Multiply,
    /// Larger value of each. MuJoCo's rule.
    Max,
}

impl Default for Surface {
    /// Friction 1 as in MuJoCo and Gazebo, no rebound, no friction against rolling and spinning, rigid.
    fn default() -> Self {
        Self {
            friction: 1.0,
            restitution: 0.0,
            rolling_friction: 0.0,
            spinning_friction: 0.0,
            stiffness: 0.0,
            damping: 0.0,
        }
    }
}

impl Surface {
    /// Returns this surface with the values that a material overrides.
    pub fn with(self, material: &Material) -> Self {
        Self {
            friction: material.friction.unwrap_or(self.friction),
            restitution: material.restitution.unwrap_or(self.restitution),
            rolling_friction: material.rolling_friction.unwrap_or(self.rolling_friction),
            spinning_friction: material.spinning_friction.unwrap_or(self.spinning_friction),
            stiffness: material.contact_stiffness.unwrap_or(self.stiffness),
            damping: material.contact_damping.unwrap_or(self.damping),
        }
    }

    /// Returns the combined surface of two that touch. Their springs are in series, whatever the combination.
    pub fn against(self, other: Self, combination: SurfaceCombination) -> Self {
        let (stiffness, damping) = self.springs(other);
        let larger = Self {
            friction: self.friction.max(other.friction),
            restitution: self.restitution.max(other.restitution),
            rolling_friction: self.rolling_friction.max(other.rolling_friction),
            spinning_friction: self.spinning_friction.max(other.spinning_friction),
            stiffness,
            damping,
        };
        // The product of two large coefficients may not be finite.
        let finite = |coefficient: f64| coefficient.min(f64::MAX);
        let crosswise = |a: f64, b: f64| finite(a * other.friction + b * self.friction);
        match combination {
            SurfaceCombination::Min => Self { friction: self.friction.min(other.friction), ..larger },
            SurfaceCombination::Max => larger,
            SurfaceCombination::Multiply => Self {
                friction: finite(self.friction * other.friction),
                restitution: self.restitution * other.restitution,
                rolling_friction: crosswise(self.rolling_friction, other.rolling_friction),
                spinning_friction: crosswise(self.spinning_friction, other.spinning_friction),
                ..larger
            },
        }
    }

    /// Returns stiffness and damping of two springs in series; a rigid one has none.
    fn springs(self, other: Self) -> (f64, f64) {
        let in_series = |a: f64, b: f64| if a > 0.0 && b > 0.0 { a / (a + b) * b } else { 0.0 };
        match (self.stiffness > 0.0, other.stiffness > 0.0) {
            (true, true) => {
                (in_series(self.stiffness, other.stiffness), in_series(self.damping, other.damping))
            }
            (true, false) => (self.stiffness, self.damping),
            (false, true) => (other.stiffness, other.damping),
            (false, false) => (0.0, 0.0),
        }
    }

    /// Checks the values. The error is a fragment of a sentence.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { friction, restitution, rolling_friction, spinning_friction, stiffness, damping } = *self;
        // A description may have values that a request may not.
        let is_friction = |value: f64| value >= 0.0 && value.is_finite();
        let all = [friction, rolling_friction, spinning_friction].into_iter().all(is_friction);
        // Two of the softest in series are half as stiff.
        let can_be_stiff =
            stiffness == 0.0 || (STIFFNESS.start() / 2.0..=*STIFFNESS.end()).contains(&stiffness);
        let is_soft = can_be_stiff && (0.0..=MAX_DAMPING).contains(&damping);
        if all && is_soft && (0.0..=1.0).contains(&restitution) {
            return Ok(());
        }
        Err(format!(
            "a surface of friction {friction}, restitution {restitution}, and friction of {rolling_friction} m against \
             rolling and {spinning_friction} m against spinning, with a spring of {stiffness} N/m and a damper of {damping} N s/m"
        ))
    }
}

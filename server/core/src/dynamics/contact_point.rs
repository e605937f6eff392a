//! A point of contact as collision finds it and dynamics solves it.

use std::ops::RangeInclusive;

use glamx::DVec3;
use serde::{Deserialize, Serialize};
use simd_model::robot::Material;

use crate::plain::{two_vectors3, vector3};

/// One point where two colliders touch or are near.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct ContactPoint {
    /// Index of each robot's collider.
    pub colliders: [usize; 2],
    /// Index of each link. Found again from the colliders where a contact is read.
    #[serde(skip)]
    pub links: [usize; 2],
    /// Each one's body; `None` is the base. Found again like the links.
    #[serde(skip)]
    pub bodies: [Option<usize>; 2],
    /// On each one's surface, in its shape's axes.
    #[serde(with = "two_vectors3")]
    pub on: [DVec3; 2],
    /// In the middle between the surfaces, world.
    #[serde(with = "vector3")]
    pub position: DVec3,
    /// From the first to the second, world.
    #[serde(with = "vector3")]
    pub normal: DVec3,
    /// Between the surfaces; negative inside. Metres.
    pub distance: f64,
    /// Of the two together.
    pub surface: Surface,
}

/// What a surface is like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Coulomb's coefficient.
    pub friction: f64,
    /// The part of the approach speed that is left after a hit.
    pub restitution: f64,
    /// The largest torque against rolling, as a part of the normal force, metres.
    pub rolling_friction: f64,
    /// The same against turning about the normal.
    pub spinning_friction: f64,
    /// Of the spring that each point of a contact is, N/m, in [`STIFFNESS`]; 0 is rigid.
    pub stiffness: f64,
    /// Of the damper beside that spring, N s/m, at most [`MOST_DAMPING`].
    pub damping: f64,
}

/// N/m: what a spring of a contact may have, beside 0.
pub const STIFFNESS: RangeInclusive<f64> = 1e-3..=1e12;

/// N s/m.
pub const MOST_DAMPING: f64 = 1e12;

/// Twice the way that a shape goes in a step at its present velocity is looked ahead: what else
/// happens in the step may make it faster.
pub const LOOK_AHEAD: f64 = 2.0;

/// Nothing is taken to go faster than this where it is looked ahead, m/s: what does has mostly diverged, and would be solved together with
/// what stands far away. Faster than this times [`LOOK_AHEAD`] a shape may pass what is thinner than its way in a step.
pub const FASTEST_LOOKED_AHEAD: f64 = 1e3;

/// How the coefficients of two surfaces that touch become those of the contact. Other simulators have one of these each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SurfaceCombination {
    /// The more slippery one's friction, as in Gazebo, the bouncier one's restitution, and the larger friction against rolling
    /// and spinning: a ball that has some is braked on any floor. What a surface is by default, friction 1 and else
    /// 0, so leaves the other one as it is.
    #[default]
    Min,
    /// Products of frictions and of restitutions; each one's friction against rolling and spinning counts times the other one's
    /// friction. Bullet's (`btManifoldResult`).
    Multiply,
    /// The larger one of each. MuJoCo's.
    Max,
}

impl Default for Surface {
    /// Friction 1, as MuJoCo and Gazebo have it, no rebound, nothing against rolling and spinning, rigid.
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
    /// With what a material gives instead of its own.
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

    /// Of two surfaces that touch. Their springs are one after the other, whatever the combination.
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
        // Two large coefficients may have no finite product.
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

    /// Stiffness and damping of two springs one after the other, of which what is rigid is none.
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

    /// Whether a surface can be so; or what is wrong with it, as a fragment of a sentence.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { friction, restitution, rolling_friction, spinning_friction, stiffness, damping } = *self;
        // A description may say more than a request may.
        let is_friction = |value: f64| value >= 0.0 && value.is_finite();
        let all = [friction, rolling_friction, spinning_friction].into_iter().all(is_friction);
        // Two of the softest, one after the other, are half as stiff.
        let can_be_stiff =
            stiffness == 0.0 || (STIFFNESS.start() / 2.0..=*STIFFNESS.end()).contains(&stiffness);
        let is_soft = can_be_stiff && (0.0..=MOST_DAMPING).contains(&damping);
        if all && is_soft && (0.0..=1.0).contains(&restitution) {
            return Ok(());
        }
        Err(format!(
            "a surface of friction {friction}, restitution {restitution}, and friction of {rolling_friction} m against \
             rolling and {spinning_friction} m against spinning, with a spring of {stiffness} N/m and a damper of {damping} N s/m"
        ))
    }
}

//! A point of contact as collision finds it and dynamics solves it.

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
}

impl Default for Surface {
    /// Friction 1, as MuJoCo and Gazebo have it, no rebound, and nothing against rolling and spinning.
    fn default() -> Self {
        Self { friction: 1.0, restitution: 0.0, rolling_friction: 0.0, spinning_friction: 0.0 }
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
        }
    }

    /// Of two surfaces that touch: the more slippery one's friction, as in Gazebo, the
    /// bouncier one's restitution, and the larger friction against rolling and spinning, as in MuJoCo: a ball that has some is
    /// braked on any floor. What a surface is by default, friction 1 and else 0, so leaves the other one as it is.
    pub fn against(self, other: Self) -> Self {
        Self {
            friction: self.friction.min(other.friction),
            restitution: self.restitution.max(other.restitution),
            rolling_friction: self.rolling_friction.max(other.rolling_friction),
            spinning_friction: self.spinning_friction.max(other.spinning_friction),
        }
    }

    /// Whether a surface can be so; or what is wrong with it, as a fragment of a sentence.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { friction, restitution, rolling_friction, spinning_friction } = *self;
        // A description may say more than a request may.
        let is_friction = |value: f64| value >= 0.0 && value.is_finite();
        let all = [friction, rolling_friction, spinning_friction].into_iter().all(is_friction);
        if all && (0.0..=1.0).contains(&restitution) {
            return Ok(());
        }
        Err(format!(
            "a surface of friction {friction}, restitution {restitution}, and friction of {rolling_friction} m against \
             rolling and {spinning_friction} m against spinning"
        ))
    }
}

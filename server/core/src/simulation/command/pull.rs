//! Pulls on links.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use crate::plain::{optional_vector3, vector3};

/// Spring with a critical damper that pulls a point of a link to a point of the world. It replaces the
/// previous pull on that link. Each step computes its force from the present point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkPull {
    /// Name of the robot.
    pub robot: String,
    /// Name of the link.
    pub link: String,
    /// Point in the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// Target, world, metres; `None` lets go.
    #[serde(with = "optional_vector3")]
    pub target: Option<DVec3>,
    /// Stiffness, N/m; `None` means 60 for each kilogram of the link and of its load. Steps that are too long
    /// for it soften it.
    pub stiffness: Option<f64>,
    /// Maximum force, N; `None` means 60 for each of these kilograms.
    pub max_force: Option<f64>,
    /// Simulated seconds until it ends, rounded to steps and at least one step; `None` means
    /// [`DEFAULT_PULL_DURATION`](super::DEFAULT_PULL_DURATION).
    pub duration: Option<f64>,
}

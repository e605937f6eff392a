//! What pulls a link.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use crate::plain::{optional_vector3, vector3};

/// A spring with a critical damper that pulls a point of a link to a point of the world, instead of the one
/// before on that link. Each step computes its force for where the point is by then.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkPull {
    /// The robot's name.
    pub robot: String,
    /// The link's name.
    pub link: String,
    /// In the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// World, metres; `None` lets go.
    #[serde(with = "optional_vector3")]
    pub target: Option<DVec3>,
    /// N/m; `None` is 60 for each kilogram of the link and of what it carries. Steps too long for it soften it.
    pub stiffness: Option<f64>,
    /// The force at the most, N; `None` is 60 for each of these kilograms.
    pub max_force: Option<f64>,
    /// Simulated seconds until it ends by itself, to the nearest step and for one at least; `None` is
    /// [`DEFAULT_PULL_DURATION`](super::DEFAULT_PULL_DURATION).
    pub duration: Option<f64>,
}

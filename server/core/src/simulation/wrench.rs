//! Wrenches on links, and their durations.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use crate::plain::vector3;

/// Maximum duration of [`WrenchDuration::For`], simulated seconds.
pub const MAX_WRENCH_DURATION: f64 = 3600.0;

/// Duration of a wrench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum WrenchDuration {
    /// For the next step, together with all others for it.
    #[default]
    NextStep,
    /// For some simulated seconds, rounded to steps and at least one step. It replaces the last one of this
    /// kind on the link. It also suspends one until cleared, which acts again afterwards. A wrench of zero
    /// ends it at once.
    For(f64),
    /// Until replaced or, by a wrench of zero, cleared. Ends wrenches with a duration.
    UntilCleared,
}

/// Force and torque on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActiveWrench {
    /// Link, by index.
    pub link: usize,
    /// Force, newtons, at `point`.
    #[serde(with = "vector3")]
    pub force: DVec3,
    /// Torque, newton metres.
    #[serde(with = "vector3")]
    pub torque: DVec3,
    /// Whether they are in the link's axes, and not the world's.
    pub in_link_axes: bool,
    /// Point at which the force acts, in the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// Remaining duration.
    pub duration: WrenchDuration,
    /// Whether it is suspended until a wrench with a duration on the same link has expired.
    pub suspended: bool,
}

impl ActiveWrench {
    /// Returns whether it has a duration.
    pub(super) fn is_timed(&self) -> bool {
        matches!(self.duration, WrenchDuration::For(_))
    }
}

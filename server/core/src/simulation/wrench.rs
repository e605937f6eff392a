//! Wrenches on links: how long each acts.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use crate::plain::vector3;

/// Simulated seconds that [`WrenchDuration::For`] may say.
pub const MAX_WRENCH_DURATION: f64 = 3600.0;

/// How long a wrench acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum WrenchDuration {
    /// For the next step, together with all others of it.
    #[default]
    NextStep,
    /// For so many simulated seconds, to the nearest step and for one at least: instead of
    /// the last one of this kind on the link, and of what is there until it is cleared, which acts
    /// again afterwards. A wrench of zero ends it at once.
    For(f64),
    /// Until replaced or, by a wrench of zero, cleared. Ends what is there for a time.
    UntilCleared,
}

/// A force and a torque on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActiveWrench {
    /// Index of the link.
    pub link: usize,
    /// Newtons, at `point`.
    #[serde(with = "vector3")]
    pub force: DVec3,
    /// Newton metres.
    #[serde(with = "vector3")]
    pub torque: DVec3,
    /// In the link's axes, not the world's.
    pub in_link_axes: bool,
    /// In the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// How long it still acts.
    pub duration: WrenchDuration,
    /// Suspended until a wrench with a duration on the same link has expired.
    pub suspended: bool,
}

impl ActiveWrench {
    /// Whether it has a duration.
    pub(super) fn is_timed(&self) -> bool {
        matches!(self.duration, WrenchDuration::For(_))
    }
}

//! Groups of links, by which they touch.

use serde::{Deserialize, Serialize};

/// Groups that a link belongs to and groups that it touches, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Groups {
    /// Groups that it belongs to.
    pub group: u32,
    /// Groups that it touches.
    pub mask: u32,
}

impl Default for Groups {
    /// Returns membership in the first group, with contact to all.
    fn default() -> Self {
        Self { group: 1, mask: u32::MAX }
    }
}

impl Groups {
    /// Returns whether one is in a group that the other one touches.
    pub fn allow(self, other: Self) -> bool {
        self.group & other.mask != 0 || other.group & self.mask != 0
    }
}

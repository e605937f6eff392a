//! A robot among those that are solved together.

use std::ops::Range;

/// A robot of an island.
#[derive(Clone, Copy, Debug)]
pub struct Member {
    /// Index of the robot in the world.
    pub robot: usize,
    /// First velocity among those of the island.
    pub first: usize,
    /// Number of velocities.
    pub len: usize,
    /// Whether it has one body.
    pub is_one_body: bool,
    /// Whether it is a free body that only touches. It is not read again before its position is integrated:
    /// each access would fetch the bodies of a heap from distant memory.
    pub(in crate::dynamics) is_seen_last: bool,
    /// Whether a contact has given it an impulse in this step.
    pub(in crate::dynamics) is_touched: bool,
}

impl Member {
    /// Returns the range of its velocities among those of the island.
    pub(in crate::dynamics) fn velocities(&self) -> Range<usize> {
        self.first..self.first + self.len
    }
}

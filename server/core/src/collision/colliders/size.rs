//! Size of a collider, as Bullet measures it.

use super::{Placed, RobotColliders};

impl RobotColliders {
    /// Returns half of the diagonal of a collider's bounds in its axes, as far as its radius says it, metres.
    pub fn half_diagonal(&self, collider: usize) -> f64 {
        let of = |placed: &Placed| if placed.is_ball { 3.0f64.sqrt() * placed.radius } else { placed.radius };
        self.placed.get(collider).map_or(f64::INFINITY, of)
    }
}

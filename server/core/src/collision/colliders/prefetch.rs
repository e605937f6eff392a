//! Prefetch of colliders before the search for contacts.

use std::hint::black_box;

use super::{Frame, Placed, RobotColliders};

impl RobotColliders {
    /// Reads the data of the first collider that a step needs, and discards them: see
    /// [`Articulation::prefetch`](crate::dynamics::Articulation::prefetch).
    pub fn prefetch(&self) {
        let of_placed =
            |placed: &Placed| (placed.part, placed.world_middle.x, placed.bounds.least.x, placed.margin);
        let of_frame = |frame: &Frame| {
            let (own, world) = (&frame.body_from_shape, &frame.world_from_shape);
            (own.translation.x, world.translation.x, frame.surface.friction)
        };
        black_box((self.placed.first().map(of_placed), self.frames.first().map(of_frame)));
    }
}

//! Moments of a world.

/// A moment of a world. Within an epoch, steps never fall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Counts resets of time and restored states.
    pub epoch: u64,
    /// Steps since the epoch began.
    pub step: u64,
    /// Seconds since the epoch began.
    pub sim_time: f64,
}

//! Moments of a world.

/// Moment of a world. Within an epoch, steps never decrease.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Number of resets of time and restored states.
    pub epoch: u64,
    /// Number of steps since the epoch began.
    pub step: u64,
    /// Sim time since the epoch began, seconds.
    pub sim_time: f64,
}

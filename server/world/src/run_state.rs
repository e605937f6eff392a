//! Run state of the world.

/// Run state of the world, in the words of `simulation_interfaces`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunState {
    /// Paused and reset to the start.
    Stopped,
    /// Steps follow the pace.
    Playing,
    /// Only requested steps are made.
    Paused,
}

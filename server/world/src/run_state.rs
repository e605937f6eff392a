//! Whether the world runs.

/// Whether the world runs, in the words of `simulation_interfaces`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunState {
    /// Paused and put back to the start.
    Stopped,
    /// Steps follow the pace.
    Playing,
    /// No step but those asked for.
    Paused,
}

//! When copies pause and end: who has them computed is asked before each step.

use crate::pool::Interrupt;

/// Why copies are not advanced any further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halt {
    /// For now: they can go on from where they are.
    Paused,
    /// No caller wants them any more.
    Over,
}

/// What who has copies computed says of their steps. It may have a clock, which the core has not.
pub trait Schedule: Sync {
    /// Asked before each step of a copy, or of several at once.
    ///
    /// # Errors
    /// Returns why the step is not to be done.
    fn before_step(&self) -> Result<(), Halt>;

    /// Asked while something is computed that may take long: whether no caller wants it any more.
    fn is_over(&self) -> bool;

    /// Whether steps take so long that this is asked in their midst too, which costs a copy of the state.
    fn has_long_steps(&self) -> bool;
}

/// All steps at once, unless they are interrupted.
pub(super) struct Unpaused<'a>(pub(super) &'a Interrupt<'a>);

impl Schedule for Unpaused<'_> {
    fn before_step(&self) -> Result<(), Halt> {
        if self.is_over() { Err(Halt::Over) } else { Ok(()) }
    }

    fn is_over(&self) -> bool {
        (self.0)()
    }

    fn has_long_steps(&self) -> bool {
        false
    }
}

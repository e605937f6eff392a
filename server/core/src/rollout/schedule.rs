//! Schedule of copies: the caller decides before each step whether they pause or end.

use crate::pool::Interrupt;

/// Reason why copies are not advanced further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halt {
    /// They are paused, and can continue from where they are.
    Paused,
    /// No caller wants them any more.
    Over,
}

/// Schedule of the caller that has copies computed. It may have a clock, which the core has not.
pub trait Schedule: Sync {
    /// Decides whether a step of a copy, or of several at once, may be done.
    ///
    /// # Errors
    /// Returns why the step must not be done.
    fn before_step(&self) -> Result<(), Halt>;

    /// Returns whether no caller wants the result any more. Called during long computations.
    fn is_over(&self) -> bool;

    /// Returns whether steps take so long that [`is_over`](Self::is_over) is called within them too, which
    /// costs a copy of the state.
    fn has_long_steps(&self) -> bool;
}

/// Schedule without pauses, which may be interrupted.
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

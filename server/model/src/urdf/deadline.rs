//! Time limit of reading, checked between its parts.

use std::time::{Duration, Instant};

use super::findings::Refusal;

/// End of the time limit.
pub(super) struct Deadline {
    started: Instant,
    allowed: Duration,
}

impl Deadline {
    /// Starts the time limit now.
    pub(super) fn new(allowed: Duration) -> Self {
        Self { started: Instant::now(), allowed }
    }

    /// Refuses after the time limit.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if self.started.elapsed() < self.allowed {
            return Ok(());
        }
        let seconds = self.allowed.as_secs_f64();
        Err(Refusal::of_file(format!("reading it takes longer than {seconds} s, which is the limit")))
    }
}

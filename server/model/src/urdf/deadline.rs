//! How long a reading may take, looked at between its parts.

use std::time::{Duration, Instant};

use super::findings::Refusal;

/// When to give up.
pub(super) struct Deadline {
    started: Instant,
    allowed: Duration,
}

impl Deadline {
    /// The time runs from now.
    pub(super) fn new(allowed: Duration) -> Self {
        Self { started: Instant::now(), allowed }
    }

    /// Refuses once the time is over.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if self.started.elapsed() < self.allowed {
            return Ok(());
        }
        let seconds = self.allowed.as_secs_f64();
        Err(Refusal::of_file(format!("reading it takes longer than {seconds} s, which is the most")))
    }
}

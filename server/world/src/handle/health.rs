//! Whether the physics thread gets on, and how long its steps and its queue are.

use std::time::{Duration, Instant};

use super::SimHandle;
use crate::histogram::Counts;

/// A physics thread that is at one step or command for longer does not get on.
const STUCK: Duration = Duration::from_secs(10);

impl SimHandle {
    /// For how long the driver has been at one step or one command; zero while it waits for the next.
    pub fn driver_at_work(&self, now: Instant) -> Duration {
        self.inner.driver.state_cell.present_work(now)
    }

    /// Whether the physics thread gets on; else why not.
    ///
    /// # Errors
    /// Returns an error if it has ended, or has been at one step or command for longer than ten seconds.
    pub fn health(&self, now: Instant) -> Result<(), String> {
        if let Some(failure) = self.driver_failure() {
            return Err(format!("the physics thread ended: {failure}"));
        }
        let at_work = self.driver_at_work(now);
        match at_work > STUCK {
            true => {
                Err(format!("the physics thread has been at one step for {:.1} s", at_work.as_secs_f64()))
            }
            false => Ok(()),
        }
    }

    /// Whether calls are served; else why not.
    ///
    /// # Errors
    /// Those of [`health`](Self::health), and while the daemon drains.
    pub fn readiness(&self, now: Instant) -> Result<(), String> {
        match self.inner.draining.is_cancelled() {
            true => Err("the daemon is shutting down".to_owned()),
            false => self.health(now),
        }
    }

    /// How long steps took, and how long after their time they began.
    pub fn step_times(&self) -> (Counts, Counts) {
        let state_cell = &self.inner.driver.state_cell;
        (state_cell.step_durations.counts(), state_cell.step_lateness.counts())
    }

    /// Calls that wait for the physics thread, and those that found no room.
    pub fn mailbox(&self) -> (usize, u64) {
        (self.inner.driver.mailbox.waiting(), self.inner.driver.mailbox.refusals())
    }

    /// What the driver failed with, if it did.
    pub fn driver_failure(&self) -> Option<&str> {
        self.inner.driver.mailbox.failure()
    }
}

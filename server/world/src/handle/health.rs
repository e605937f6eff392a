//! Liveness of the physics thread, durations of its steps, and length of its queue.

use std::time::{Duration, Instant};

use super::SimHandle;
use crate::histogram::Counts;

/// Time in one step or command after which the physics thread counts as stuck.
const STUCK: Duration = Duration::from_secs(10);

impl SimHandle {
    /// Returns the time that the driver has spent in its present step or command; zero while it waits.
    pub fn driver_at_work(&self, now: Instant) -> Duration {
        self.inner.driver.state_cell.present_work(now)
    }

    /// Checks that the physics thread makes progress; otherwise returns the reason.
    ///
    /// # Errors
    /// Returns an error if it has ended, or has spent more than ten seconds in one step or command.
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

    /// Checks that calls are served; otherwise returns the reason.
    ///
    /// # Errors
    /// As [`health`](Self::health), and while the daemon drains.
    pub fn readiness(&self, now: Instant) -> Result<(), String> {
        match self.inner.draining.is_cancelled() {
            true => Err("the daemon is shutting down".to_owned()),
            false => self.health(now),
        }
    }

    /// Returns the durations of steps, and their delays after their due time.
    pub fn step_times(&self) -> (Counts, Counts) {
        let state_cell = &self.inner.driver.state_cell;
        (state_cell.step_durations.counts(), state_cell.step_lateness.counts())
    }

    /// Returns the number of calls that wait for the physics thread, and the number refused by the full
    /// mailbox.
    pub fn mailbox(&self) -> (usize, u64) {
        (self.inner.driver.mailbox.waiting(), self.inner.driver.mailbox.refusals())
    }

    /// Returns the message of the driver's panic, if any.
    pub fn driver_failure(&self) -> Option<&str> {
        self.inner.driver.mailbox.failure()
    }
}

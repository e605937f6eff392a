//! The log of events, for any number of readers.

use std::time::Duration;

use super::{CallError, SimHandle};
use crate::driver::EventBatch;

impl SimHandle {
    /// Returns the events after a number, at once.
    pub fn events_after(&self, sequence: u64) -> EventBatch {
        self.inner.driver.events.after(sequence)
    }

    /// Returns the events after a number, waiting at most `timeout` for the first.
    ///
    /// # Errors
    /// Returns an error if the daemon drains before that, or the driver failed.
    pub async fn next_events(&self, after: u64, timeout: Duration) -> Result<EventBatch, CallError> {
        self.until_drained(self.inner.driver.events.next(after, timeout)).await
    }
}

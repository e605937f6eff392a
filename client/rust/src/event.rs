//! Events in the world.

use std::time::Duration;

use simd_proto::v1::{Event, NextEventsRequest, NextEventsResponse, WatchEventsRequest, WatchEventsResponse};
use tonic::Streaming;

use crate::{Client, Error, client::present};

/// `EventService`.
impl Client {
    /// Streams events as they happen: from now on if `after_sequence` is 0.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn watch_events(&self, after_sequence: u64) -> Result<EventWatch, Error> {
        let request = WatchEventsRequest { after_sequence };
        let events = self.unary(self.event().watch_events(request)).await?;
        Ok(EventWatch { client: self.clone(), events })
    }

    /// Returns the events after `after_sequence`, waiting at most `wait` (up to 60 s) for the first.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn next_events(
        &self,
        after_sequence: u64,
        wait: Duration,
    ) -> Result<NextEventsResponse, Error> {
        let request = NextEventsRequest { after_sequence, timeout: wait.as_secs_f64() };
        self.unary_for(wait, self.event().next_events(request)).await
    }
}

/// An event, and the number of lost events before it.
#[derive(Clone, Debug)]
pub struct Observed {
    /// The event.
    pub event: Event,
    /// Number of lost events between the last one and this one.
    pub missed: u64,
}

/// Events as the daemon sends them.
#[derive(Debug)]
pub struct EventWatch {
    client: Client,
    events: Streaming<WatchEventsResponse>,
}

impl EventWatch {
    /// Returns the next event; `None` if the daemon ended the stream normally.
    ///
    /// # Errors
    /// Returns an error if the connection broke.
    pub async fn next(&mut self) -> Result<Option<Observed>, Error> {
        match self.events.message().await {
            Ok(Some(answer)) => {
                Ok(Some(Observed { event: present(answer.event, "event")?, missed: answer.missed }))
            }
            Ok(None) => Ok(None),
            Err(status) => Err(Error::from_status(&status, self.client.endpoint())),
        }
    }
}

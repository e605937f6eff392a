//! The event service: events in the world.

use crate::service::status::OrStatus as _;
use std::collections::VecDeque;
use std::time::Duration;

use futures_util::stream;
use simd_proto::v1::{self, event_service_server::EventService};
use tonic::{Request, Response, Status};

use super::BoxStream;
use crate::convert::{from_proto, to_proto};
use simd_world::SimHandle;
use simd_world::handle::CallError;

/// Longest wait of one look for events; a watcher does not notice it.
const WAIT: Duration = Duration::from_secs(60);

/// Serves `simd.v1.EventService`.
#[derive(Clone, Debug)]
pub struct Service {
    handle: SimHandle,
}

impl Service {
    /// Serves the world of a handle.
    pub fn new(handle: SimHandle) -> Self {
        Self { handle }
    }
}

#[tonic::async_trait]
impl EventService for Service {
    type WatchEventsStream = BoxStream<v1::WatchEventsResponse>;

    async fn watch_events(
        &self,
        request: Request<v1::WatchEventsRequest>,
    ) -> Result<Response<Self::WatchEventsStream>, Status> {
        let now = self.handle.events_after(u64::MAX).last_sequence;
        // A number from before a restart of the daemon may be larger.
        let after = match request.into_inner().after_sequence {
            0 => now,
            after => after.min(now),
        };
        let watcher = Watcher { handle: self.handle.clone(), after, ready: VecDeque::new() };
        Ok(Response::new(Box::pin(stream::try_unfold(watcher, Watcher::next))))
    }

    async fn next_events(
        &self,
        request: Request<v1::NextEventsRequest>,
    ) -> Result<Response<v1::NextEventsResponse>, Status> {
        let request = request.into_inner();
        let timeout = from_proto::event::timeout(&request)?;
        let batch = self.handle.next_events(request.after_sequence, timeout).await.or_status()?;
        Ok(Response::new(v1::NextEventsResponse {
            events: batch.events.into_iter().map(to_proto::event::event).collect(),
            missed: batch.missed,
            last_sequence: batch.last_sequence,
        }))
    }
}

/// A watcher. Events are fetched when the network asks for the next one, so unread events of a slow reader
/// are only in the daemon's log.
struct Watcher {
    handle: SimHandle,
    after: u64,
    ready: VecDeque<v1::WatchEventsResponse>,
}

impl Watcher {
    async fn next(mut self) -> Result<Option<(v1::WatchEventsResponse, Self)>, Status> {
        loop {
            if self.handle.draining().is_cancelled() {
                return Ok(None);
            }
            if let Some(event) = self.ready.pop_front() {
                return Ok(Some((event, self)));
            }
            let batch = match self.handle.next_events(self.after, WAIT).await {
                Ok(batch) => batch,
                Err(CallError::ShuttingDown) => return Ok(None),
                Err(error) => return Err(error).or_status(),
            };
            self.after = batch.last_sequence;
            let mut missed = batch.missed;
            self.ready = batch
                .events
                .into_iter()
                .map(|event| v1::WatchEventsResponse {
                    event: Some(to_proto::event::event(event)),
                    missed: std::mem::take(&mut missed),
                })
                .collect();
        }
    }
}

//! `SpawnEntityWithProgress`: a stream that reports a robot's progress, and ends with the robot.

use std::future::Future;
use std::pin::Pin;

use futures_util::stream;
use simd_proto::v1;
use tokio::sync::watch;
use tonic::Status;

use super::BoxStream;
use crate::convert::to_proto::entity::progress;
use simd_world::loading::Progress;

type Answer = v1::SpawnEntityWithProgressResponse;
type Work = Pin<Box<dyn Future<Output = Result<v1::SpawnEntityResponse, Status>> + Send>>;

/// State of a stream.
struct Waiting {
    work: Work,
    heard: watch::Receiver<Progress>,
    /// Whether the sender of progress was dropped.
    is_silent: bool,
}

/// Streams the reports of `heard`, as often as the network takes them, then the result of `work`.
pub(super) fn spawning(
    work: impl Future<Output = Result<v1::SpawnEntityResponse, Status>> + Send + 'static,
    heard: watch::Receiver<Progress>,
) -> BoxStream<Answer> {
    let waiting = Waiting { work: Box::pin(work), heard, is_silent: false };
    Box::pin(stream::try_unfold(Some(waiting), next))
}

async fn next(waiting: Option<Waiting>) -> Result<Option<(Answer, Option<Waiting>)>, Status> {
    use v1::spawn_entity_with_progress_response::Event;
    let Some(mut waiting) = waiting else { return Ok(None) };
    loop {
        tokio::select! {
            biased;
            spawned = &mut waiting.work => {
                return Ok(Some((Answer { event: Some(Event::Spawned(spawned?)) }, None)));
            }
            changed = waiting.heard.changed(), if !waiting.is_silent => match changed {
                Ok(()) => {
                    let said = progress(&waiting.heard.borrow_and_update());
                    return Ok(Some((Answer { event: Some(Event::Progress(said)) }, Some(waiting))));
                }
                Err(_silent) => waiting.is_silent = true,
            }
        }
    }
}

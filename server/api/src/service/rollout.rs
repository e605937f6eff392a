//! The rollout service: runs copies of the world, as a stream that reports progress and ends with the
//! results.

use crate::service::status::OrStatus as _;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use futures_util::stream;
use simd_proto::v1::rollout_response::Event;
use simd_proto::v1::{self, ErrorReason, rollout_service_server::RolloutService};
use tokio::task::{AbortHandle, JoinError};
use tokio::time::Instant;
use tokio_util::task::AbortOnDropHandle;
use tonic::{Request, Response, Status};

use super::BoxStream;
use super::calls::handle_of;
use super::status::Explained;
use crate::convert::from_proto::rollout as from_proto;
use crate::convert::to_proto::rollout::{ARRAYS, numbers, result};
use simd_world::SimHandle;
use simd_world::handle::{CallError, CopiesDone, RolloutAnswer, RolloutFrom};

/// Time between two progress reports.
const PROGRESS: Duration = Duration::from_millis(250);
/// Size of one part of an array, bytes. A client that buffers 256 unread messages can hold all parts of the
/// largest answer.
const PART: usize = 1 << 20;
/// An answer is dropped if no part of it is read for this time.
const UNREAD: Duration = Duration::from_secs(60);

/// Serves `simd.v1.RolloutService`.
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
impl RolloutService for Service {
    type RolloutStream = BoxStream<v1::RolloutResponse>;

    async fn rollout(
        &self,
        request: Request<v1::RolloutRequest>,
    ) -> Result<Response<Self::RolloutStream>, Status> {
        let handle = handle_of(&self.handle, &request);
        let (saved_state, request) = from_proto::rollout(request.into_inner())?;
        let from = match saved_state.is_empty() {
            true => RolloutFrom::Present,
            false => RolloutFrom::Saved(saved_state),
        };
        let (copies, done) = (request.copies, CopiesDone::default());
        let of_work = Arc::clone(&done);
        // A separate task: a stream is not polled while its client does not read, and a stopped rollout would
        // block all others.
        let work = async move {
            let answer = handle.rollout(from, request, of_work).await?;
            Ok::<_, CallError>((result(&answer), Parts::of(answer)))
        };
        let work = AbortOnDropHandle::new(tokio::spawn(work));
        let begun = Stage::Computing { work, done, copies };
        Ok(Response::new(Box::pin(stream::try_unfold(begun, Stage::next))))
    }
}

/// Result of a rollout; dropping this cancels it.
type Work = AbortOnDropHandle<Result<(v1::RolloutResult, Parts), CallError>>;

/// Stage of a stream.
enum Stage {
    Computing { work: Work, done: CopiesDone, copies: usize },
    Giving(Parts),
}

impl Stage {
    async fn next(self) -> Result<Option<(v1::RolloutResponse, Self)>, Status> {
        let (event, next) = match self {
            Self::Computing { mut work, done, copies } => {
                tokio::select! {
                    biased;
                    answer = &mut work => {
                        let failed = |error: JoinError| CallError::Internal { message: error.to_string() };
                        let (result, parts) = answer.map_err(failed).or_status()?.or_status()?;
                        (Event::Result(result), Self::Giving(parts))
                    }
                    () = tokio::time::sleep(PROGRESS) => {
                        let count = |copies: usize| u32::try_from(copies).unwrap_or(u32::MAX);
                        let said = count(done.load(Ordering::Relaxed));
                        let progress = v1::RolloutProgress { done: said, copies: count(copies) };
                        (Event::Progress(progress), Self::Computing { work, done, copies })
                    }
                }
            }
            Self::Giving(mut parts) => {
                let Some(part) = parts.next()? else { return Ok(None) };
                (Event::Part(part), Self::Giving(parts))
            }
        };
        Ok(Some((v1::RolloutResponse { event: Some(event) }, next)))
    }
}

/// Arrays of an answer, part by part.
struct Parts {
    pending: Arc<Mutex<PendingAnswer>>,
    /// Index in [`ARRAYS`].
    array: usize,
    batch: usize,
    /// Number of sent values of the batch.
    given: usize,
    tidy: AbortHandle,
}

impl Drop for Parts {
    fn drop(&mut self) {
        self.tidy.abort();
    }
}

/// An answer, kept while it is read.
struct PendingAnswer {
    answer: Option<RolloutAnswer>,
    read: Instant,
}

fn lock(pending: &Mutex<PendingAnswer>) -> MutexGuard<'_, PendingAnswer> {
    pending.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Drops an answer that is no longer read.
async fn tidy(pending: Weak<Mutex<PendingAnswer>>) {
    loop {
        tokio::time::sleep(UNREAD).await;
        let Some(pending) = pending.upgrade() else { return };
        let mut pending = lock(&pending);
        if pending.read.elapsed() >= UNREAD {
            pending.answer = None;
            return;
        }
    }
}

impl Parts {
    fn of(answer: RolloutAnswer) -> Self {
        let pending = Arc::new(Mutex::new(PendingAnswer { answer: Some(answer), read: Instant::now() }));
        let tidy = tokio::spawn(tidy(Arc::downgrade(&pending))).abort_handle();
        Self { pending, array: 0, batch: 0, given: 0, tidy }
    }

    /// Returns the next part; `None` after the last one.
    fn next(&mut self) -> Result<Option<v1::RolloutPart>, Status> {
        let mut pending = lock(&self.pending);
        pending.read = Instant::now();
        let Some(answer) = &pending.answer else {
            let message = format!("the answer of the rollout was not read for {} s", UNREAD.as_secs());
            return Err(Explained::new(ErrorReason::LimitExceeded, message).into());
        };
        while let Some(array) = ARRAYS.get(self.array) {
            let mut data = Vec::new();
            while let Some(batch) = answer.batches.get(self.batch) {
                let rest = numbers(batch, *array).get(self.given..).unwrap_or_default();
                let room = (PART - data.len()) / size_of::<f64>();
                let now = rest.get(..room).unwrap_or(rest);
                data.reserve(size_of_val(now));
                now.iter().for_each(|number| data.extend_from_slice(&number.to_le_bytes()));
                self.given += now.len();
                if now.len() < rest.len() {
                    break;
                }
                (self.batch, self.given) = (self.batch + 1, 0);
            }
            if self.batch == answer.batches.len() {
                (self.array, self.batch) = (self.array + 1, 0);
            }
            if !data.is_empty() {
                return Ok(Some(v1::RolloutPart { array: (*array).into(), data }));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;
    use std::task::Poll;

    use futures_util::StreamExt as _;

    use super::*;
    use simd_world::handle::testing::paused;

    #[tokio::test]
    async fn a_rollout_whose_client_does_not_read_keeps_no_place_from_others() {
        let service = Service::new(paused());
        let small = || Request::new(v1::RolloutRequest { copies: 2, steps: 5, ..Default::default() });
        let mut unread = Vec::new();
        // The maximum number of parallel streams; each is polled once.
        for _ in 0..2 {
            let mut stream = service.rollout(small()).await.unwrap().into_inner();
            poll_fn(|context| {
                let _ = stream.poll_next_unpin(context);
                Poll::Ready(())
            })
            .await;
            unread.push(stream);
        }
        let mut read = service.rollout(small()).await.unwrap().into_inner();
        let whole = async {
            while let Some(answer) = read.next().await {
                if let Some(Event::Result(result)) = answer.unwrap().event {
                    return result;
                }
            }
            panic!("it ends without a result");
        };
        let result = tokio::time::timeout(Duration::from_secs(60), whole).await;
        assert_eq!(result.expect("it gets a permit").steps_done, [5, 5]);
        drop(unread);
    }
}

//! Turns queries into calls of the services within this process, so that Zenoh has every method of gRPC, with
//! the same checks and refusals.
//!
//! Bounded: `service.zenoh_queries` queries at one time, including waiting ones. Only a part of them may be
//! streams, so that streams leave room for calls. Their bytes are limited to [`MESSAGES`] times the maximum
//! of one. Further queries are refused with MAILBOX_FULL at once; if even the refusals accumulate, they get
//! no reply.

use simd_api::service::status::OrStatus as _;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream;
use simd_proto::access::TOKEN_HEADER;
use simd_proto::methods::{self, Method};
use simd_proto::raw::RawCodec;
use simd_proto::v1::ErrorReason;
use simd_proto::{API_VERSION_HEADER, CLIENT_HEADER, SESSION_HEADER, keys};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tonic::client::Grpc;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::metadata::{MetadataMap, MetadataValue};
use tonic::service::Routes;
use tonic::{Code, Request, Status, Streaming};
use zenoh::bytes::ZBytes;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait as _};

use super::Error;
use super::proofs::proven;
use super::senders::Senders;
use super::sessions::Sessions;
use simd_api::service::claims::Proven;
use simd_api::service::routes;
use simd_api::service::status::Explained;
use simd_api::service::transport::{in_full, with_reason};
use simd_api::service::unread::Holding;
use simd_world::SimHandle;
use simd_world::handle::{CallError, DaemonLimits, Peer, Transport};

/// Upper bound of the limit of one query's bytes.
const MAX_BYTES: usize = 1 << 28;
/// Number of largest messages that fit at one time.
const MESSAGES: usize = 16;
/// Maximum number of refusals on their way.
const REFUSALS: usize = 128;
/// Default duration of a stream: the default duration of a Zenoh query.
const STREAM: Duration = Duration::from_secs(10);
/// Parameter of a query with the wanted duration of a stream, seconds.
const FOR: &str = "for";

/// Accepts queries from now on.
pub(super) async fn serve(
    session: &Session,
    name: &str,
    handle: &SimHandle,
    sessions: Sessions,
    answers: &TaskTracker,
) -> Result<(Queryable<()>, Arc<Senders>), Error> {
    let system = |error| Error::Session(format!("there are no threads for replies: {error}"));
    let DaemonLimits { zenoh_queries, zenoh_streams, .. } = handle.info().limits;
    let senders = Arc::new(Senders::new(zenoh_queries + REFUSALS).map_err(system)?);
    let limit = usize::try_from(handle.info().limits.message_bytes).unwrap_or(usize::MAX).min(MAX_BYTES);
    let calls = Arc::new(Calls {
        routes: routes(handle, Transport::Zenoh),
        handle: handle.clone(),
        sessions,
        draining: handle.draining(),
        under_way: Arc::new(Semaphore::new(zenoh_queries)),
        room: Arc::new(Semaphore::new(MESSAGES.saturating_mul(limit))),
        limit,
        streams: Semaphore::new(zenoh_streams),
        senders: senders.clone(),
        refusals: Arc::new(Semaphore::new(REFUSALS)),
        answers: answers.clone(),
        runtime: tokio::runtime::Handle::current(),
    });
    let queryable = session.declare_queryable(keys::every_rpc(name)).callback(move |query| calls.take(query));
    Ok((queryable.await.map_err(Error::session)?, senders))
}

/// Permits of a query in progress: one of the queries, and its bytes.
type Permits = (OwnedSemaphorePermit, OwnedSemaphorePermit);

/// Services and permits for queries.
struct Calls {
    routes: Routes,
    handle: SimHandle,
    sessions: Sessions,
    draining: CancellationToken,
    under_way: Arc<Semaphore>,
    /// Permits for queries in progress, one per byte.
    room: Arc<Semaphore>,
    /// Maximum bytes of one query.
    limit: usize,
    streams: Semaphore,
    senders: Arc<Senders>,
    refusals: Arc<Semaphore>,
    answers: TaskTracker,
    runtime: tokio::runtime::Handle,
}

impl Calls {
    /// Runs on Zenoh's own thread, which reads for others too: it does no work here.
    fn take(self: &Arc<Self>, query: Query) {
        let refusal = match self.admit(&query) {
            Ok(permits) => {
                let proven = proven(&self.handle, query.key_expr(), query.payload(), query.attachment());
                let calls = self.clone();
                self.answers
                    .spawn_on(async move { calls.answer(query, proven, permits).await }, &self.runtime);
                return;
            }
            Err(refusal) => refusal,
        };
        let method = keys::parse_rpc(query.key_expr().as_str());
        if let Some(method) = method.and_then(|(service, method)| methods::find(service, method)) {
            self.handle.refused_beside_calls(method, Transport::Zenoh, refusal.how());
        }
        if let Ok(permit) = self.refusals.clone().try_acquire_owned() {
            let calls = self.clone();
            let refuse = async move {
                calls.end(query, Some(Err(refusal.into()))).await;
                drop(permit);
            };
            self.answers.spawn_on(refuse, &self.runtime);
        }
    }

    /// Returns the permits of a query: one of the queries, and its bytes.
    fn admit(&self, query: &Query) -> Result<Permits, Explained> {
        let bytes = query.payload().map_or(0, ZBytes::len) + query.attachment().map_or(0, ZBytes::len);
        if bytes > self.limit {
            let message = format!(
                "the message is longer than RequestLimits.max_message_bytes: it has {bytes} bytes, the limit is {}",
                self.limit
            );
            return Err(Explained::new(ErrorReason::LimitExceeded, message));
        }
        let permit = self.under_way.clone().try_acquire_owned().ok();
        let bytes = u32::try_from(bytes).ok();
        let room = bytes.and_then(|bytes| self.room.clone().try_acquire_many_owned(bytes).ok());
        let full = || {
            let message = format!(
                "{} queries, or {MESSAGES} of the largest size, are being answered already; try again",
                self.handle.info().limits.zenoh_queries
            );
            Explained::new(ErrorReason::MailboxFull, message)
        };
        permit.zip(room).ok_or_else(full)
    }

    async fn answer(&self, query: Query, proven: Proven, _permits: Permits) {
        let ended = asker(&query).and_then(|zid| self.sessions.end_of(&zid));
        let answered = self.answer_whole(&query, proven, ended.is_some());
        let answered = match ended {
            Some(ended) => ended.run_until_cancelled(answered).await,
            None => Some(answered.await),
        };
        // If the client has disconnected, there is no answer.
        let (last, _holding) = answered.unwrap_or_default();
        self.end(query, last).await;
    }

    /// Returns the last reply to a query, and the count that it holds until it is sent.
    async fn answer_whole(
        &self,
        query: &Query,
        proven: Proven,
        is_followed: bool,
    ) -> (Option<Outcome>, Option<Holding>) {
        match self.call(query, proven).await {
            Ok(answers) if answers.method.gives_many => {
                (self.stream_to(query, answers, is_followed).await, None)
            }
            Ok(Answers { method, mut messages, holding }) => {
                let last = match messages.message().await {
                    Ok(Some(answer)) => Ok((method, answer)),
                    Ok(None) => Err(Status::internal("the method gave no answer")),
                    Err(status) => Err(with_reason(status)),
                };
                (Some(last), holding)
            }
            Err(status) => (Some(Err(with_reason(status))), None),
        }
    }

    /// Sends the last reply to a query, and then the end of its replies.
    async fn end(&self, query: Query, last: Option<Outcome>) {
        let send = move || {
            if let Some(last) = last {
                reply(&query, last);
            }
            drop(query);
        };
        self.senders.send(send).await;
    }

    async fn call(&self, query: &Query, proven: Proven) -> Result<Answers, Status> {
        if self.draining.is_cancelled() {
            return Err(CallError::ShuttingDown).or_status();
        }
        let key = query.key_expr().as_str();
        let method = keys::parse_rpc(key)
            .and_then(|(service, method)| methods::find(service, method))
            .ok_or_else(|| Status::unimplemented(format!("`{key}` is not a method of simd.v1")))?;
        let payload = query.payload().map(|payload| Bytes::from(payload.to_bytes().into_owned()));
        let mut request = Request::new(stream::iter([payload.unwrap_or_default()]));
        copy_headers(query, request.metadata_mut())?;
        request.extensions_mut().insert(proven);
        if let Some(disconnect) = said_session(query).and_then(|zid| self.sessions.of(&zid)) {
            request.extensions_mut().insert(disconnect);
        }
        if let Some(source) = query.source_info() {
            request.extensions_mut().insert(Peer::Session(source.source_id().zid().to_string().into()));
        }
        // Answers may have any length, as over gRPC: a scene may be long.
        let mut services = Grpc::new(self.routes.clone()).max_decoding_message_size(usize::MAX);
        let never = |error| Status::internal(format!("the services are not ready: {error}"));
        services.ready().await.map_err(never)?;
        let answers = services.streaming(request, PathAndQuery::from_static(&method.path), RawCodec).await?;
        let holding = answers.extensions().get().cloned();
        Ok(Answers { method, messages: answers.into_inner(), holding })
    }
}

/// Answers of a method.
struct Answers {
    method: &'static Method,
    messages: Streaming<Bytes>,
    /// Count of its bytes.
    holding: Option<Holding>,
}

/// Copies the client's headers from the attachment to gRPC's metadata.
fn copy_headers(query: &Query, metadata: &mut MetadataMap) -> Result<(), Status> {
    let Some(attachment) = query.attachment() else { return Ok(()) };
    let text = attachment.to_bytes();
    let text = String::from_utf8_lossy(&text);
    if let Some(said) = keys::parse_attachment(&text, API_VERSION_HEADER) {
        let refuse =
            |_| Status::invalid_argument(format!("the attachment's {API_VERSION_HEADER} is not text"));
        metadata.insert(API_VERSION_HEADER, MetadataValue::try_from(said).map_err(refuse)?);
    }
    // Invalid names and tokens are ignored on every transport.
    for header in [CLIENT_HEADER, TOKEN_HEADER] {
        if let Some(Ok(said)) = keys::parse_attachment(&text, header).map(MetadataValue::try_from) {
            metadata.insert(header, said);
        }
    }
    Ok(())
}

/// Returns the session of a query's sender, as the query claims.
fn asker(query: &Query) -> Option<String> {
    said_session(query).or_else(|| Some(query.source_info()?.source_id().zid().to_string()))
}

/// Returns the session that the attachment of a query claims.
fn said_session(query: &Query) -> Option<String> {
    let text = query.attachment()?.to_bytes();
    keys::parse_attachment(&String::from_utf8_lossy(&text), SESSION_HEADER).map(str::to_owned)
}

/// Answer of a method, or the refusal.
type Outcome = Result<(&'static Method, Bytes), Status>;

impl Calls {
    /// Sends the answers of a stream, each as a reply. It returns the last reply, which reports the end: `OK`
    /// if the daemon ended it properly, `DEADLINE_EXCEEDED` if its time is over. The daemon does not
    /// notice the end of a session that is not followed: a stream of one has less time.
    async fn stream_to(
        &self,
        query: &Query,
        Answers { method, mut messages, holding }: Answers,
        is_followed: bool,
    ) -> Option<Outcome> {
        let limits = &self.handle.info().limits;
        let asked = match stream_length(query, limits.zenoh_stream_time) {
            Ok(length) => length,
            Err(status) => return Some(Err(status)),
        };
        let length = match is_followed {
            true => asked,
            false => asked.min(limits.zenoh_unnamed_stream_time),
        };
        // If each query is one credit, it ends with its answer.
        let is_credit = method.takes_many;
        let permit = if is_credit { None } else { self.streams.try_acquire().ok() };
        if permit.is_none() && !is_credit {
            let streams = self.handle.info().limits.zenoh_streams;
            let message = format!("{streams} streams are already in progress; try again");
            return Some(Err(Explained::new(ErrorReason::MailboxFull, message).into()));
        }
        let end = Instant::now() + length;
        let mut is_answered = false;
        loop {
            match tokio::time::timeout_at(end, messages.message()).await {
                Ok(Ok(Some(answer))) => {
                    let unread = holding.as_ref().map(|holding| holding.another(answer.len())).transpose();
                    let _unread = match unread {
                        Ok(unread) => unread,
                        Err(refused) => return Some(Err(Explained::from(&refused).into())),
                    };
                    let query = query.clone();
                    self.senders.send(move || reply(&query, Ok((method, answer)))).await;
                }
                Ok(Ok(None)) if is_credit && is_answered => return None,
                Ok(Ok(None)) => return Some(Err(Status::new(Code::Ok, "the stream ended"))),
                Ok(Err(status)) => return Some(Err(with_reason(status))),
                Err(_elapsed) => {
                    let seconds = length.as_secs_f64();
                    let message = match length < asked {
                        true => format!(
                            "{seconds} s are over, the most for a query whose session the daemon does not know; name it \
                             by a line {SESSION_HEADER} in the attachment, or ask again"
                        ),
                        false => {
                            format!("{seconds} s are over; ask again, or for longer with ?{FOR}=SECONDS")
                        }
                    };
                    return Some(Err(Status::deadline_exceeded(message)));
                }
            }
            is_answered = true;
        }
    }
}

/// Returns the wanted duration of a stream.
fn stream_length(query: &Query, longest: Duration) -> Result<Duration, Status> {
    let Some(said) = query.parameters().get(FOR) else { return Ok(STREAM) };
    let length = said.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    length.filter(|length| (Duration::ZERO..=longest).contains(length)).ok_or_else(|| {
        let limit = longest.as_secs_f64();
        let message = format!("{FOR} is {said:?}; it must be a number of seconds from 0 to {limit}");
        Explained::new(ErrorReason::InvalidValue, message).into()
    })
}

/// Sends a reply. It waits while the client does not read.
fn reply(query: &Query, outcome: Outcome) {
    let sent = match outcome {
        Ok((method, answer)) => {
            let encoding = keys::encoding(&method.answer);
            query.reply(query.key_expr(), answer).encoding(encoding).express(true).wait()
        }
        Err(status) => query.reply_err(in_full(&status)).encoding(keys::STATUS_ENCODING).wait(),
    };
    if let Err(error) = sent {
        tracing::debug!("a reply is not sent: {error}");
    }
}

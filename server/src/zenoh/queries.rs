//! A query becomes a call of the services within this process, so that Zenoh has every
//! method that gRPC has, with the same checks and the same refusals.
//!
//! Bounded: so many queries at one time (`service.zenoh_queries`), waiting ones included, of which a part streams, so that
//! streams leave room for calls; and [`MESSAGES`] times the bytes that one may have. One more is refused with
//! MAILBOX_FULL at once; where even the refusals pile up, it gets no reply.

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

/// The most that the bytes of one query can be limited to.
const MOST_BYTES: usize = 1 << 28;
/// Messages of the largest size that there is room for at one time.
const MESSAGES: usize = 16;
/// Refusals that are on their way at one time.
const REFUSALS: usize = 128;
/// How long a stream goes on where the query does not say: as long as a query of
/// Zenoh's lasts where none is given.
const STREAM: Duration = Duration::from_secs(10);
/// The parameter of a query in which the asker says how many seconds of a stream it wants.
const FOR: &str = "for";

/// Takes queries from now on.
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
    let limit = usize::try_from(handle.info().limits.message_bytes).unwrap_or(usize::MAX).min(MOST_BYTES);
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

/// Of a query under way: one of so many, and its bytes.
type Permits = (OwnedSemaphorePermit, OwnedSemaphorePermit);

/// What queries are answered with.
struct Calls {
    routes: Routes,
    handle: SimHandle,
    sessions: Sessions,
    draining: CancellationToken,
    under_way: Arc<Semaphore>,
    /// A permit for each byte of the queries under way.
    room: Arc<Semaphore>,
    /// Bytes of one query.
    limit: usize,
    streams: Semaphore,
    senders: Arc<Senders>,
    refusals: Arc<Semaphore>,
    answers: TaskTracker,
    runtime: tokio::runtime::Handle,
}

impl Calls {
    /// On Zenoh's own thread, which reads for others too: nothing is done here.
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

    /// What a query has until it is answered: one of the queries, and its bytes.
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
        let answered = self.answer_whole(&query, proven);
        let answered = match ended {
            Some(ended) => ended.run_until_cancelled(answered).await,
            None => Some(answered.await),
        };
        // Where the asker is gone there is no answer.
        let (last, _holding) = answered.unwrap_or_default();
        self.end(query, last).await;
    }

    /// The last that there is to tell a query, and what that holds until it is sent.
    async fn answer_whole(&self, query: &Query, proven: Proven) -> (Option<Outcome>, Option<Holding>) {
        match self.call(query, proven).await {
            Ok(answers) if answers.method.gives_many => (self.stream_to(query, answers).await, None),
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

    /// Tells a query the last that there is to tell. The end of its replies is sent too.
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
            .ok_or_else(|| Status::unimplemented(format!("`{key}` is no method of simd.v1")))?;
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
        // Answers may be of any length, as over gRPC: a scene is.
        let mut services = Grpc::new(self.routes.clone()).max_decoding_message_size(usize::MAX);
        let never = |error| Status::internal(format!("the services are not ready: {error}"));
        services.ready().await.map_err(never)?;
        let answers = services.streaming(request, PathAndQuery::from_static(&method.path), RawCodec).await?;
        let holding = answers.extensions().get().cloned();
        Ok(Answers { method, messages: answers.into_inner(), holding })
    }
}

/// What a method answers with.
struct Answers {
    method: &'static Method,
    messages: Streaming<Bytes>,
    /// For which its bytes count.
    holding: Option<Holding>,
}

/// Copies what the attachment says of the client to where gRPC has it.
fn copy_headers(query: &Query, metadata: &mut MetadataMap) -> Result<(), Status> {
    let Some(attachment) = query.attachment() else { return Ok(()) };
    let text = attachment.to_bytes();
    let text = String::from_utf8_lossy(&text);
    if let Some(said) = keys::parse_attachment(&text, API_VERSION_HEADER) {
        let refuse =
            |_| Status::invalid_argument(format!("the attachment's {API_VERSION_HEADER} is no text"));
        metadata.insert(API_VERSION_HEADER, MetadataValue::try_from(said).map_err(refuse)?);
    }
    // A name or a token that is none is not read, whatever carries it.
    for header in [CLIENT_HEADER, TOKEN_HEADER] {
        if let Some(Ok(said)) = keys::parse_attachment(&text, header).map(MetadataValue::try_from) {
            metadata.insert(header, said);
        }
    }
    Ok(())
}

/// The session that asks, by what the query says.
fn asker(query: &Query) -> Option<String> {
    said_session(query).or_else(|| Some(query.source_info()?.source_id().zid().to_string()))
}

/// The session that the attachment of a query says it is of.
fn said_session(query: &Query) -> Option<String> {
    let text = query.attachment()?.to_bytes();
    keys::parse_attachment(&String::from_utf8_lossy(&text), SESSION_HEADER).map(str::to_owned)
}

/// What a query gets: a method's answer, or why there is none.
type Outcome = Result<(&'static Method, Bytes), Status>;

impl Calls {
    /// Answers of a stream, each a reply. How it ended is the last one, which is left to
    /// the caller: `OK` where the daemon ended it in good order, `DEADLINE_EXCEEDED` where its time
    /// is over.
    async fn stream_to(
        &self,
        query: &Query,
        Answers { method, mut messages, holding }: Answers,
    ) -> Option<Outcome> {
        let length = match stream_length(query, self.handle.info().limits.zenoh_stream_time) {
            Ok(length) => length,
            Err(status) => return Some(Err(status)),
        };
        // Where each query is one credit it ends with its answer.
        let is_credit = method.takes_many;
        let permit = if is_credit { None } else { self.streams.try_acquire().ok() };
        if permit.is_none() && !is_credit {
            let streams = self.handle.info().limits.zenoh_streams;
            let message = format!("{streams} streams are under way already; try again");
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
                    let message =
                        format!("{seconds} s are over; ask again, or for longer with ?{FOR}=SECONDS");
                    return Some(Err(Status::deadline_exceeded(message)));
                }
            }
            is_answered = true;
        }
    }
}

/// How long the asker wants a stream to go on.
fn stream_length(query: &Query, longest: Duration) -> Result<Duration, Status> {
    let Some(said) = query.parameters().get(FOR) else { return Ok(STREAM) };
    let length = said.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    length.filter(|length| (Duration::ZERO..=longest).contains(length)).ok_or_else(|| {
        let limit = longest.as_secs_f64();
        let message = format!("{FOR} is {said:?}; it must be a number of seconds from 0 to {limit}");
        Explained::new(ErrorReason::InvalidValue, message).into()
    })
}

/// Waits where the asker does not read.
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

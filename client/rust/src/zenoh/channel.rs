//! Carries gRPC calls as Zenoh queries. The HTTP request of a generated client goes out as the payload of a
//! query, and its reply comes back as a response.

use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use bytes::Bytes;
use futures_util::{Stream, stream};
use prost::Message as _;
use simd_proto::access::TOKEN_HEADER;
use simd_proto::methods::{self, Method};
use simd_proto::raw::RawCodec;
use simd_proto::{API_VERSION_HEADER, CLIENT_HEADER, keys, proof};
use tonic::body::Body;
use tonic::codegen::{Service, http};
use tonic::metadata::MetadataMap;
use tonic::server::{Grpc, StreamingService};
use tonic::{Code, Request, Response, Status, Streaming};
use tonic_types::pb;
use zenoh::Wait as _;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply, ReplyError};
use zenoh::session::ZenohId;

use super::{MAX_MESSAGE_BYTES, Network, daemons, streams};

/// Timeout of Zenoh queries. Calls have their own, shorter ones; a daemon that ends also ends its queries at
/// once.
const GIVE_UP: Duration = Duration::from_secs(3600);

pub(super) type BoxFuture<T> = Pin<Box<dyn Future<Output = T> + Send>>;
pub(super) type Answers = Pin<Box<dyn Stream<Item = Result<Bytes, Status>> + Send>>;

/// Carries the calls to one daemon.
#[derive(Clone, Debug)]
pub(crate) struct ZenohChannel {
    network: Network,
    name: Arc<str>,
}

impl ZenohChannel {
    pub(super) fn new(network: Network, name: &str) -> Self {
        Self { network, name: name.into() }
    }

    /// Returns the only answer of a unary method.
    pub(super) async fn ask(&self, method: &Method, asked: Asked) -> Result<Bytes, Status> {
        match self.query(method, asked, "").await?.next().await {
            Some(reply) => answer(reply),
            None => Err(self.no_daemon()),
        }
    }

    /// Checks that the daemon accepts the request of a stream, without waiting for further answers.
    pub(super) async fn check(&self, method: &Method, asked: Asked) -> Result<(), Status> {
        match self.query(method, asked, "?for=0").await?.next().await.map(answer) {
            Some(Ok(_answer)) => Ok(()),
            Some(Err(status)) if status.code() == Code::DeadlineExceeded => Ok(()),
            Some(Err(status)) => Err(status),
            None => Err(self.no_daemon()),
        }
    }

    /// Returns the session of the daemon, which changes with each start.
    ///
    /// # Errors
    /// Returns an error if no daemon has the name, or several claim it.
    pub(super) async fn daemon(&self) -> Result<ZenohId, Status> {
        let chosen = match self.chosen()? {
            // The daemon may have answered before its liveliness token was reported.
            None => {
                self.network
                    .look(&keys::daemons_named(&self.name))
                    .await
                    .map_err(|error| Status::unavailable(super::first_words(&error)))?;
                self.chosen()?
            }
            chosen => chosen,
        };
        chosen.ok_or_else(|| self.no_daemon())
    }

    fn chosen(&self) -> Result<Option<ZenohId>, Status> {
        let chosen = self.network.daemons.choose(&self.name);
        chosen.map_err(|several| Status::failed_precondition(daemons::several(&self.name, &several)))
    }

    /// Streams the answers of a method, as the daemon sends them.
    async fn stream(self, method: &'static Method, asked: Asked) -> Result<Answers, Status> {
        let replies = self.query(method, asked, &format!("?for={}", GIVE_UP.as_secs())).await?;
        let next = move |replies: Replies| {
            let no_daemon = self.no_daemon();
            async move {
                match replies.next().await.map(answer) {
                    Some(Ok(answer)) => Ok(Some((answer, replies))),
                    Some(Err(status)) if status.code() == Code::Ok => Ok(None),
                    Some(Err(status)) => Err(status),
                    // The last reply says how the stream ended; here it is missing.
                    None => Err(no_daemon),
                }
            }
        };
        Ok(Box::pin(stream::try_unfold(replies, next)))
    }

    async fn query(&self, method: &Method, asked: Asked, parameters: &str) -> Result<Replies, Status> {
        let daemon = self.daemon().await?;
        let (service, name) = methods::parse_path(&method.path).unwrap_or_default();
        let key = keys::rpc(&self.name, service, name);
        // The secret of a claim is not sent.
        let (message, secret) = match proof::seal(&method.request, &asked.message) {
            Some((message, secret)) => (message.into(), Some(secret)),
            None => (asked.message, None),
        };
        // A claim or a marker may be bound to the session, and a stream ends with it.
        let session = (method.gives_many || matches!(name, "ClaimJoints" | "AddMarkers"))
            .then(|| self.network.tokens.declare(&self.network.session, &self.name));
        let session = session.transpose().map_err(|error| Status::unavailable(super::first_words(&error)))?;
        let send = |proof: Option<String>| {
            let headers = (!asked.headers.is_empty()).then(|| asked.headers.to_string());
            let lines = [headers, session.clone(), proof];
            let lines: Vec<String> = lines.into_iter().flatten().collect();
            let query = self
                .network
                .session
                .get(format!("{key}{parameters}"))
                .payload(message.clone())
                .encoding(keys::encoding(&method.request))
                .attachment((!lines.is_empty()).then(|| lines.join("\n")))
                // Without this, only one session that claims to have all answers would be asked.
                .target(QueryTarget::All)
                .consolidation(ConsolidationMode::None)
                .express(true)
                .timeout(GIVE_UP);
            query.wait()
        };
        let replies = match secret {
            Some(secret) => self.network.counter.prove(&secret, &key, &message, send),
            None => send(None),
        };
        let replies = replies.map_err(|error| Status::unavailable(super::first_words(&error)))?;
        Ok(Replies { replies, daemon })
    }

    fn no_daemon(&self) -> Status {
        Status::unavailable(format!("there is no daemon called `{}`", self.name))
    }
}

/// Replies to a query.
struct Replies {
    replies: zenoh::handlers::FifoChannelHandler<Reply>,
    /// Session that was asked.
    daemon: ZenohId,
}

impl Replies {
    /// Returns the daemon's next reply and ignores replies of other sessions. `None` after the last one.
    async fn next(&self) -> Option<Reply> {
        loop {
            let reply = self.replies.recv_async().await.ok()?;
            match reply.replier_id() {
                Some(from) if from.zid() == self.daemon => return Some(reply),
                // A timeout of Zenoh itself, within this process.
                None if reply.result().is_err_and(is_timeout) => return Some(reply),
                Some(_) | None => {}
            }
        }
    }
}

/// Returns whether this is Zenoh's own timeout. A refusal of a daemon has another encoding.
fn is_timeout(error: &ReplyError) -> bool {
    !error.encoding().to_string().starts_with("application/protobuf")
        && String::from_utf8_lossy(&error.payload().to_bytes()).contains("Timeout")
}

/// A request with its headers.
#[derive(Clone, Debug)]
pub(super) struct Asked {
    pub(super) message: Bytes,
    /// Headers of the client, as lines of the attachment.
    pub(super) headers: Arc<str>,
}

/// Returns the part of a request's metadata that the daemon reads.
fn headers(metadata: &MetadataMap) -> Arc<str> {
    let read = |name| Some((name, metadata.get(name)?.to_str().ok()?));
    keys::attachment([API_VERSION_HEADER, CLIENT_HEADER, TOKEN_HEADER].into_iter().filter_map(read)).into()
}

/// Converts a reply to an answer or a status.
fn answer(reply: Reply) -> Result<Bytes, Status> {
    match reply.into_result() {
        Ok(sample) => Ok(Bytes::from(sample.payload().to_bytes().into_owned())),
        Err(error) => Err(refusal(&error)),
    }
}

/// Converts a refusal of the daemon, or an error of Zenoh itself.
fn refusal(error: &ReplyError) -> Status {
    let payload = error.payload().to_bytes();
    if error.encoding().to_string().starts_with("application/protobuf")
        && let Ok(status) = pb::Status::decode(&*payload)
    {
        let details = Bytes::from(payload.into_owned());
        return Status::with_details(Code::from(status.code), status.message, details);
    }
    match is_timeout(error) {
        true => Status::deadline_exceeded("the query timed out"),
        false => Status::unavailable(String::from_utf8_lossy(&payload).into_owned()),
    }
}

impl Service<http::Request<Body>> for ZenohChannel {
    type Response = http::Response<Body>;
    type Error = Infallible;
    type Future = BoxFuture<Result<http::Response<Body>, Infallible>>;

    fn poll_ready(&mut self, _context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, request: http::Request<Body>) -> Self::Future {
        let path = request.uri().path();
        let method = methods::parse_path(path).and_then(|(service, name)| methods::find(service, name));
        let Some(method) = method else {
            let status = Status::unimplemented(format!("`{path}` is not a method of simd.v1"));
            return Box::pin(std::future::ready(Ok(status.into_http())));
        };
        let call = Call { channel: self.clone(), method };
        Box::pin(async move {
            Ok(Grpc::new(RawCodec)
                .max_decoding_message_size(MAX_MESSAGE_BYTES)
                .streaming(call, request)
                .await)
        })
    }
}

/// One call of one method.
struct Call {
    channel: ZenohChannel,
    method: &'static Method,
}

impl StreamingService<Bytes> for Call {
    type Response = Bytes;
    type ResponseStream = Answers;
    type Future = BoxFuture<Result<Response<Answers>, Status>>;

    fn call(&mut self, request: Request<Streaming<Bytes>>) -> Self::Future {
        let (channel, method) = (self.channel.clone(), self.method);
        Box::pin(async move {
            let headers = headers(request.metadata());
            let mut requests = request.into_inner();
            if method.takes_many {
                return Ok(Response::new(streams::control(channel, method, requests, headers)));
            }
            let message = requests.message().await?.unwrap_or_default();
            let asked = Asked { message, headers };
            let answers: Answers = match method.path.as_str() {
                "/simd.v1.JointService/WatchJointStates" => {
                    streams::joint_states(channel, method, asked).await?
                }
                "/simd.v1.SensorService/WatchSensorReadings" => {
                    streams::sensor_readings(channel, method, asked).await?
                }
                "/simd.v1.EventService/WatchEvents" => streams::events(channel, asked).await?,
                "/simd.v1.ParameterService/WatchParameters" => streams::parameters(channel, asked).await?,
                _ if method.gives_many => channel.stream(method, asked).await?,
                _ => {
                    let answer = channel.ask(method, asked).await?;
                    Box::pin(stream::iter([Ok(answer)]))
                }
            };
            Ok(Response::new(answers))
        })
    }
}

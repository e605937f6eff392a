//! Carries calls of gRPC as queries of Zenoh: what the generated clients put into an
//! HTTP request goes out as the payload of a query, and its reply comes back as a response.

use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use bytes::Bytes;
use futures_util::{Stream, stream};
use prost::Message as _;
use simd_proto::methods::{self, Method};
use simd_proto::raw::RawCodec;
use simd_proto::{API_VERSION_HEADER, CLIENT_HEADER, keys};
use tonic::body::Body;
use tonic::codegen::{Service, http};
use tonic::metadata::MetadataMap;
use tonic::server::{Grpc, StreamingService};
use tonic::{Code, Request, Response, Status, Streaming};
use tonic_types::pb;
use zenoh::Session;
use zenoh::query::{ConsolidationMode, Reply, ReplyError};

use super::{MAX_MESSAGE_BYTES, streams};

/// Zenoh gives up on a query after this time. Calls have their own, shorter ones; a
/// daemon that is gone ends its queries at once.
const GIVE_UP: Duration = Duration::from_secs(3600);

pub(super) type BoxFuture<T> = Pin<Box<dyn Future<Output = T> + Send>>;
pub(super) type Answers = Pin<Box<dyn Stream<Item = Result<Bytes, Status>> + Send>>;

/// The calls of one daemon.
#[derive(Clone, Debug)]
pub(crate) struct ZenohChannel {
    session: Session,
    name: Arc<str>,
}

impl ZenohChannel {
    pub(super) fn new(session: Session, name: &str) -> Self {
        Self { session, name: name.into() }
    }

    /// The only answer of a method that has one.
    pub(super) async fn ask(&self, method: &Method, asked: Asked) -> Result<Bytes, Status> {
        let replies = self.query(method, asked, "").await?;
        match replies.recv_async().await {
            Ok(reply) => answer(reply),
            Err(_closed) => Err(self.nobody()),
        }
    }

    /// Whether the daemon takes the request of a stream; it gives no more of it than is there.
    pub(super) async fn check(&self, method: &Method, asked: Asked) -> Result<(), Status> {
        let replies = self.query(method, asked, "?for=0").await?;
        match replies.recv_async().await.map(answer) {
            Ok(Ok(_answer)) => Ok(()),
            Ok(Err(status)) if status.code() == Code::DeadlineExceeded => Ok(()),
            Ok(Err(status)) => Err(status),
            Err(_closed) => Err(self.nobody()),
        }
    }

    /// All answers of a method that has many, as the daemon sends them.
    async fn stream(self, method: &'static Method, asked: Asked) -> Result<Answers, Status> {
        let replies = self.query(method, asked, &format!("?for={}", GIVE_UP.as_secs())).await?;
        let next = move |replies: Replies| {
            let nobody = self.nobody();
            async move {
                match replies.recv_async().await.map(answer) {
                    Ok(Ok(answer)) => Ok(Some((answer, replies))),
                    Ok(Err(status)) if status.code() == Code::Ok => Ok(None),
                    Ok(Err(status)) => Err(status),
                    // The last reply says how it ended; there was none.
                    Err(_closed) => Err(nobody),
                }
            }
        };
        Ok(Box::pin(stream::try_unfold(replies, next)))
    }

    async fn query(&self, method: &Method, asked: Asked, parameters: &str) -> Result<Replies, Status> {
        let (service, name) = methods::parse_path(&method.path).unwrap_or_default();
        let selector = format!("{}{parameters}", keys::rpc(&self.name, service, name));
        let query = self
            .session
            .get(selector)
            .payload(asked.message)
            .encoding(keys::encoding(&method.request))
            .attachment((!asked.headers.is_empty()).then(|| &*asked.headers))
            .consolidation(ConsolidationMode::None)
            .express(true)
            .timeout(GIVE_UP);
        query.await.map_err(|error| Status::unavailable(super::first_words(&error)))
    }

    fn nobody(&self) -> Status {
        Status::unavailable(format!("no daemon called `{}` is there", self.name))
    }
}

type Replies = zenoh::handlers::FifoChannelHandler<Reply>;

/// A request, and what goes with it.
#[derive(Clone, Debug)]
pub(super) struct Asked {
    pub(super) message: Bytes,
    /// What it says of the client, as the attachment has it.
    pub(super) headers: Arc<str>,
}

/// Of a request's metadata what the daemon reads.
fn headers(metadata: &MetadataMap) -> Arc<str> {
    let read = |name| Some((name, metadata.get(name)?.to_str().ok()?));
    keys::attachment([API_VERSION_HEADER, CLIENT_HEADER].into_iter().filter_map(read)).into()
}

/// What a reply says.
fn answer(reply: Reply) -> Result<Bytes, Status> {
    match reply.into_result() {
        Ok(sample) => Ok(Bytes::from(sample.payload().to_bytes().into_owned())),
        Err(error) => Err(refusal(&error)),
    }
}

/// A refusal of the daemon's, or what Zenoh itself says.
fn refusal(error: &ReplyError) -> Status {
    let payload = error.payload().to_bytes();
    if error.encoding().to_string().starts_with("application/protobuf")
        && let Ok(status) = pb::Status::decode(&*payload)
    {
        let details = Bytes::from(payload.into_owned());
        return Status::with_details(Code::from(status.code), status.message, details);
    }
    let text = String::from_utf8_lossy(&payload).into_owned();
    match text.contains("Timeout") {
        true => Status::deadline_exceeded("the query timed out"),
        false => Status::unavailable(text),
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
            let status = Status::unimplemented(format!("`{path}` is no method of simd.v1"));
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

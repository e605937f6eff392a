//! Follows each call of a connection: which side waits for the other, and how long its request may take to
//! arrive.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{StatusCode, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use bytes::Bytes;
use http_body::{Body as _, Frame, SizeHint};
use simd_proto::methods;
use simd_proto::v1::ErrorReason;
use tokio::time::{Instant, Sleep};
use tonic::Status;

use super::activity::{Activity, Call};
use super::deadline::{Deadline, StreamEnd};
use crate::config::Connections;
use crate::connect;
use simd_api::service::status::Explained;
use simd_api::service::unread::{Flowing, Holding};
use simd_world::SimHandle;
use simd_world::account::Account;
use simd_world::handle::{Disconnect, Peer};
use simd_world::unread_answers::{CALL, Reader};

/// Connection of a request.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    pub(super) peer: Peer,
    pub(super) activity: Arc<Activity>,
    pub(super) disconnect: Disconnect,
}

/// Wraps request and answer, if the request arrived by a connection.
pub(super) async fn follow(
    State((limits, handle)): State<(Connections, SimHandle)>,
    mut request: Request,
    next: Next,
) -> Response {
    let Some(Origin { peer, activity, disconnect }) = request.extensions_mut().remove() else {
        return next.run(request).await;
    };
    let recount = Recount::of(&request);
    let reader = reader(&peer);
    request.extensions_mut().insert(peer);
    request.extensions_mut().insert(disconnect);
    let call = Call::begin(&activity);
    let pace = match is_stream(&request) {
        true => Pace::Stream { silence: limits.stream_silence },
        false => Pace::Message { time: limits.body, bytes_per_second: limits.body_bytes_per_second },
    };
    let mut request = request.map(|body| match body.is_end_stream() {
        true => body,
        false => Body::new(Arriving::new(body, pace, Arc::clone(&call))),
    });
    let deadline = request.extensions_mut().remove::<Deadline>();
    let mut response = match deadline {
        Some(deadline) => deadline.hold(next.run(request)).await,
        None => next.run(request).await,
    };
    let is_counted = response.extensions_mut().remove::<Holding>().is_some();
    let response = match recount {
        Recount::Never => response,
        Recount::Uncounted if is_counted => response,
        Recount::Uncounted | Recount::Always => count(&handle, &reader, response),
    };
    let end = deadline.and_then(Deadline::of_stream);
    response.map(|body| Body::new(Leaving { body, is_taken: true, call, end }))
}

/// Selection of the bodies of answers that are counted here.
#[derive(Clone, Copy, Debug)]
enum Recount {
    /// None: health and metrics are small.
    Never,
    /// Bodies that no service has counted.
    Uncounted,
    /// All: the front-end encodes the service's counted bytes again.
    Always,
}

impl Recount {
    fn of(request: &Request) -> Self {
        let media = request.headers().get(header::CONTENT_TYPE).map(|media| media.as_bytes());
        match request.uri().path() {
            "/healthz" | "/readyz" | "/metrics" => Self::Never,
            path if path.starts_with("/grpc.health.") => Self::Never,
            _ if media.is_some_and(|media| media.starts_with(b"application/grpc-web-text")) => Self::Always,
            _ if connect::is_json(request.headers()) => Self::Always,
            _ => Self::Uncounted,
        }
    }
}

/// Returns the client that uncounted answers count for, regardless of its token.
fn reader(peer: &Peer) -> Reader {
    let connection = match peer {
        Peer::Connection { number, .. } => Some(*number),
        Peer::Session(_) | Peer::Process => None,
    };
    Reader { account: Account::from(peer), connection }
}

/// Counts the bytes of an answer until its client has read them.
fn count(handle: &SimHandle, reader: &Reader, response: Response) -> Response {
    // An answer of known size is refused or accepted as a whole.
    let known = response.body().size_hint().exact();
    match handle.unread_answers().hold(reader, CALL + known.unwrap_or_default()) {
        Ok(unread) => response.map(|body| match known {
            Some(_) => Body::new(Flowing::of_known_size(body, unread)),
            None => Body::new(Flowing::new(body, unread)),
        }),
        Err(refused) => (StatusCode::SERVICE_UNAVAILABLE, format!("{refused}\n")).into_response(),
    }
}

/// Returns whether the method takes an unlimited number of requests for an unlimited time. HTTP/1.1 and JSON have
/// none: they send a request as a whole.
fn is_stream(request: &Request) -> bool {
    let media = request.headers().get(header::CONTENT_TYPE).map(|media| media.as_bytes());
    let is_web = media.is_some_and(|media| media.starts_with(b"application/grpc-web"));
    if request.version() != Version::HTTP_2 || is_web || connect::is_json(request.headers()) {
        return false;
    }
    let path = request.uri().path();
    let method = methods::parse_path(path).and_then(|(service, method)| methods::find(service, method));
    method.is_some_and(|method| method.takes_many)
        // Tools keep it open between questions.
        || path.starts_with("/grpc.reflection.")
}

/// Permitted arrival of a request.
#[derive(Clone, Copy, Debug)]
enum Pace {
    /// One message, within a fixed time plus the time that its bytes earn.
    Message { time: Duration, bytes_per_second: u64 },
    /// Messages with silence between them.
    Stream { silence: Duration },
}

/// Body of a request on its way to its service.
struct Arriving {
    body: Body,
    pace: Pace,
    deadline: Instant,
    /// Created when the body must be waited for, which is rare.
    timer: Option<Pin<Box<Sleep>>>,
    call: Arc<Call>,
}

impl Arriving {
    fn new(body: Body, pace: Pace, call: Arc<Call>) -> Self {
        let time = match pace {
            Pace::Message { time, .. } => {
                call.wait();
                time
            }
            // The client may be waiting for its answers.
            Pace::Stream { silence } => silence,
        };
        Self { body, pace, deadline: Instant::now() + time, timer: None, call }
    }

    fn arrived(&mut self, bytes: usize) {
        match self.pace {
            Pace::Message { bytes_per_second, .. } => {
                self.deadline += Duration::from_secs_f64(bytes as f64 / bytes_per_second as f64);
            }
            Pace::Stream { silence } => self.deadline = Instant::now() + silence,
        }
    }

    fn check(&mut self, context: &mut Context<'_>) -> Poll<Status> {
        let deadline = self.deadline;
        let timer = self.timer.get_or_insert_with(|| Box::pin(tokio::time::sleep_until(deadline)));
        if timer.deadline() != deadline {
            timer.as_mut().reset(deadline);
        }
        ready!(timer.as_mut().poll(context));
        let sentence = match self.pace {
            Pace::Message { time, bytes_per_second } => format!(
                "the request did not arrive within {} s and a second for each {bytes_per_second} bytes",
                time.as_secs_f64()
            ),
            Pace::Stream { silence } => {
                format!("the client sent nothing into its stream for {} s", silence.as_secs_f64())
            }
        };
        Poll::Ready(Explained::new(ErrorReason::LimitExceeded, sentence).into())
    }
}

impl Drop for Arriving {
    fn drop(&mut self) {
        if let Pace::Message { .. } = self.pace {
            self.call.resume();
        }
    }
}

impl http_body::Body for Arriving {
    type Data = Bytes;
    type Error = axum::BoxError;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::BoxError>>> {
        match Pin::new(&mut self.body).poll_frame(context) {
            Poll::Ready(Some(Ok(frame))) => {
                self.arrived(frame.data_ref().map_or(0, Bytes::len));
                Poll::Ready(Some(Ok(frame)))
            }
            Poll::Ready(other) => Poll::Ready(other.map(|frame| frame.map_err(Into::into))),
            Poll::Pending => self.check(context).map(|status| Some(Err(status.into()))),
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// Body of an answer on its way to its client. The next frame is requested once there is room for one, so the
/// silence reveals a client that does not read.
struct Leaving {
    body: Body,
    /// Whether the last frame was taken.
    is_taken: bool,
    call: Arc<Call>,
    /// Deadline of the client, which ends a stream that has nothing to send.
    end: Option<StreamEnd>,
}

impl http_body::Body for Leaving {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if !self.is_taken {
            self.is_taken = true;
            self.call.resume();
        }
        if self.end.as_ref().is_some_and(StreamEnd::is_over) {
            return Poll::Ready(None);
        }
        let frame = match (Pin::new(&mut self.body).poll_frame(context), &mut self.end) {
            (Poll::Ready(frame), _) => frame,
            (Poll::Pending, Some(end)) => Some(Ok(ready!(end.poll(context)))),
            (Poll::Pending, None) => return Poll::Pending,
        };
        if matches!(frame, Some(Ok(_))) {
            self.is_taken = false;
            self.call.wait();
        }
        Poll::Ready(frame)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

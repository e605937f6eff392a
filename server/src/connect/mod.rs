//! The Connect protocol with JSON: each method as `POST /simd.v1.SERVICE/METHOD`, for curl and for programs without
//! generated code. See <https://connectrpc.com/docs/protocol>.
//!
//! * Here: the layer around the services. It turns a request into one of gRPC, and the answer back.
//! * `arriving`: the bytes of a request, which all clients share.
//! * `json`: messages as JSON and back, by the compiled schema.
//! * `frames`: messages of a body of gRPC. `errors`: errors as the protocol writes them.
//! * `openapi`: the same methods as OpenAPI.
//!
//! Below the layer such a call is one of gRPC, so tokens, claims, limits and retries hold. A request is one message:
//! methods that take a stream of requests are refused.

mod arriving;
mod errors;
mod frames;
mod json;
mod openapi;

use std::convert::Infallible;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method as Verb, Version, header};
use axum::response::Response;
use futures_util::future::BoxFuture;
use simd_proto::methods::{self, Method};
use tokio::time::Instant;
use tonic::{Code, Status};
use tower_layer::Layer;
use tower_service::Service;

use self::frames::Frames;
pub(crate) use self::openapi::document;

/// Maximum size of a request, in bytes and in values. A value takes up to 56 bytes while the request is read.
const MAX_REQUEST: usize = 16 << 20;
const MAX_VALUES: usize = 500_000;
/// Maximum size of a message of an answer, before it is written as JSON.
const MAX_ANSWER: usize = 4 << 20;
const UNARY: &str = "application/json";
const STREAM: &str = "application/connect+json";
/// Longest time that a client may give, in milliseconds: ten digits, as the protocol has it.
const MAX_TIMEOUT_MS: u64 = 9_999_999_999;

/// Returns whether a request is for this layer, by its media type.
pub(crate) fn is_json(headers: &HeaderMap) -> bool {
    media(headers).is_some_and(|media| media == UNARY || media == STREAM)
}

/// Returns the media type without its parameters.
fn media(headers: &HeaderMap) -> Option<&str> {
    let text = headers.get(header::CONTENT_TYPE)?.to_str().ok()?;
    Some(text.split(';').next().unwrap_or_default().trim())
}

/// Layer around the services.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JsonLayer;

impl<S> Layer<S> for JsonLayer {
    type Service = Json<S>;

    fn layer(&self, services: S) -> Json<S> {
        Json { services }
    }
}

/// The services, which also answer in JSON.
#[derive(Clone, Debug)]
pub(crate) struct Json<S> {
    services: S,
}

impl<S> Service<Request> for Json<S>
where
    S: Service<Request, Response = Response, Error = Infallible> + Clone + Send + 'static,
    S::Future: Send,
{
    type Response = Response;
    type Error = Infallible;
    type Future = BoxFuture<'static, Result<Response, Infallible>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.services.poll_ready(context)
    }

    fn call(&mut self, request: Request) -> Self::Future {
        // The clone replaces the service that is ready.
        let clone = self.services.clone();
        let mut services = std::mem::replace(&mut self.services, clone);
        let path = request.uri().path();
        let method = methods::parse_path(path).and_then(|(service, method)| methods::find(service, method));
        let kind = media(request.headers());
        let Some(method) = method else { return Box::pin(services.call(request)) };
        if kind.is_some_and(|kind| kind.starts_with("application/grpc")) || request.method() != Verb::POST {
            return Box::pin(services.call(request));
        }
        let is_stream = match kind {
            Some(UNARY) => false,
            Some(STREAM) => true,
            _ => return Box::pin(async { Ok(errors::wrong_media()) }),
        };
        Box::pin(async move {
            let call = Call { method, is_stream };
            Ok(match call.answer(services, request).await {
                Ok(response) => response,
                Err(refusal) => call.refused(&refusal),
            })
        })
    }
}

/// A call in JSON.
#[derive(Clone, Copy, Debug)]
struct Call {
    method: &'static Method,
    /// Whether the client uses the form of streams, with a prefix for each message.
    is_stream: bool,
}

impl Call {
    async fn answer<S>(self, mut services: S, request: Request) -> Result<Response, Status>
    where
        S: Service<Request, Response = Response, Error = Infallible>,
    {
        let Method { takes_many, gives_many, path, request: asked, .. } = self.method;
        if *takes_many {
            return Err(Status::unimplemented(format!(
                "{path} takes a stream of requests, which JSON does not have here: use gRPC"
            )));
        }
        if *gives_many != self.is_stream {
            let media = if *gives_many { STREAM } else { UNARY };
            return Err(Status::unimplemented(format!("{path} needs the content type {media}")));
        }
        let end = deadline(request.headers())?;
        let (mut parts, body) = request.into_parts();
        let (sent, share) = arriving::whole(body).await?;
        let message = match self.is_stream {
            true => json::read(asked, &frames::only(&sent)?)?,
            false => json::read(asked, &sent)?,
        };
        drop((sent, share));
        for name in [header::CONTENT_LENGTH, header::CONTENT_ENCODING, header::ACCEPT_ENCODING] {
            parts.headers.remove(name);
        }
        parts.headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/grpc"));
        parts.headers.insert(header::TE, HeaderValue::from_static("trailers"));
        parts.version = Version::HTTP_2;
        let request = Request::from_parts(parts, Body::from(frames::framed(0, &message)));
        if self.is_stream {
            let response = within(end, services.call(request)).await?.unwrap_or_else(|never| match never {});
            return match Status::from_header_map(response.headers()) {
                Some(refused) if refused.code() != Code::Ok => Err(refused),
                _ => Ok(self.stream(response, end)),
            };
        }
        within(end, async {
            self.unary(services.call(request).await.unwrap_or_else(|never| match never {})).await
        })
        .await?
    }

    /// Returns the one message of an answer of gRPC as JSON.
    async fn unary(self, response: Response) -> Result<Response, Status> {
        let (mut parts, body) = response.into_parts();
        let mut frames = Frames::new(body, &parts.headers);
        let message = frames.next().await?;
        let trailers = match frames.next().await? {
            Some(_) => return Err(Status::internal("the service sent two answers")),
            None => frames.trailers(),
        };
        let Some(message) = message else {
            return Err(Status::internal("the service sent no answer"));
        };
        let text = json::write(&self.method.answer, &message)?;
        own_headers(&mut parts.headers);
        for (name, value) in trailers.iter().filter(|(name, _)| !name.as_str().starts_with("grpc-")) {
            if let Ok(name) = HeaderName::try_from(format!("trailer-{name}")) {
                parts.headers.append(name, value.clone());
            }
        }
        parts.headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(UNARY));
        Ok(Response::from_parts(parts, Body::from(text)))
    }

    /// Returns an answer of gRPC as a stream of JSON, which ends with an error or an empty object.
    fn stream(self, response: Response, end: Option<Instant>) -> Response {
        let (mut parts, body) = response.into_parts();
        let frames = Frames::new(body, &parts.headers);
        let messages = futures_util::stream::unfold(Some(frames), move |frames| async move {
            let mut frames = frames?;
            let next = within(end, frames.next()).await.and_then(|next| next);
            let text = next
                .and_then(|next| next.map(|message| json::write(&self.method.answer, &message)).transpose());
            Some(match text {
                Ok(Some(text)) => (Ok::<Bytes, Infallible>(frames::framed(0, &text)), Some(frames)),
                Ok(None) => (Ok(frames::end(None)), None),
                Err(refusal) => (Ok(frames::end(Some(&refusal))), None),
            })
        });
        own_headers(&mut parts.headers);
        parts.headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(STREAM));
        Response::from_parts(parts, Body::from_stream(messages))
    }

    fn refused(self, refusal: &Status) -> Response {
        if !self.is_stream {
            return errors::response(refusal);
        }
        let mut response = Response::new(Body::from(frames::end(Some(refusal))));
        response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(STREAM));
        response
    }
}

/// Removes headers of gRPC.
fn own_headers(headers: &mut HeaderMap) {
    let names: Vec<_> = headers.keys().filter(|name| name.as_str().starts_with("grpc-")).cloned().collect();
    for name in names.into_iter().chain([header::CONTENT_LENGTH, header::TRAILER]) {
        headers.remove(name);
    }
}

/// Returns the end of the time that a client gives its call.
fn deadline(headers: &HeaderMap) -> Result<Option<Instant>, Status> {
    let Some(text) = headers.get("connect-timeout-ms") else { return Ok(None) };
    let number = text.to_str().ok().and_then(|text| text.parse::<u64>().ok());
    match number.filter(|number| *number <= MAX_TIMEOUT_MS) {
        Some(number) => Ok(Instant::now().checked_add(Duration::from_millis(number))),
        None => Err(Status::invalid_argument("connect-timeout-ms is not a whole number of milliseconds")),
    }
}

/// Waits until `end` at most.
async fn within<T>(end: Option<Instant>, answer: impl Future<Output = T>) -> Result<T, Status> {
    let Some(end) = end else { return Ok(answer.await) };
    tokio::time::timeout_at(end, answer)
        .await
        .map_err(|_elapsed| Status::deadline_exceeded("the call took longer than its client allows"))
}

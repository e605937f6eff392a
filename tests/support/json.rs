//! JSON over HTTP/1.1 by the Connect protocol, as curl asks. Methods that take a stream of requests go over gRPC-Web.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::LazyLock;
use std::task::{Context, Poll};

use axum::body::Body as Text;
use futures_util::StreamExt as _;
use http_body_util::{BodyExt as _, StreamBody};
use hyper_util::client::legacy::Client as HttpClient;
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioExecutor;
use prost::Message as _;
use prost::bytes::{Buf as _, BufMut as _, Bytes, BytesMut};
use prost_reflect::{DescriptorPool, DynamicMessage, SerializeOptions};
use serde_json::Value;
use simd_client::Client;
use simd_proto::methods::{self, Method};
use tonic::body::Body;
use tonic::codegen::Service;
use tonic::codegen::http::{self, HeaderMap, HeaderValue, Request, Response};
use tonic::{Code, Status};
use tonic_types::pb;

use crate::web::Web;

static SCHEMA: LazyLock<DescriptorPool> =
    LazyLock::new(|| DescriptorPool::decode(simd_proto::v1::FILE_DESCRIPTOR_SET).unwrap_or_default());

/// Returns a client with separate connections.
pub fn client(address: SocketAddr) -> Client {
    let http = HttpClient::builder(TokioExecutor::new()).build(HttpConnector::new());
    Client::within(Json { http, web: Web::new(address), address })
}

#[derive(Clone)]
struct Json {
    http: HttpClient<HttpConnector, Text>,
    web: Web,
    address: SocketAddr,
}

impl Service<Request<Body>> for Json {
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Infallible>> + Send>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, request: Request<Body>) -> Self::Future {
        let path = methods::parse_path(request.uri().path());
        match path.and_then(|(service, method)| methods::find(service, method)) {
            Some(method) if !method.takes_many => {
                let this = self.clone();
                Box::pin(async move { Ok(this.ask(method, request).await.unwrap_or_else(Status::into_http)) })
            }
            _ => self.web.call(request),
        }
    }
}

impl Json {
    async fn ask(self, method: &'static Method, request: Request<Body>) -> Result<Response<Body>, Status> {
        let _asking = self.web.asking.clone().acquire_owned().await;
        let (parts, body) = request.into_parts();
        let mut sent = body.collect().await?.to_bytes();
        sent.advance(sent.len().min(5));
        let text = to_json(&method.request, sent)?;
        let mut asking = Request::post(format!("http://{}{}", self.address, method.path));
        if let Some(headers) = asking.headers_mut() {
            *headers = parts.headers;
            for name in ["te", "grpc-accept-encoding", "grpc-encoding", "user-agent"] {
                headers.remove(name);
            }
            let media = if method.gives_many { "application/connect+json" } else { "application/json" };
            headers.insert("content-type", HeaderValue::from_static(media));
            let timeout = headers.remove("grpc-timeout");
            if let Some(milliseconds) = timeout.as_ref().and_then(|text| milliseconds(text.to_str().ok()?)) {
                headers.insert("connect-timeout-ms", HeaderValue::from(milliseconds));
            }
        }
        let body = if method.gives_many { framed(0, &text) } else { text.into() };
        let asking = asking.body(Text::from(body)).map_err(|error| Status::internal(error.to_string()))?;
        let answer =
            self.http.request(asking).await.map_err(|error| Status::unavailable(error.to_string()))?;
        let (mut parts, body) = answer.into_parts();
        parts.headers.remove("content-length");
        parts.headers.insert("content-type", HeaderValue::from_static("application/grpc"));
        if method.gives_many {
            let is_whole = http_body::Body::size_hint(&body).exact().is_some();
            let mut body = Text::new(body);
            // A refused stream is its error alone.
            if is_whole {
                let bytes =
                    body.collect().await.map_err(|error| Status::unavailable(error.to_string()))?.to_bytes();
                if let [2, _, _, _, _, end @ ..] = &bytes[..]
                    && let Some(error) = serde_json::from_slice::<Value>(end).unwrap_or_default().get("error")
                {
                    return Err(status_of(error));
                }
                body = Text::from(bytes);
            }
            let body = Body::new(StreamBody::new(frames(method, body)));
            return Ok(Response::from_parts(parts, body));
        }
        let text = body.collect().await.map_err(|error| Status::unavailable(error.to_string()))?.to_bytes();
        if parts.status != http::StatusCode::OK {
            let error = serde_json::from_slice(&text).map_err(|error| {
                Status::unavailable(format!("{} {error}: {}", parts.status, String::from_utf8_lossy(&text)))
            })?;
            return Err(status_of(&error));
        }
        let message = framed(0, &from_json(&method.answer, &text)?);
        let frames =
            [Ok::<_, Status>(http_body::Frame::data(message)), Ok(http_body::Frame::trailers(succeeded()))];
        Ok(Response::from_parts(parts, Body::new(StreamBody::new(futures_util::stream::iter(frames)))))
    }
}

/// Returns the frames of gRPC of a stream of JSON.
fn frames(
    method: &'static Method,
    body: Text,
) -> impl futures_util::Stream<Item = Result<http_body::Frame<Bytes>, Status>> {
    let mut bytes = BytesMut::new();
    let mut is_over = false;
    let parts = body.into_data_stream().map(Some).chain(futures_util::stream::iter([None]));
    let frames = parts.map(move |part| {
        match part {
            Some(Ok(part)) => bytes.put(part),
            Some(Err(error)) => return vec![Err(Status::unavailable(error.to_string()))],
            None if is_over => return Vec::new(),
            None => return vec![Err(Status::unavailable("the stream ended without its last message"))],
        }
        let mut found = Vec::new();
        while bytes.len() >= 5 {
            let length = bytes.get(1..5).map_or(0, |mut length| length.get_u32()) as usize;
            if bytes.len() < 5 + length {
                break;
            }
            let flags = bytes.get_u8();
            bytes.advance(4);
            let text = bytes.split_to(length);
            if flags & 2 == 0 {
                found.push(
                    from_json(&method.answer, &text)
                        .map(|message| http_body::Frame::data(framed(0, &message))),
                );
                continue;
            }
            is_over = true;
            let end: Value = serde_json::from_slice(&text).unwrap_or_default();
            let mut trailers = succeeded();
            if let Some(error) = end.get("error") {
                trailers.clear();
                let _ = status_of(error).add_header(&mut trailers);
            }
            found.push(Ok(http_body::Frame::trailers(trailers)));
        }
        found
    });
    frames.flat_map(futures_util::stream::iter)
}

fn succeeded() -> HeaderMap {
    HeaderMap::from_iter([(http::HeaderName::from_static("grpc-status"), HeaderValue::from_static("0"))])
}

/// Returns the status of an error of Connect.
fn status_of(error: &Value) -> Status {
    let text = |of: &Value, name: &str| of.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let code =
        CODES.iter().find(|(name, _)| *name == text(error, "code")).map_or(Code::Unknown, |(_, code)| *code);
    let message = text(error, "message");
    let details = error.get("details").and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let details = details
        .iter()
        .map(|detail| prost_types::Any {
            type_url: format!("type.googleapis.com/{}", text(detail, "type")),
            value: decoded(&text(detail, "value")),
        })
        .collect();
    let status = pb::Status { code: code as i32, message: message.clone(), details };
    Status::with_details(code, message, status.encode_to_vec().into())
}

fn decoded(text: &str) -> Vec<u8> {
    use base64::Engine as _;
    base64::engine::general_purpose::STANDARD_NO_PAD.decode(text).unwrap_or_default()
}

const CODES: [(&str, Code); 16] = [
    ("canceled", Code::Cancelled),
    ("unknown", Code::Unknown),
    ("invalid_argument", Code::InvalidArgument),
    ("deadline_exceeded", Code::DeadlineExceeded),
    ("not_found", Code::NotFound),
    ("already_exists", Code::AlreadyExists),
    ("permission_denied", Code::PermissionDenied),
    ("resource_exhausted", Code::ResourceExhausted),
    ("failed_precondition", Code::FailedPrecondition),
    ("aborted", Code::Aborted),
    ("out_of_range", Code::OutOfRange),
    ("unimplemented", Code::Unimplemented),
    ("internal", Code::Internal),
    ("unavailable", Code::Unavailable),
    ("data_loss", Code::DataLoss),
    ("unauthenticated", Code::Unauthenticated),
];

/// Reads a deadline of gRPC.
fn milliseconds(text: &str) -> Option<u64> {
    let (number, unit) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let number: u64 = number.parse().ok()?;
    let microseconds = match unit {
        "S" => number.checked_mul(1_000_000)?,
        "m" => number.checked_mul(1000)?,
        "u" => number,
        "n" => number / 1000,
        _ => return None,
    };
    Some(microseconds.div_ceil(1000))
}

fn framed(flags: u8, message: &[u8]) -> Bytes {
    let mut framed = BytesMut::with_capacity(5 + message.len());
    framed.put_u8(flags);
    framed.put_u32(message.len() as u32);
    framed.put_slice(message);
    framed.freeze()
}

/// Returns an encoded message of this name as JSON.
///
/// # Errors
///
/// Returns an error if the schema has no such message, or the bytes are none.
pub fn to_json(name: &str, bytes: Bytes) -> Result<Vec<u8>, Status> {
    let broken = |error: &dyn std::fmt::Display| Status::internal(format!("{name}: {error}"));
    let of = SCHEMA.get_message_by_name(&format!("simd.v1.{name}")).ok_or_else(|| broken(&"unknown"))?;
    let message = DynamicMessage::decode(of, bytes).map_err(|error| broken(&error))?;
    let mut text = Vec::new();
    let mut writer = serde_json::Serializer::new(&mut text);
    message.serialize_with_options(&mut writer, &SerializeOptions::new()).map_err(|error| broken(&error))?;
    Ok(text)
}

fn from_json(name: &str, text: &[u8]) -> Result<Vec<u8>, Status> {
    let broken = |error: &dyn std::fmt::Display| Status::internal(format!("{name}: {error}"));
    let of = SCHEMA.get_message_by_name(&format!("simd.v1.{name}")).ok_or_else(|| broken(&"unknown"))?;
    let mut reader = serde_json::Deserializer::from_slice(text);
    DynamicMessage::deserialize(of, &mut reader)
        .map(|read| read.encode_to_vec())
        .map_err(|error| broken(&error))
}

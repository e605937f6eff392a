//! Adds a reason to refusals that tonic itself makes before a service sees the call, so that clients find one
//! on every refusal. Examples are a message that is too long, bytes that are not a message, and an unknown
//! method.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use prost::Message as _;
use simd_proto::v1::ErrorReason;
use tonic::body::Body;
use tonic::codegen::Service;
use tonic::codegen::http::{Request, Response};
use tonic::server::NamedService;
use tonic::{Code, Status};
use tonic_types::pb;

use super::status::Explained;

/// A service whose refusals all have a reason.
#[derive(Clone, Debug)]
pub struct ExplainRefusals<S>(pub S);

impl<S: NamedService> NamedService for ExplainRefusals<S> {
    const NAME: &'static str = S::NAME;
}

impl<S> Service<Request<Body>> for ExplainRefusals<S>
where
    S: Service<Request<Body>, Response = Response<Body>, Error = Infallible>,
    S::Future: Unpin,
{
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Answer<S::Future>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.0.poll_ready(context)
    }

    fn call(&mut self, request: Request<Body>) -> Self::Future {
        Answer(self.0.call(request))
    }
}

/// Answer of an [`ExplainRefusals`] service.
#[derive(Debug)]
pub struct Answer<F>(F);

impl<F> Future for Answer<F>
where
    F: Future<Output = Result<Response<Body>, Infallible>> + Unpin,
{
    type Output = F::Output;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.0).poll(context).map_ok(|response| {
            // Only a refusal has its status in the headers; other answers have it after the answer.
            match Status::from_header_map(response.headers()) {
                Some(status) if status.details().is_empty() => with_reason(status).into_http(),
                Some(_) | None => response,
            }
        })
    }
}

/// Adds the details that clients expect of every refusal to a status of tonic.
pub fn with_reason(status: Status) -> Status {
    if !status.details().is_empty() {
        return status;
    }
    // Tonic gives no message for an unknown method.
    let because = |sentence: &str| match status.message() {
        "" => sentence.to_owned(),
        message => format!("{sentence}: {message}"),
    };
    match status.code() {
        // Tonic uses these words also if the caller disconnected: nothing was refused.
        Code::Internal if status.message() == "Missing request message." => {
            Status::cancelled("the request ended before its message")
        }
        Code::OutOfRange => {
            let message = because("the message is longer than RequestLimits.max_message_bytes");
            Explained::new(ErrorReason::LimitExceeded, message).into()
        }
        Code::ResourceExhausted => {
            let message = because("the message has too many elements");
            Explained::new(ErrorReason::LimitExceeded, message).into()
        }
        Code::Internal | Code::InvalidArgument | Code::Unknown => {
            let message = because("the request is not a message of this schema");
            Explained::new(ErrorReason::InvalidValue, message).into()
        }
        Code::Unimplemented => {
            let message = because("this daemon has no such method, or reads no such encoding");
            Explained::new(ErrorReason::NotSupported, message).into()
        }
        // The connection or the caller ended, so this is not read.
        Code::Ok
        | Code::Cancelled
        | Code::DeadlineExceeded
        | Code::NotFound
        | Code::AlreadyExists
        | Code::PermissionDenied
        | Code::FailedPrecondition
        | Code::Aborted
        | Code::Unavailable
        | Code::DataLoss
        | Code::Unauthenticated => status,
    }
}

/// Returns a status with its details, as `google.rpc.Status`: the content of gRPC's trailers.
pub fn in_full(status: &Status) -> Vec<u8> {
    match pb::Status::decode(status.details()) {
        Ok(whole) if !whole.details.is_empty() => status.details().to_vec(),
        Ok(_) | Err(_) => {
            let (code, message) = (status.code().into(), status.message().to_owned());
            pb::Status { code, message, details: Vec::new() }.encode_to_vec()
        }
    }
}

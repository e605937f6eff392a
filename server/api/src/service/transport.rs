//! Adds a reason to refusals that tonic itself makes before a service sees the call, so that clients find one
//! on every refusal. Examples are a message that is too long, bytes that are not a message, and an unknown
//! method.

use prost::Message as _;
use simd_proto::v1::ErrorReason;
use tonic::body::Body;
use tonic::codegen::http::Response;
use tonic::{Code, Status};
use tonic_types::pb;

use super::status::Explained;

/// Returns the same answer; a refusal without details gets them.
pub(super) fn explained(answer: Response<Body>) -> Response<Body> {
    // Only a refusal has its status in the headers; other answers have it after the answer.
    match Status::from_header_map(answer.headers()) {
        Some(status) if status.details().is_empty() => with_reason(status).into_http(),
        Some(_) | None => answer,
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

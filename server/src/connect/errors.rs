//! Errors as the Connect protocol writes them: a code, a sentence, and details.

use axum::body::Body;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD;
use prost::Message as _;
use serde_json::{Value, json};
use tonic::{Code, Status};
use tonic_types::pb;

/// Returns the error of a refused call as JSON.
pub(super) fn json(refused: &Status) -> Value {
    let details = pb::Status::decode(refused.details()).unwrap_or_default().details;
    let detail = |detail: &prost_types::Any| {
        let name = detail.type_url.rsplit('/').next().unwrap_or_default();
        json!({ "type": name, "value": STANDARD_NO_PAD.encode(&detail.value) })
    };
    let mut error = json!({ "code": code(refused.code()).0, "message": refused.message() });
    if let Some(fields) = error.as_object_mut().filter(|_| !details.is_empty()) {
        fields.insert("details".to_owned(), details.iter().map(detail).collect());
    }
    error
}

/// Returns the answer of a refused unary call.
pub(super) fn response(refused: &Status) -> Response {
    let mut response = Response::new(Body::from(json(refused).to_string()));
    *response.status_mut() = code(refused.code()).1;
    let headers = response.headers_mut();
    headers.extend(refused.metadata().clone().into_headers());
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(super::UNARY));
    response
}

/// Returns the answer to a request with a media type that no service reads.
pub(super) fn wrong_media() -> Response {
    let sentence = "send JSON with -H 'Content-Type: application/json', or gRPC\n";
    (StatusCode::UNSUPPORTED_MEDIA_TYPE, [("accept-post", super::UNARY)], sentence).into_response()
}

/// Returns the name and the HTTP status of a code: <https://connectrpc.com/docs/protocol#error-codes>.
fn code(code: Code) -> (&'static str, StatusCode) {
    match code {
        Code::Ok | Code::Unknown => ("unknown", StatusCode::INTERNAL_SERVER_ERROR),
        Code::Cancelled => ("canceled", StatusCode::from_u16(499).unwrap_or(StatusCode::BAD_REQUEST)),
        Code::InvalidArgument => ("invalid_argument", StatusCode::BAD_REQUEST),
        Code::DeadlineExceeded => ("deadline_exceeded", StatusCode::GATEWAY_TIMEOUT),
        Code::NotFound => ("not_found", StatusCode::NOT_FOUND),
        Code::AlreadyExists => ("already_exists", StatusCode::CONFLICT),
        Code::PermissionDenied => ("permission_denied", StatusCode::FORBIDDEN),
        Code::ResourceExhausted => ("resource_exhausted", StatusCode::TOO_MANY_REQUESTS),
        Code::FailedPrecondition => ("failed_precondition", StatusCode::BAD_REQUEST),
        Code::Aborted => ("aborted", StatusCode::CONFLICT),
        Code::OutOfRange => ("out_of_range", StatusCode::BAD_REQUEST),
        Code::Unimplemented => ("unimplemented", StatusCode::NOT_IMPLEMENTED),
        Code::Internal => ("internal", StatusCode::INTERNAL_SERVER_ERROR),
        Code::Unavailable => ("unavailable", StatusCode::SERVICE_UNAVAILABLE),
        Code::DataLoss => ("data_loss", StatusCode::INTERNAL_SERVER_ERROR),
        Code::Unauthenticated => ("unauthenticated", StatusCode::UNAUTHORIZED),
    }
}

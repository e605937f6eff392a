//! Counts each call of every transport: method, outcome, duration. Each call has an id, which appears in all
//! its log lines and in its answer.

use std::sync::atomic::{AtomicU64, Ordering};

use axum::extract::Request;
use axum::http::{HeaderName, HeaderValue};
use simd_proto::methods;
use simd_proto::v1::ErrorReason;
use tokio::time::Instant;
use tonic::body::Body;
use tonic::codegen::http::Response;
use tonic::{Code, Status};
use tonic_types::StatusExt as _;
use tracing::Instrument as _;

use super::held::Held;
use super::watched::watched;
use simd_world::SimHandle;
use simd_world::handle::Transport;

/// Numbers the calls of this process.
static CALLS: AtomicU64 = AtomicU64::new(0);
/// Header with the client's id of its request, which the answer repeats.
const ID_HEADER: HeaderName = HeaderName::from_static("x-request-id");
/// Maximum length of a client's id, characters.
const MAX_ID: usize = 64;

/// Counts one call. A method that the schema does not have is not counted.
pub(super) async fn count<F>(
    handle: &SimHandle,
    transport: Transport,
    request: Request,
    next: impl FnOnce(Request) -> F,
) -> Response<Body>
where
    F: Future<Output = Response<Body>>,
{
    let (service, method) = methods::parse_path(request.uri().path()).unwrap_or_default();
    let Some(method) = methods::find(service, method) else { return next(request).await };
    let begun = Instant::now();
    let id = id(&request);
    let span =
        tracing::info_span!("call", id = id.to_str().unwrap_or_default(), method = request.uri().path());
    let mut response = next(request).instrument(span).await;
    response.headers_mut().insert(ID_HEADER, id);
    // Only a refusal has its status in the headers.
    let refusal = Status::from_header_map(response.headers()).filter(|status| status.code() != Code::Ok);
    let how = refusal.as_ref().map_or((0, ""), |status| (status.code().into(), reason(status)));
    handle.call_ended(method, transport, how, begun.elapsed());
    if !method.gives_many || refusal.is_some() {
        return response;
    }
    let (stream, handle) = (handle.stream_begins(method, transport), handle.clone());
    let mut is_counted = false;
    let response = watched(response, move |status| {
        if status.code() != Code::Ok && !std::mem::replace(&mut is_counted, true) {
            handle.refused_beside_calls(method, transport, (status.code().into(), reason(status)));
        }
    });
    response.map(|body| Body::new(Held::new(body, stream)))
}

/// Returns the id of a request: the client's if it is printable, otherwise a number of this process.
fn id(request: &Request) -> HeaderValue {
    let is_plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"-_.:".contains(byte);
    let said = request
        .headers()
        .get(ID_HEADER)
        .filter(|said| (1..=MAX_ID).contains(&said.len()) && said.as_bytes().iter().all(is_plain));
    said.cloned().unwrap_or_else(|| HeaderValue::from(CALLS.fetch_add(1, Ordering::Relaxed) + 1))
}

/// Returns the reason of a status, if the schema has it, otherwise an empty string.
pub fn reason(status: &Status) -> &'static str {
    let Some(info) = status.get_details_error_info() else { return "" };
    let named = ErrorReason::from_str_name(&format!("ERROR_REASON_{}", info.reason));
    named.map_or("", |reason| reason.as_str_name().trim_start_matches("ERROR_REASON_"))
}

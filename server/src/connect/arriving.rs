//! The bytes of a request, before anything of it is known. Large requests of all clients share a budget.

use std::pin::Pin;

use axum::body::{Body, Bytes};
use bytes::{BufMut as _, BytesMut};
use futures_util::future::poll_fn;
use http_body::Body as _;
use tokio::sync::{Semaphore, SemaphorePermit};
use tonic::Status;

use super::MAX_REQUEST;

/// Bytes of large requests that may be held at the same time.
const MAX_HELD: usize = 32 << 20;
/// Bytes up to which a request needs no share, so that large ones do not delay commands.
const SMALL: usize = 64 << 10;

static FREE: Semaphore = Semaphore::const_new(MAX_HELD);

/// Reads a body to its end, with its share of the budget. The connection bounds the time.
///
/// # Errors
///
/// Returns an error if it is too large, breaks off, or finds too little of the budget.
pub(super) async fn whole(mut body: Body) -> Result<(Bytes, Option<SemaphorePermit<'static>>), Status> {
    let mut bytes = BytesMut::new();
    let mut share: Option<SemaphorePermit<'static>> = None;
    while let Some(frame) = poll_fn(|context| Pin::new(&mut body).poll_frame(context)).await {
        let frame = frame.map_err(|error| {
            Status::resource_exhausted(format!("the request did not arrive whole: {error}"))
        })?;
        let Ok(data) = frame.into_data() else { continue };
        let size = bytes.len() + data.len();
        if size > MAX_REQUEST {
            let sentence = format!("the request has more than {MAX_REQUEST} bytes: use gRPC");
            return Err(Status::resource_exhausted(sentence));
        }
        if size > SMALL {
            let lacking = size - share.as_ref().map_or(0, SemaphorePermit::num_permits);
            let more =
                FREE.try_acquire_many(u32::try_from(lacking).unwrap_or(u32::MAX)).map_err(|_none| {
                    let sentence =
                        format!("large requests in JSON have {MAX_HELD} bytes together: try again later");
                    Status::resource_exhausted(sentence)
                })?;
            match &mut share {
                Some(share) => share.merge(more),
                None => share = Some(more),
            }
        }
        bytes.put(data);
    }
    Ok((bytes.freeze(), share))
}

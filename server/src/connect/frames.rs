//! Messages with a prefix of five bytes, as gRPC and the streams of Connect have them: flags, and the length.

use axum::body::{Body, Bytes};
use axum::http::HeaderMap;
use bytes::{Buf as _, BufMut as _, BytesMut};
use futures_util::future::poll_fn;
use http_body::Body as _;
use std::pin::Pin;
use tonic::Status;

use super::MAX_ANSWER;
use super::errors;

const PREFIX: usize = 5;
/// Flags of a compressed message, and of the last message of a stream of Connect.
const COMPRESSED: u8 = 1;
const END: u8 = 2;

/// Returns a message with its prefix.
pub(super) fn framed(flags: u8, message: &[u8]) -> Bytes {
    let mut framed = BytesMut::with_capacity(PREFIX + message.len());
    framed.put_u8(flags);
    framed.put_u32(u32::try_from(message.len()).unwrap_or(u32::MAX));
    framed.put_slice(message);
    framed.freeze()
}

/// Returns the last message of a stream of Connect.
pub(super) fn end(refusal: Option<&Status>) -> Bytes {
    let text = match refusal {
        Some(refusal) => serde_json::json!({ "error": errors::json(refusal) }),
        None => serde_json::json!({}),
    };
    framed(END, text.to_string().as_bytes())
}

/// Returns the one message of a request in the form of streams.
pub(super) fn only(body: &Bytes) -> Result<Bytes, Status> {
    let wrong = |sentence: &str| Err(Status::invalid_argument(sentence.to_owned()));
    let Some((prefix, _)) = body.split_first_chunk::<PREFIX>() else {
        return wrong("a request of a stream begins with five bytes: flags 0, and the length of its message");
    };
    let [flags, length @ ..] = *prefix;
    if flags & COMPRESSED != 0 {
        return Err(Status::unimplemented("compressed requests are not read"));
    }
    let message = body.slice(PREFIX..);
    match message.len() as u64 == u64::from(u32::from_be_bytes(length)) {
        true => Ok(message),
        false => wrong("the length before the message is not the length of the message"),
    }
}

/// Messages of an answer of gRPC.
#[derive(Debug)]
pub(super) struct Frames {
    body: Body,
    bytes: BytesMut,
    trailers: HeaderMap,
    is_over: bool,
}

impl Frames {
    /// Reads a body. An answer without messages may have its status in the headers.
    pub(super) fn new(body: Body, headers: &HeaderMap) -> Self {
        let trailers = if headers.contains_key("grpc-status") { headers.clone() } else { HeaderMap::new() };
        Self { body, bytes: BytesMut::new(), trailers, is_over: false }
    }

    /// Returns the next message, or `None` after the last one if the call succeeded.
    ///
    /// # Errors
    ///
    /// Returns the service's error, or an error of the body.
    pub(super) async fn next(&mut self) -> Result<Option<Bytes>, Status> {
        loop {
            if let Some(message) = self.buffered()? {
                return Ok(Some(message));
            }
            if self.is_over {
                return match Status::from_header_map(&self.trailers) {
                    Some(status) if status.code() != tonic::Code::Ok => Err(status),
                    Some(_) => Ok(None),
                    None => Err(Status::internal("the answer ended without a status")),
                };
            }
            match poll_fn(|context| Pin::new(&mut self.body).poll_frame(context)).await {
                None => self.is_over = true,
                Some(Err(error)) => {
                    return Err(Status::internal(format!("the answer broke off: {error}")));
                }
                Some(Ok(frame)) => match frame.into_data() {
                    Ok(data) => self.bytes.put(data),
                    Err(frame) => self.trailers.extend(frame.into_trailers().unwrap_or_default()),
                },
            }
        }
    }

    /// Takes a whole message from the bytes that have arrived.
    fn buffered(&mut self) -> Result<Option<Bytes>, Status> {
        let Some((prefix, rest)) = self.bytes.split_first_chunk::<PREFIX>() else { return Ok(None) };
        let [flags, length @ ..] = *prefix;
        let length = u32::from_be_bytes(length) as usize;
        if flags & COMPRESSED != 0 {
            return Err(Status::internal("the service compressed its answer"));
        }
        if length > MAX_ANSWER {
            let sentence =
                format!("the answer has {length} bytes; as JSON it has at most {MAX_ANSWER}: use gRPC");
            return Err(Status::resource_exhausted(sentence));
        }
        if rest.len() < length {
            return Ok(None);
        }
        self.bytes.advance(PREFIX);
        Ok(Some(self.bytes.split_to(length).freeze()))
    }

    /// Returns what followed the last message.
    pub(super) fn trailers(self) -> HeaderMap {
        self.trailers
    }
}

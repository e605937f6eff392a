//! Bodies of answers whose bytes count until their client has read them.
//!
//! An answer is encoded at once, apart from other calls if it is large, so that its size is known before a
//! transport has it. A stream is counted message by message, as its client makes room for them.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::poll_fn;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use http_body::{Body as _, Frame, SizeHint};
use prost::encoding::{WireType, encode_key, encode_varint, encoded_len_varint};
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::Bytes;
use tonic::codegen::http::{HeaderMap, Response};

use super::held::Held;
use super::status::Explained;
use simd_world::handle::CallError;
use simd_world::unread_answers::{CALL, Unread, counted};

/// Count of an answer's bytes, in the extensions of its response, for a transport that copies its frames.
#[derive(Clone, Debug)]
pub struct Holding(Arc<Unread>);

impl Holding {
    /// Counts a message of a stream until it is delivered.
    ///
    /// # Errors
    /// Returns an error if the client has more unread bytes than permitted.
    pub fn another(&self, bytes: usize) -> Result<Unread, CallError> {
        self.0.another(bytes as u64)
    }
}

/// Field of an answer that is sent from the daemon's own memory without a copy, in the extensions of its
/// response. The field of the message is empty.
#[derive(Clone, Debug)]
pub(super) struct Attachment {
    /// Number of the field, whose type is `bytes`.
    pub(super) field: u32,
    pub(super) bytes: Bytes,
}

/// Encoded answer of a unary method, not counted yet.
pub(super) struct Whole {
    response: Response<()>,
    frames: VecDeque<Bytes>,
    trailers: Option<HeaderMap>,
    /// Bytes that were allocated for it.
    encoded: u64,
}

impl Whole {
    /// Encodes an answer.
    pub(super) async fn of(response: Response<Body>) -> Result<Self, Status> {
        let (mut parts, body) = response.into_parts();
        let attachment = parts.extensions.remove::<Attachment>();
        let (mut frames, mut trailers) = (VecDeque::new(), None);
        let mut body = pin!(body);
        while let Some(frame) = poll_fn(|context| body.as_mut().poll_frame(context)).await {
            match frame?.into_data() {
                Ok(data) => frames.push_back(data),
                Err(frame) => trailers = frame.into_trailers().ok(),
            }
        }
        let encoded = total(&frames);
        if let Some(attachment) = attachment {
            attach(&mut frames, attachment);
        }
        Ok(Self { response: Response::from_parts(parts, ()), frames, trailers, encoded })
    }

    /// Returns the size of the answer, bytes.
    pub(super) fn bytes(&self) -> u64 {
        total(&self.frames)
    }

    /// Returns the bytes that were allocated for it, without shared ones.
    pub(super) fn encoded_bytes(&self) -> u64 {
        self.encoded
    }

    /// Returns the answer. Its bytes count in `unread` until the last of them is sent.
    pub(super) fn into_response(self, unread: Unread) -> Response<Body> {
        let Self { mut response, frames, trailers, encoded: _ } = self;
        let unread = Arc::new(unread);
        response.extensions_mut().insert(Holding(Arc::clone(&unread)));
        let frames = frames.into_iter().map(|frame| counted(frame, Arc::clone(&unread))).collect();
        response.map(|()| Body::new(Frames { frames, trailers, _unread: unread }))
    }
}

fn total(frames: &VecDeque<Bytes>) -> u64 {
    frames.iter().map(|frame| frame.len() as u64).sum()
}

/// Appends a field to the message in the frames.
fn attach(frames: &mut VecDeque<Bytes>, Attachment { field, bytes }: Attachment) {
    if bytes.is_empty() {
        return;
    }
    let Some(first) = frames.pop_front() else { return };
    // The message begins with a flag, and its length in four bytes.
    let Some((&[flag, ..], message)) = first.split_first_chunk::<5>() else { return };
    let mut head = Vec::with_capacity(first.len() + 16);
    let mut key = Vec::new();
    encode_key(field, WireType::LengthDelimited, &mut key);
    let length = message.len() + key.len() + encoded_len_varint(bytes.len() as u64) + bytes.len();
    head.push(flag);
    head.extend(u32::try_from(length).unwrap_or(u32::MAX).to_be_bytes());
    head.extend(message);
    head.extend(key);
    encode_varint(bytes.len() as u64, &mut head);
    frames.push_front(bytes);
    frames.push_front(head.into());
}

/// Body of an encoded answer.
struct Frames {
    frames: VecDeque<Bytes>,
    trailers: Option<HeaderMap>,
    /// The call itself counts until its end is sent.
    _unread: Arc<Unread>,
}

impl http_body::Body for Frames {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        if let Some(frame) = self.frames.pop_front() {
            return Poll::Ready(Some(Ok(Frame::data(frame))));
        }
        Poll::Ready(self.trailers.take().map(|trailers| Ok(Frame::trailers(trailers))))
    }

    fn is_end_stream(&self) -> bool {
        self.frames.is_empty() && self.trailers.is_none()
    }
}

/// Body whose frames count one by one. It ends with a refusal if its client has more unread bytes than
/// permitted.
pub struct Flowing<B> {
    body: B,
    unread: Arc<Unread>,
    /// Whether the bytes of all frames are already in `unread`.
    is_counted: bool,
    is_over: bool,
}

impl<B> Flowing<B> {
    /// Makes a body whose frames are still to be counted; `unread` already counts the call.
    pub fn new(body: B, unread: Unread) -> Self {
        Self { body, unread: Arc::new(unread), is_counted: false, is_over: false }
    }

    /// Makes a body whose frames are already counted; `unread` has all bytes of the call.
    pub fn of_known_size(body: B, unread: Unread) -> Self {
        Self { is_counted: true, ..Self::new(body, unread) }
    }
}

impl Flowing<Body> {
    /// Returns an answer whose messages count, and which holds a value until it ends.
    pub(super) fn response<G: Send + Unpin + 'static>(
        mut answer: Response<Body>,
        unread: Unread,
        kept: G,
    ) -> Response<Body> {
        let unread = Arc::new(unread);
        answer.extensions_mut().insert(Holding(Arc::clone(&unread)));
        let flowing = |body| Body::new(Self { body, unread, is_counted: false, is_over: false });
        answer.map(|body| Body::new(Held::new(flowing(body), kept)))
    }
}

impl<B> http_body::Body for Flowing<B>
where
    B: http_body::Body<Data = Bytes> + Unpin,
{
    type Data = Bytes;
    type Error = B::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, B::Error>>> {
        if self.is_over {
            return Poll::Ready(None);
        }
        let Some(frame) = ready!(Pin::new(&mut self.body).poll_frame(context)?) else {
            return Poll::Ready(None);
        };
        let data = match frame.into_data() {
            Ok(data) => data,
            Err(other) => return Poll::Ready(Some(Ok(other))),
        };
        let unread = match self.is_counted {
            true => Ok(Arc::clone(&self.unread)),
            false => self.unread.another(data.len() as u64).map(Arc::new),
        };
        match unread {
            Ok(unread) => Poll::Ready(Some(Ok(Frame::data(counted(data, unread))))),
            Err(refused) => {
                self.is_over = true;
                let mut trailers = HeaderMap::new();
                let added = Status::from(Explained::from(&refused)).add_header(&mut trailers);
                Poll::Ready(added.ok().map(|()| Ok(Frame::trailers(trailers))))
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        self.is_over || self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// Returns the count of a call whose answer has this many bytes.
pub(super) fn weight(answer: u64) -> u64 {
    CALL + answer
}

#[cfg(test)]
mod tests {
    use prost::Message as _;
    use simd_proto::v1::GetAssetResponse;

    use super::*;

    #[test]
    fn an_attached_field_is_part_of_the_message_and_not_copied() {
        for length in [1_usize, 127, 128, 70_000] {
            let message = GetAssetResponse { data: Vec::new(), total_bytes: 7 };
            let mut first = vec![0, 0, 0, 0, u8::try_from(message.encoded_len()).unwrap()];
            message.encode(&mut first).unwrap();
            let bytes = Bytes::from(vec![3; length]);
            let mut frames = VecDeque::from([Bytes::from(first)]);
            attach(&mut frames, Attachment { field: 1, bytes: bytes.clone() });
            assert_eq!(frames[1].as_ptr(), bytes.as_ptr());
            let whole = frames.iter().flatten().copied().collect::<Vec<_>>();
            assert_eq!(whole[1..5], u32::try_from(whole.len() - 5).unwrap().to_be_bytes());
            let read = GetAssetResponse::decode(&whole[5..]).unwrap();
            assert_eq!((read.data, read.total_bytes), (bytes.to_vec(), 7));
        }
    }

    #[test]
    fn an_empty_field_leaves_the_message_as_it_is() {
        let mut frames = VecDeque::from([Bytes::from_static(&[0, 0, 0, 0, 0])]);
        attach(&mut frames, Attachment { field: 1, bytes: Bytes::new() });
        assert_eq!(frames, [Bytes::from_static(&[0, 0, 0, 0, 0])]);
    }
}

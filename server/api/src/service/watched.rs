//! Body of an answer that reports how its stream ended.

use std::pin::Pin;
use std::task::{Context, Poll};

use http_body::{Frame, SizeHint};
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::Bytes;
use tonic::codegen::http::Response;

/// A body, and the function that gets each status at the end of its stream.
struct Watched<F> {
    body: Body,
    ended: F,
}

/// Returns the same answer. `ended` is called with the status in its trailers, with an error that interrupts
/// it, or with OK if it ends without either. It is called more than once if the reader continues after the
/// end.
pub(super) fn watched<F>(answer: Response<Body>, ended: F) -> Response<Body>
where
    F: FnMut(&Status) + Send + Unpin + 'static,
{
    answer.map(|body| Body::new(Watched { body, ended }))
}

impl<F: FnMut(&Status) + Unpin> http_body::Body for Watched<F> {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let frame = Pin::new(&mut self.body).poll_frame(context);
        if let Poll::Ready(frame) = &frame {
            match frame {
                Some(Ok(frame)) => {
                    if let Some(status) = frame.trailers_ref().and_then(Status::from_header_map) {
                        (self.ended)(&status);
                    }
                }
                Some(Err(status)) => (self.ended)(status),
                None => (self.ended)(&Status::ok("")),
            }
        }
        frame
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

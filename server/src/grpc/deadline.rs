//! The deadline that a client gives its call. tonic answers it as a call that the client cancelled, so the
//! daemon answers first, with the right status.

use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::Response;
use http_body::Frame;
use tokio::time::{Instant, Sleep};
use tonic::metadata::MetadataMap;
use tonic::{Request, Status};

/// Time by which an answer precedes tonic's own, which has the wrong status.
const AHEAD: Duration = Duration::from_millis(5);

/// End of the time that a client gives its call.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deadline {
    at: Instant,
    /// Whether the client speaks gRPC-Web.
    is_web: bool,
}

/// Notes the deadline of a call as it arrives. tonic's timer begins after that, however late the call is
/// served.
pub(super) fn note(mut request: Request<()>) -> Result<Request<()>, Status> {
    if let Some(deadline) = Deadline::of(request.metadata(), Instant::now()) {
        request.extensions_mut().insert(deadline);
    }
    Ok(request)
}

impl Deadline {
    fn of(headers: &MetadataMap, arrival: Instant) -> Option<Self> {
        let media = headers.get(header::CONTENT_TYPE.as_str())?.as_bytes();
        if !media.starts_with(b"application/grpc") {
            return None;
        }
        let time = parse(headers.get("grpc-timeout")?.to_str().ok()?)?;
        let is_web = media.starts_with(b"application/grpc-web");
        Some(Self { at: arrival + time.saturating_sub(AHEAD), is_web })
    }

    /// Returns the response, or the refusal if there is none in time.
    pub(super) async fn hold(self, response: impl Future<Output = Response>) -> Response {
        match tokio::time::timeout_at(self.at, response).await {
            Ok(response) => response,
            Err(_elapsed) => {
                let mut refusal = exceeded().into_http();
                if self.is_web {
                    let media = HeaderValue::from_static("application/grpc-web+proto");
                    refusal.headers_mut().insert(header::CONTENT_TYPE, media);
                }
                refusal
            }
        }
    }

    /// Returns the end of a stream. In gRPC-Web the end of a stream is part of its messages, and browsers end
    /// their calls themselves.
    pub(super) fn of_stream(self) -> Option<StreamEnd> {
        (!self.is_web).then(|| StreamEnd(Some(Box::pin(tokio::time::sleep_until(self.at)))))
    }
}

/// The end of a stream at its deadline.
pub(super) struct StreamEnd(Option<Pin<Box<Sleep>>>);

impl StreamEnd {
    /// Returns the last frame once the time is over.
    pub(super) fn poll<D>(&mut self, context: &mut Context<'_>) -> Poll<Frame<D>> {
        let Some(sleep) = &mut self.0 else { return Poll::Pending };
        ready!(sleep.as_mut().poll(context));
        self.0 = None;
        let mut trailers = HeaderMap::new();
        if exceeded().add_header(&mut trailers).is_err() {
            trailers.insert("grpc-status", HeaderValue::from_static("4"));
        }
        Poll::Ready(Frame::trailers(trailers))
    }

    /// Whether the last frame was returned.
    pub(super) fn is_over(&self) -> bool {
        self.0.is_none()
    }
}

/// Reads at most eight digits and a unit, as the protocol has it.
fn parse(text: &str) -> Option<Duration> {
    let (digits, unit) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let is_number = (1..=8).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_digit());
    let count: u64 = digits.parse().ok().filter(|_| is_number)?;
    Some(match unit {
        "H" => Duration::from_secs(count * 3600),
        "M" => Duration::from_secs(count * 60),
        "S" => Duration::from_secs(count),
        "m" => Duration::from_millis(count),
        "u" => Duration::from_micros(count),
        "n" => Duration::from_nanos(count),
        _ => return None,
    })
}

fn exceeded() -> Status {
    Status::deadline_exceeded("the call took longer than its client allows")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deadline_is_eight_digits_and_a_unit() {
        for (text, time) in [
            ("1H", Duration::from_secs(3600)),
            ("2M", Duration::from_secs(120)),
            ("00000030S", Duration::from_secs(30)),
            ("250m", Duration::from_millis(250)),
            ("7u", Duration::from_micros(7)),
            ("99999999n", Duration::from_nanos(99_999_999)),
        ] {
            assert_eq!(parse(text), Some(time), "{text}");
        }
        for text in ["", "S", "1", "1s", "-1S", "+1S", "1.5S", "123456789S", "1µ", "1SS"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    /// A busy machine may serve a call long after it arrived.
    #[tokio::test(start_paused = true)]
    async fn the_time_of_a_call_begins_when_it_arrives() {
        let mut request = Request::new(());
        request.metadata_mut().insert("content-type", "application/grpc".parse().unwrap());
        request.metadata_mut().insert("grpc-timeout", "1S".parse().unwrap());
        let noted = note(request).unwrap();
        let deadline = *noted.extensions().get::<Deadline>().unwrap();
        tokio::time::advance(Duration::from_secs(2)).await;
        let response = deadline.hold(std::future::pending()).await;
        assert_eq!(response.headers()["grpc-status"], "4");
    }
}

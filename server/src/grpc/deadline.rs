//! The deadline that a client gives its call. tonic answers it as a call that the client cancelled.

use std::time::Duration;

use axum::extract::Request;
use axum::http::header;
use axum::response::Response;
use tonic::Status;

/// Time by which an answer precedes tonic's own, which has the wrong status.
const AHEAD: Duration = Duration::from_millis(5);

/// How long a call of gRPC may take by its header. Browsers end their calls themselves.
pub(super) fn of(request: &Request) -> Option<Duration> {
    let media = request.headers().get(header::CONTENT_TYPE)?.as_bytes();
    if !media.starts_with(b"application/grpc") || media.starts_with(b"application/grpc-web") {
        return None;
    }
    let time = parse(request.headers().get("grpc-timeout")?.to_str().ok()?)?;
    Some(time.saturating_sub(AHEAD))
}

/// At most eight digits and a unit, as the protocol has it.
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

/// The answer to a call that took longer.
pub(super) fn exceeded() -> Response {
    Status::deadline_exceeded("the call took longer than its client allows").into_http()
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
}

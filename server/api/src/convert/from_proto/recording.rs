//! Requests of the recording service.

use std::time::Duration;

use simd_proto::v1;

use crate::convert::field::{BadField, Path};
use simd_world::handle::RecordingRequest;

/// Default rate of states, Hz.
const DEFAULT_RATE: f64 = 100.0;
/// Maximum length of a kept span or of a recording, seconds: a week.
const LONGEST: f64 = 604_800.0;

/// Parses the options of a new recording.
pub fn start(request: v1::StartRecordingRequest) -> Result<RecordingRequest, BadField> {
    let v1::StartRecordingRequest { name, state_rate, keep_last, max_bytes, max_duration, request_id: _ } =
        request;
    let name = if name.is_empty() { name } else { self::name("name", name)? };
    let rate = state_rate.unwrap_or(DEFAULT_RATE);
    let state_period = match rate {
        0.0 => None,
        rate => Some(1.0 / Path::ROOT.field("state_rate").within(rate, 0.001..=10_000.0)?),
    };
    let time = |field: &'static str, seconds: f64| match seconds {
        0.0 => Ok(None),
        seconds => Path::ROOT.field(field).seconds(seconds, 1.0..=LONGEST, 0.0).map(Some),
    };
    let (keep_last, max_duration): (Option<Duration>, Option<Duration>) =
        (time("keep_last", keep_last)?, time("max_duration", max_duration)?);
    Ok(RecordingRequest {
        name,
        state_period,
        keep_last,
        max_bytes: (max_bytes > 0).then_some(max_bytes),
        max_duration,
    })
}

/// Accepts the name of a recording, which also names its file.
pub fn name(field: &str, name: String) -> Result<String, BadField> {
    if simd_world::recording::is_name(&name) {
        return Ok(name);
    }
    let shown: String = name.chars().take(80).collect();
    let expected = "it must be 1 to 64 letters and digits of any script, `_` and `-`";
    Err(Path::ROOT.field(field).refuse(format_args!("{shown:?}"), expected))
}

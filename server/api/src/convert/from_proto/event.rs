//! Requests of the event service.

use std::time::Duration;

use simd_proto::v1;

use crate::convert::field::{BadField, Path};

/// Returns the longest wait for the first event; 0 answers at once.
pub fn timeout(request: &v1::NextEventsRequest) -> Result<Duration, BadField> {
    Path::ROOT.field("timeout").seconds(request.timeout, 0.0..=60.0, 0.0)
}

//! Refusals as the daemon's metrics count them, beside those that clients saw.

use std::collections::BTreeMap;

use super::Stage;
use crate::http;

/// By reason, over all methods and transports.
pub(super) async fn counted(stage: &Stage) -> BTreeMap<String, u64> {
    let text = http::get(stage.address, "/metrics", &[]).await.text();
    let mut counts = BTreeMap::new();
    for line in text.lines() {
        if let Some((reason, count)) = refusals(line).filter(|(reason, _)| !reason.is_empty()) {
            *counts.entry(reason.to_owned()).or_default() += count;
        }
    }
    counts
}

/// The reason of a sample of `simd_calls_total`, and how often.
fn refusals(line: &str) -> Option<(&str, u64)> {
    let (labels, value) = line.strip_prefix("simd_calls_total{")?.rsplit_once("} ")?;
    let reason = labels.split(",reason=\"").nth(1)?.strip_suffix('"')?;
    // A counter is written as an integer, or as a number with a point.
    Some((reason, value.parse::<f64>().ok()? as u64))
}

#[cfg(test)]
mod tests {
    use super::refusals;

    #[test]
    fn a_sample_has_its_reason() {
        let line = |reason: &str| {
            format!(
                "simd_calls_total{{method=\"A/B\",transport=\"grpc\",code=\"NotFound\",reason=\"{reason}\"}} 12"
            )
        };
        assert_eq!(refusals(&line("ROBOT_NOT_FOUND")), Some(("ROBOT_NOT_FOUND", 12)));
        assert_eq!(refusals(&line("")), Some(("", 12)));
        assert_eq!(refusals("simd_steps_total 3"), None);
    }
}

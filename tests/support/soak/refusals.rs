//! Refusals in the daemon's metrics, compared with those that clients saw.

use std::collections::BTreeMap;

use super::Stage;
use crate::http;

/// Refusals for one reason, by method and transport.
pub(super) type Refusals = BTreeMap<String, u64>;

/// Returns the counts by reason.
pub(super) async fn counted(stage: &Stage) -> BTreeMap<String, Refusals> {
    let text = http::get(stage.address, "/metrics", &[]).await.text();
    let mut counts: BTreeMap<String, Refusals> = BTreeMap::new();
    for line in text.lines() {
        if let Some((reason, call, count)) = refusals(line).filter(|(reason, ..)| !reason.is_empty()) {
            *counts.entry(reason.to_owned()).or_default().entry(call).or_default() += count;
        }
    }
    counts
}

/// Returns the reason, the method and transport, and the count of a sample of `simd_calls_total`.
fn refusals(line: &str) -> Option<(&str, String, u64)> {
    let (labels, value) = line.strip_prefix("simd_calls_total{")?.rsplit_once("} ")?;
    let label =
        |name: &str| labels.split_once(&format!("{name}=\"")).and_then(|(_, rest)| rest.split('"').next());
    let call = format!("{} over {}", label("method")?, label("transport")?);
    // A counter is written as an integer, or as a number with a point.
    Some((label("reason")?, call, value.parse::<f64>().ok()? as u64))
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
        let call = "A/B over grpc".to_owned();
        assert_eq!(refusals(&line("ROBOT_NOT_FOUND")), Some(("ROBOT_NOT_FOUND", call.clone(), 12)));
        assert_eq!(refusals(&line("")), Some(("", call, 12)));
        assert_eq!(refusals("simd_steps_total 3"), None);
    }
}

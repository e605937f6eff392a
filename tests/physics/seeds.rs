//! Seeds of property tests: how many a test has, and what came of them.

/// As many as a variable of the environment says, else as many as usual. They count from 0.
pub(crate) fn seeds(variable: &str, usual: u64) -> u64 {
    std::env::var(variable).ok().and_then(|count| count.parse().ok()).unwrap_or(usual)
}

/// What came of a property: says it on a line that `make truth` puts into its table, and fails with the seeds that did not hold it.
/// `largest` is what came nearest to its bound, as a part of that.
pub(crate) fn held(property: &str, count: u64, largest: f64, failed: &[u64]) {
    let line = serde_json::json!({
        "property": property, "seeds": count, "largest": largest, "failed": failed,
    });
    println!("random property {line}");
    assert!(failed.is_empty(), "{property}: of {count} seeds these did not hold it: {failed:?}");
}

//! Seeds of property tests: their number, and the results.

/// Returns the number in a variable of the environment, by default the usual one. Seeds count from 0.
pub(crate) fn seeds(variable: &str, usual: u64) -> u64 {
    std::env::var(variable).ok().and_then(|count| count.parse().ok()).unwrap_or(usual)
}

/// Reports the result of a property on a line that `make truth` puts into its table, and fails with the seeds
/// that broke it. `largest` is the result nearest to its bound, as a part of the bound.
pub(crate) fn held(property: &str, count: u64, largest: f64, failed: &[u64]) {
    let line = serde_json::json!({
        "property": property, "seeds": count, "largest": largest, "failed": failed,
    });
    println!("random property {line}");
    assert!(failed.is_empty(), "{property}: of {count} seeds these did not hold it: {failed:?}");
}

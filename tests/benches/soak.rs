//! `make soak`: a daemon in a world that comes and goes, for `SOAK_MINUTES`. Exits with 1 where something was
//! lost or panicked, or the daemon ended.
#![allow(clippy::expect_used, reason = "a bench ends where it cannot go on")]

use std::process::ExitCode;
use std::time::Duration;

use simd_tests::soak::{self, Options};

const MINUTES: f64 = 60.0;

fn main() -> ExitCode {
    let minutes = std::env::var("SOAK_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(MINUTES);
    let options =
        Options { duration: Duration::from_secs_f64(60.0 * minutes), every: Duration::from_secs(60) };
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let tally = runtime.block_on(soak::run(options));
    if tally.failures().is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

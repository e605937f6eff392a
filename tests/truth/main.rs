//! What `tests/truth/report.py` asks of simd: where the robots of a list of cases are at some instants.
//!
//! The argument is a file with a list of [`Ask`]s. The answer is a line of JSON for each.

use std::error::Error;
use std::io::Write as _;

use serde::Deserialize;
use simd_tests::truth::Case;

#[derive(Deserialize)]
struct Ask {
    case: Case,
    /// Seconds.
    time_step: f64,
    /// Seconds, multiples of the time step.
    instants: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(path) = std::env::args().nth(1).filter(|argument| argument != "--bench") else {
        return Ok(());
    };
    let asks: Vec<Ask> = serde_json::from_slice(&std::fs::read(path)?)?;
    let mut out = std::io::stdout().lock();
    for ask in asks {
        serde_json::to_writer(&mut out, &ask.case.run(ask.time_step, &ask.instants))?;
        writeln!(out)?;
    }
    Ok(())
}

//! `make soak`: the world alone, then with all kinds of clients, for `SOAK_MINUTES` in all.
//!
//! Exits with 1 if a state was lost, a call was refused without being counted, a task panicked, or the daemon
//! ended. In runs that are long enough, it also does so if memory grows or steps come later than in the world
//! alone.
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench prints, and ends where it cannot go on"
)]

use std::process::ExitCode;
use std::time::Duration;

use simd_tests::soak::{self, Options, Spread};

const MINUTES: f64 = 60.0;
/// Default of `SOAK_PRIORITY`, of a real-time thread; below the priorities of the kernel's own threads.
const PRIORITY: u32 = 40;
/// Share of the time in which the world is alone.
const QUIET: f64 = 0.2;
/// Minutes from which on percentiles are meaningful.
const LONG: f64 = 20.0;
/// Minutes from which on enough remains after the start-up to judge growth.
const STEADY: f64 = 36.0;
/// MiB an hour.
const SLOPE: f64 = 1.0;
/// Maximum ratio of the lateness with clients to the lateness in the world alone. It applies to all steps, or
/// to those at times when the machine wakes a sleeping thread in time.
const RATIO: f64 = 1.5;
/// Smallest share of such steps in each phase.
const SHARE: f64 = 0.2;

fn main() -> ExitCode {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
    let minutes = number("SOAK_MINUTES").unwrap_or(MINUTES);
    let quiet = (QUIET * minutes).min(10.0);
    let priority = number("SOAK_PRIORITY").map_or(PRIORITY, |priority| priority as u32);
    let options = Options {
        quiet: Duration::from_secs_f64(60.0 * quiet),
        duration: Duration::from_secs_f64(60.0 * (minutes - quiet)),
        every: Duration::from_secs(60),
        readers: 100,
        stopped: 10,
        priority,
        locks_memory: number("SOAK_LOCK").is_some_and(|locks| locks > 0.0),
        processor: if priority > 0 { simd_tests::process::leave_the_last_processor() } else { None },
    };
    println!("{} with {} readers, {} of them stopped", simd(), options.readers, options.stopped);
    println!("{}", soak::kernel());
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let report = runtime.block_on(soak::run(options));
    let row = |title: &str, of: &Spread| {
        let [median, late, latest] = [0.5, 0.99, 0.999].map(|part| of.percentile(part) * 1e6);
        println!("  {title}  {median:8.1} {late:8.1} {latest:8.1}   {:9} steps", of.count());
        latest
    };
    println!("microseconds: p50, p99, p99.9");
    let alone = row("lateness of steps, the world alone", &report.quiet.lateness);
    let among = row("lateness of steps, with everybody ", &report.loaded.lateness);
    let [sleeping_alone, sleeping_among] = &report.sleeper;
    let idle = row("a thread that only sleeps, alone  ", sleeping_alone);
    let beside = row("a thread that only sleeps, beside ", sleeping_among);
    row("duration of steps, the world alone", &report.quiet.duration);
    row("duration of steps, with everybody ", &report.loaded.duration);
    let [punctual_alone, punctual_among] = &report.punctual;
    let in_time = row("lateness of steps, alone, while the machine is in time   ", punctual_alone);
    let punctual = row("lateness of steps, everybody, while the machine is in time", punctual_among);
    let (ratio, machine, own) = (among / alone, beside / idle, punctual / in_time);
    println!(
        "lateness p99.9, with everybody / alone: {ratio:.2}; of a thread that only sleeps {machine:.2}; \
         of steps while that thread is in time {own:.2}"
    );
    println!(
        "slope of memory, MiB an hour: allocated {}, of the process {}",
        report.heap_slope, report.memory_slope
    );
    let failures = report.tally.failures().len();
    println!(
        "acknowledged commands that were lost, refusals that were not counted, other failures: {failures}"
    );
    let slopes = [report.heap_slope, report.memory_slope];
    let grows = minutes >= STEADY && slopes.into_iter().any(|slope| slope.is_above(SLOPE));
    // Without a separate processor and a priority, that thread is as late as the daemon makes it.
    let has_own_processor = options.processor.is_some() && priority > 0;
    let is_beyond = |ratio: f64| ratio.is_nan() || ratio > RATIO;
    let share = |some: &Spread, all: &Spread| some.count() as f64 / all.count().max(1) as f64;
    let is_judged = share(punctual_alone, &report.quiet.lateness) >= SHARE
        && share(punctual_among, &report.loaded.lateness) >= SHARE;
    let is_late = is_beyond(ratio) && (!has_own_processor || !is_judged || is_beyond(own));
    let is_well = !is_late && !grows;
    if failures == 0 && (is_well || minutes < LONG) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Returns the daemon that is used.
fn simd() -> String {
    simd_tests::process::binaries().join("simd").display().to_string()
}

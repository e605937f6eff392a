//! How late steps are, and how true the pace is over ten seconds.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use simd_server::config::{Config, Robot};
use simd_server::daemon;
use simd_tests::robots::assets;
use simd_tests::statistics::percentile;

const SECONDS: f64 = 10.0;

/// Prints the table.
pub(crate) fn print() {
    println!("\npace of a daemon with the SolidWorks-style arm, one reader of every state, {SECONDS} s");
    println!("  time step   actual factor   lateness of steps: p50, p99, largest (microseconds)");
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    let runtime = runtime.expect("a runtime");
    for time_step in [1e-3, 1e-4] {
        runtime.block_on(measure(time_step));
    }
}

async fn measure(time_step: f64) {
    let robot = Robot {
        fixed: Some(true),
        positions: BTreeMap::new(),
        ..Robot::at(assets().join("Bench_Arm-1.2 rev B"))
    };
    let zenoh = simd_server::config::Zenoh::off();
    let mut config = Config { robots: vec![robot], zenoh, ..Config::default() };
    config.listen = SocketAddr::from(([127, 0, 0, 1], 0));
    config.physics.time_step = time_step;
    let running = daemon::start(config).await.expect("it starts");
    let begin = Instant::now();
    let (mut states, mut sequence) = (Vec::new(), 0);
    while begin.elapsed().as_secs_f64() < SECONDS {
        let second = Some(Duration::from_secs(1));
        let state = running.handle.newer_than(sequence, second).await.expect("the driver lives");
        sequence = state.sequence;
        let wall = state.wall_time.duration_since(std::time::UNIX_EPOCH).expect("after 1970").as_secs_f64();
        states.push((wall, state.snapshot.at.sim_time));
    }
    let (first, last) = (states[0], states[states.len() - 1]);
    let factor = (last.1 - first.1) / (last.0 - first.0);
    // The earliest state of all has no lateness; the others are late by what they are behind it.
    let behind: Vec<f64> = states.iter().map(|(wall, sim)| wall - sim).collect();
    let earliest = behind.iter().copied().fold(f64::INFINITY, f64::min);
    let mut late: Vec<f64> = behind.iter().map(|behind| (behind - earliest) * 1e6).collect();
    late.sort_by(f64::total_cmp);
    println!(
        "  {:6.1} ms   {factor:13.5}   {:8.1} {:8.1} {:8.1}",
        time_step * 1e3,
        percentile(&late, 0.5),
        percentile(&late, 0.99),
        percentile(&late, 1.0),
    );
    running.drain().await;
}

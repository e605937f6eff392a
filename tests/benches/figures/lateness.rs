//! How late steps are, and how true the pace is over ten seconds.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use glamx::{DPose3, DVec3};
use simd_server::config::{Config, Robot};
use simd_server::daemon::{self, Running};
use simd_tests::robots::assets;
use simd_tests::statistics::percentile;
use tokio::runtime::Runtime;
use tokio::task::JoinHandle;

const SECONDS: f64 = 10.0;

/// Prints the table for two time steps.
pub(crate) fn print() {
    println!("\npace of a daemon with the SolidWorks-style arm, one reader of every state, {SECONDS} s");
    println!("  time step   actual factor   lateness of steps: p50, p99, largest (microseconds)");
    let runtime = runtime();
    for time_step in [1e-3, 1e-4] {
        let robot = Robot {
            fixed: Some(true),
            positions: BTreeMap::new(),
            ..Robot::at(assets().join("Bench_Arm-1.2 rev B"))
        };
        let title = format!("{:6.1} ms", time_step * 1e3);
        runtime.block_on(async { measure(&title, start(vec![robot], time_step).await, Vec::new()).await });
    }
}

pub(crate) fn runtime() -> Runtime {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    runtime.expect("a runtime")
}

/// Prints the table for worlds that are stepped by one thread and by two. The world of one arm is too small
/// for more than one.
pub(crate) fn print_threads() {
    println!(
        "\nseven-joint arms, 1 ms, stepped by one thread and by two, one reader of every state, {SECONDS} s"
    );
    println!("                      actual factor   lateness of steps: p50, p99, largest (microseconds)");
    let runtime = runtime();
    for count in [1, 100] {
        // In turn, so that other load of the machine is the same for both.
        for step_threads in [1, 2, 1, 2] {
            let running = runtime.block_on(start_on(step_threads, (0..count).map(arm).collect(), 1e-3));
            let title = format!("{count:3} arms, {step_threads} threads");
            runtime.block_on(async { measure(&title, running, Vec::new()).await });
        }
    }
}

/// Returns an arm of several side by side, in a square.
pub(crate) fn arm(index: usize) -> Robot {
    let (x, y) = (index % 25, index / 25);
    Robot {
        name: format!("arm-{index}"),
        fixed: Some(true),
        pose: DPose3::from_translation(DVec3::new(3.0 * x as f64, 3.0 * y as f64, 0.0)),
        ..Robot::at(assets().join("seven_arm/urdf/seven_arm.urdf"))
    }
}

pub(crate) async fn start(robots: Vec<Robot>, time_step: f64) -> Running {
    start_on(Config::default().driver.step_threads, robots, time_step).await
}

async fn start_on(step_threads: u32, robots: Vec<Robot>, time_step: f64) -> Running {
    let zenoh = simd_server::config::Zenoh::off();
    let mut config = Config { robots, zenoh, ..Config::default() };
    config.driver.step_threads = step_threads;
    config.listen = SocketAddr::from(([127, 0, 0, 1], 0));
    config.physics.time_step = time_step;
    daemon::start(config).await.expect("it starts")
}

/// Prints how late the steps of a daemon are while these tasks run.
pub(crate) async fn measure(title: &str, running: Running, asking: Vec<JoinHandle<()>>) {
    let begin = Instant::now();
    let (mut states, mut sequence) = (Vec::new(), 0);
    while begin.elapsed().as_secs_f64() < SECONDS {
        let second = Some(Duration::from_secs(1));
        let state = running.handle.newer_than(sequence, second).await.expect("the driver lives");
        sequence = state.sequence;
        let wall = state.wall_time.duration_since(std::time::UNIX_EPOCH).expect("after 1970").as_secs_f64();
        states.push((wall, state.state.at.sim_time));
    }
    let (first, last) = (states[0], states[states.len() - 1]);
    let factor = (last.1 - first.1) / (last.0 - first.0);
    // The earliest state of all has no lateness; the others are late by their delay relative to it.
    let behind: Vec<f64> = states.iter().map(|(wall, sim)| wall - sim).collect();
    let earliest = behind.iter().copied().fold(f64::INFINITY, f64::min);
    let mut late: Vec<f64> = behind.iter().map(|behind| (behind - earliest) * 1e6).collect();
    late.sort_by(f64::total_cmp);
    println!(
        "  {title}   {factor:13.5}   {:8.1} {:8.1} {:8.1}",
        percentile(&late, 0.5),
        percentile(&late, 0.99),
        percentile(&late, 1.0),
    );
    asking.into_iter().for_each(|asking| asking.abort());
    running.drain().await;
}

//! Time of a turn by layers: the same turn at each layer within a process, from the core outwards. It has
//! seven targets, one step, and the states after it. The difference between two rows is the cost of that
//! layer.

use std::hint::black_box;
use std::time::{Duration, Instant};

use prost::Message as _;
use simd_client::proto;
use simd_core::simulation::command::{RobotTargets, SetTargets, WholeTarget};
use simd_server::config::{Config, Robot, Zenoh};
use simd_server::daemon;
use simd_server::embedded::Embedded;
use simd_tests::robots::assets;
use simd_tests::statistics::percentile;
use simd_world::SimHandle;
use simd_world::handle::RunState;
use tokio::runtime::Builder;

/// Rounds, each of which times every row in turn, so that noise affects all alike.
const ROUNDS: usize = 20;
const CALLS: usize = 500;
/// Longer than any call here takes.
const LIMIT: Duration = Duration::from_secs(10);

const ROWS: [&str; 6] = [
    "the newest state, from the handle",
    "a step, by the thread that calls",
    "a turn, by the thread that calls",
    "a turn, by the driver's thread",
    "reading a state, by a call of bytes",
    "a turn, by a call of bytes",
];

/// Prints the table.
pub(crate) fn print() {
    let world = Embedded::start(config(), "1.0", "bench").expect("the world starts");
    let runtime = Builder::new_current_thread().enable_all().build().expect("a runtime");
    let workers = Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let other = workers.block_on(daemon::start(config())).expect("the daemon starts");
    let read = proto::GetJointStatesRequest::default().encode_to_vec();
    let whole = proto::WholeRobotTarget { mode: proto::JointMode::Position.into(), values: vec![0.1; 7] };
    let turn = proto::StepSimulationRequest {
        steps: 1,
        robots: vec![proto::RobotTargets {
            robot: "arm".into(),
            whole: Some(whole),
            ..proto::RobotTargets::default()
        }],
        return_states: true,
        ..proto::StepSimulationRequest::default()
    };
    let turn = turn.encode_to_vec();
    let call = |method: &str, request: &[u8]| {
        let request = request.to_vec().into();
        world.call(method, request, LIMIT, || true).expect("it is answered");
    };
    let mut times = [const { Vec::new() }; ROWS.len()];
    for _ in 0..ROUNDS {
        let [newest, step, here, there, reading, bytes] = &mut times;
        timed(newest, || drop(black_box(world.handle().newest())));
        timed(step, || {
            black_box(runtime.block_on(world.handle().step(1)).expect("it steps"));
        });
        timed(here, || runtime.block_on(turned(world.handle())));
        timed(there, || runtime.block_on(turned(&other.handle)));
        timed(reading, || call("JointService/GetJointStates", &read));
        timed(bytes, || call("SimulationService/StepSimulation", &turn));
    }
    println!("\na turn within the process, paused, seven joints: microseconds ({} of each)", ROUNDS * CALLS);
    println!("  {:46} {:>8} {:>8}", "", "p50", "p99");
    for (row, times) in ROWS.iter().zip(&mut times) {
        times.sort_by(f64::total_cmp);
        println!("  {row:46} {:8.2} {:8.2}", percentile(times, 0.5), percentile(times, 0.99));
    }
    world.close();
}

fn config() -> Config {
    let mut arm = Robot::at(assets().join("seven_arm"));
    arm.name = "arm".into();
    arm.fixed = Some(true);
    let listen = ([127, 0, 0, 1], 0).into();
    let mut config = Config { robots: vec![arm], zenoh: Zenoh::off(), listen, ..Config::default() };
    config.driver.state = RunState::Paused;
    config
}

async fn turned(handle: &SimHandle) {
    let whole = Some(WholeTarget::Position(vec![0.1; 7]));
    let targets = RobotTargets { robot: "arm".into(), whole, ..RobotTargets::default() };
    let targets = SetTargets { robots: vec![targets], ..SetTargets::default() };
    let stepped = handle.step_with(Some(targets), 1).await.expect("it steps");
    black_box(stepped.state.state.positions.first());
}

fn timed(times: &mut Vec<f64>, mut call: impl FnMut()) {
    for _ in 0..CALLS {
        let begun = Instant::now();
        call();
        times.push(begun.elapsed().as_secs_f64() * 1e6);
    }
}

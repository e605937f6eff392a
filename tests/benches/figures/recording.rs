//! Costs of a recording: lateness of steps with it and without, in alternating turns of one run, and bytes a
//! second. Replays of the files are checked for equal states.

use std::fs::File;
use std::io::BufReader;
use std::net::SocketAddr;
use std::path::Path;
use std::time::{Duration, Instant, UNIX_EPOCH};

use glamx::{DPose3, DVec3};
use simd_client::proto::{self, RobotTargets, SetJointTargetsRequest, StartRecordingRequest};
use simd_client::{Client, Target, joint_target};
use simd_server::config::{Config, Robot};
use simd_server::daemon::{self, Running};
use simd_tests::robots::assets;
use simd_tests::statistics::percentile;
use simd_world::handle::RunState;
use simd_world::recording::replay;

/// Robots that stand on the ground and are commanded.
const ROBOTS: usize = 3;
/// Seconds of one turn, without a recording and with one.
const TURNS: [f64; 2] = [20.0, 60.0];
/// Time from one command to the next.
const COMMANDS: Duration = Duration::from_millis(10);

/// Prints the table. `RECORD_MINUTES` is the total time of the recordings (1), `REALTIME_PRIORITY` the
/// priority of the physics thread (none).
pub(crate) fn print() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
    let turns = (number("RECORD_MINUTES").unwrap_or(1.0) * 60.0 / TURNS[1]).ceil().max(1.0);
    let priority = number("REALTIME_PRIORITY").unwrap_or(0.0);
    println!(
        "\n{ROBOTS} humanoids that stand, 1 kHz, a command each 10 ms, {turns} turns of {} s with a recording and {} s \
         without{}",
        TURNS[1],
        TURNS[0],
        if priority > 0.0 {
            format!(", physics thread at priority {priority} of SCHED_FIFO")
        } else {
            String::new()
        }
    );
    println!("               actual factor   lateness of steps: p50, p99, p99.9, largest (microseconds)");
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let directory = tempfile::tempdir().expect("a folder");
    runtime.expect("a runtime").block_on(run(directory.path(), turns as usize, priority as u32));
}

async fn run(directory: &Path, turns: usize, priority: u32) {
    let running = start(directory, priority).await;
    let client = Client::connect(&format!("http://{}", running.address)).await.expect("it listens");
    let commanding = tokio::spawn(command(client.clone()));
    let mut samples = [Sample::default(), Sample::default()];
    let (mut bytes, mut seconds) = (0, 0.0);
    turn(&running, TURNS[0], &mut Sample::default()).await;
    for number in 0..turns {
        turn(&running, TURNS[0], &mut samples[0]).await;
        let name = format!("turn-{number}");
        let request = StartRecordingRequest { name: name.clone(), ..Default::default() };
        client.start_recording(request).await.expect("it begins");
        let begin = Instant::now();
        turn(&running, TURNS[1], &mut samples[1]).await;
        let info = client.stop_recording(&name).await.expect("it ends");
        seconds += begin.elapsed().as_secs_f64();
        bytes += info.bytes;
    }
    commanding.abort();
    for (sample, what) in samples.iter_mut().zip(["without", "recording"]) {
        sample.print(what);
    }
    let contacts = client.contacts(None).await.map_or(0, |contacts| contacts.len());
    running.drain().await;
    println!("  {:.0} kB a second, {contacts} contacts at the end", bytes as f64 / seconds / 1e3);
    let begin = Instant::now();
    let (mut steps, mut commands) = (0, 0);
    for number in 0..turns {
        let path = directory.join(format!("turn-{number}.mcap"));
        let replayed = replay(|| File::open(&path).map(BufReader::new), None).await.expect("it is read");
        if let Some(why) = replayed.difference.or(replayed.damaged).or(replayed.ends_early) {
            println!("  turn-{number}: {why}");
        }
        (steps, commands) = (steps + replayed.steps, commands + replayed.commands);
    }
    println!(
        "  replayed: {steps} steps equal, {commands} commands, in {:.1} s",
        begin.elapsed().as_secs_f64()
    );
}

async fn start(directory: &Path, priority: u32) -> Running {
    let robots = (0..ROBOTS).map(|index| Robot {
        name: format!("humanoid-{index}"),
        pose: DPose3::from_translation(DVec3::new(0.0, 2.0 * index as f64, 1.01)),
        ..Robot::at(assets().join("humanoid/urdf/humanoid.urdf"))
    });
    let zenoh = simd_server::config::Zenoh::off();
    let mut config = Config { robots: robots.collect(), zenoh, ..Config::default() };
    config.listen = SocketAddr::from(([127, 0, 0, 1], 0));
    config.recording.directory = Some(directory.to_owned());
    config.driver.real_time.priority = priority;
    config.driver.state = RunState::Paused;
    let running = daemon::start(config).await.expect("it starts");
    let client = Client::connect(&format!("http://{}", running.address)).await.expect("it listens");
    let geometry = Some(proto::primitive::Geometry::Plane(proto::PlaneGeometry { normal: None }));
    let primitive = proto::Primitive { geometry, mass: 0.0, color: None };
    let source = Some(proto::description_source::Source::Primitive(primitive));
    let source = Some(proto::DescriptionSource { source, ..Default::default() });
    let request = proto::SpawnEntityRequest { source, name: "ground".into(), ..Default::default() };
    client.spawn(request).await.expect("the ground");
    client.play().await.expect("it plays");
    running
}

/// Arms that swing slowly.
async fn command(client: Client) {
    let layout = client.joint_layout("humanoid-0").await.expect("it is there");
    let arms: Vec<String> = layout
        .joints
        .iter()
        .filter(|joint| joint.velocity_count == 1 && joint.name.contains("elbow"))
        .map(|joint| joint.name.clone())
        .collect();
    let mut ticks = tokio::time::interval(COMMANDS);
    for round in 0u32.. {
        ticks.tick().await;
        let angle = 0.3 + 0.2 * (f64::from(round) * 0.02).sin();
        let robots = (0..ROBOTS).map(|index| RobotTargets {
            robot: format!("humanoid-{index}"),
            joints: arms.iter().map(|arm| joint_target(arm, Target::position(angle))).collect(),
            ..Default::default()
        });
        let request = SetJointTargetsRequest { robots: robots.collect(), ..Default::default() };
        client.set_targets(request).await.expect("it is taken");
    }
}

/// Arrival times and simulated times of states, separately for each turn.
#[derive(Default)]
pub(crate) struct Sample {
    late: Vec<f64>,
    factors: Vec<f64>,
}

impl Sample {
    /// How late states were, at a part of all of them, microseconds.
    pub(crate) fn late(&mut self, part: f64) -> f64 {
        self.late.sort_by(f64::total_cmp);
        percentile(&self.late, part)
    }

    pub(crate) fn print(&mut self, what: &str) {
        self.late.sort_by(f64::total_cmp);
        let late = |part: f64| percentile(&self.late, part);
        let factor = self.factors.iter().sum::<f64>() / self.factors.len() as f64;
        println!(
            "  {what:10}   {factor:13.5}   {:8.1} {:8.1} {:8.1} {:8.1}",
            late(0.5),
            late(0.99),
            late(0.999),
            late(1.0)
        );
    }
}

pub(crate) async fn turn(running: &Running, seconds: f64, sample: &mut Sample) {
    let begin = Instant::now();
    let (mut states, mut sequence) = (Vec::new(), 0);
    while begin.elapsed().as_secs_f64() < seconds {
        let state =
            running.handle.newer_than(sequence, Some(Duration::from_secs(1))).await.expect("it lives");
        sequence = state.sequence;
        let wall = state.wall_time.duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64();
        states.push((wall, state.state.at.sim_time));
    }
    let (first, last) = (states[0], states[states.len() - 1]);
    sample.factors.push((last.1 - first.1) / (last.0 - first.0));
    // The earliest state of all has no lateness; the others are late by their delay relative to it.
    let behind = || states.iter().map(|(wall, sim)| wall - sim);
    let earliest = behind().fold(f64::INFINITY, f64::min);
    sample.late.extend(behind().map(|behind| (behind - earliest) * 1e6));
}

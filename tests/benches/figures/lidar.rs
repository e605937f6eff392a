//! A lidar of 16 by 1,024 rays at 10 Hz in a room of 100,000 triangles, beside a 1 kHz world. Prints the
//! lateness of steps with it and without, in alternating turns of one run. It also prints the time of a scan,
//! and the number of finished scans.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glamx::DPose3;
use simd_client::Client;
use simd_client::proto::{LidarSensor, Pose, RangeLimits, Sensor, SensorCursor, Sweep, Vector3, sensor};
use simd_core::simulation::sensors::DueSample;
use simd_server::config::Robot;
use simd_server::daemon::Running;
use simd_tests::room;
use simd_tests::statistics::percentile;

use super::lateness::{arm, runtime, start};
use super::recording::{Sample, turn};

/// Seconds of one turn: the daemon keeps this many scans of a sensor.
const SECONDS: f64 = 5.0;
/// Turns of each.
const TURNS: usize = 12;
/// Scans that are timed separately.
const SCANS: usize = 20;
const ROWS: u32 = 16;
const COLUMNS: u32 = 1_024;
/// Scans per second.
const RATE: f64 = 10.0;

/// Prints the table. `LIDAR_TURNS` is the number of turns of each kind.
pub(crate) fn print() {
    let turns = std::env::var("LIDAR_TURNS").ok().and_then(|text| text.parse().ok()).unwrap_or(TURNS);
    let triangles = room::triangles().len();
    println!(
        "\na lidar of {ROWS} x {COLUMNS} rays at {RATE} Hz in a room of {triangles} triangles, seven-joint arm at 1 kHz, {turns} \
         turns of {SECONDS} s each"
    );
    println!("               actual factor   lateness of steps: p50, p99, p99.9, largest (microseconds)");
    let folder = tempfile::tempdir().expect("a folder");
    runtime().block_on(run(folder.path(), turns));
}

async fn run(folder: &Path, turns: usize) {
    let urdf = room::write(folder).expect("the room is written");
    let room = Robot { fixed: Some(true), positions: BTreeMap::new(), ..Robot::at(urdf) };
    let running = start(vec![room, arm(0)], 1e-3).await;
    let client = Client::connect(&format!("http://{}", running.address)).await.expect("it listens");
    let mut samples = [Sample::default(), Sample::default()];
    turn(&running, SECONDS, &mut Sample::default()).await;
    let mut scans = 0;
    for _ in 0..turns {
        turn(&running, SECONDS, &mut samples[0]).await;
        client.create_sensor(lidar()).await.expect("it is made");
        turn(&running, SECONDS, &mut samples[1]).await;
        scans += measured(&client).await;
        client.delete_sensor("arm-0", "lidar").await.expect("it is there");
    }
    for (sample, what) in samples.iter_mut().zip(["without", "with lidar"]) {
        sample.print(what);
    }
    let [without, with] = &mut samples;
    let ratio = [0.5, 0.99, 0.999].map(|part| with.late(part) / without.late(part));
    println!("  with / without: p50 {:.2}, p99 {:.2}, p99.9 {:.2}", ratio[0], ratio[1], ratio[2]);
    println!("  {:.1} scans a second", scans as f64 / (turns as f64 * SECONDS));
    client.create_sensor(lidar()).await.expect("it is made");
    alone(&running);
    running.drain().await;
}

fn lidar() -> Sensor {
    let sweep = |samples, most: f64| Some(Sweep { samples, min: -most, max: most });
    let horizontal = sweep(COLUMNS, std::f64::consts::PI);
    let range = Some(RangeLimits { min: 0.1, max: 100.0 });
    let kind = LidarSensor { horizontal, vertical: sweep(ROWS, 0.26), range, ..Default::default() };
    Sensor {
        robot: "arm-0".into(),
        name: "lidar".into(),
        // Beside the arm, which it sees.
        pose: Some(Pose { position: Some(Vector3 { x: 1.0, y: 0.5, z: 1.5 }), orientation: None }),
        rate: Some(RATE),
        kind: Some(sensor::Kind::Lidar(kind)),
        ..Default::default()
    }
}

/// Returns the number of finished scans of those that were due; all of them are still kept.
async fn measured(client: &Client) -> usize {
    let cursor = SensorCursor { robot: "arm-0".into(), sensor: "lidar".into(), after_sequence: 0 };
    let of = client.next_sensor_readings(vec![cursor], Duration::ZERO).await.expect("it is there");
    of.iter().map(|of| of.readings.len()).sum()
}

/// Times a scan on a separate thread, with the scene that it needs.
fn alone(running: &Running) {
    let state = running.handle.newest();
    let sensor =
        state.state.sensors.iter().find(|sensor| sensor.definition.name == "lidar").expect("a lidar");
    let due = DueSample {
        id: sensor.id,
        definition: Arc::clone(&sensor.definition),
        robot: sensor.robot,
        sample: 1,
        at: state.state.at,
        gravity: state.physics.gravity,
        period: 1.0 / RATE,
        stream: 0,
        walk: Default::default(),
        start: DPose3::IDENTITY,
        shaft: Default::default(),
    };
    let mut seconds: Vec<f64> = (0..SCANS)
        .map(|_| {
            let begin = Instant::now();
            let reading = state.state.reading(&due, &|| false);
            assert!(reading.is_some(), "a scan is measured");
            begin.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    let median = percentile(&seconds, 0.5);
    let rays = f64::from(ROWS * COLUMNS);
    println!("  a scan alone: {:.1} ms, {:.0} rays a second", median * 1e3, rays / median);
}

//! Lateness of a daemon's steps while clients send read requests without a pause.

use std::fmt::Write as _;
use std::time::Duration;

use simd_client::proto::{ComputeInverseKinematicsRequest, GetMassMatrixRequest, Pose, Vector3};
use simd_client::{Client, ray};
use simd_tests::process::{Process, leave_the_last_processor};
use simd_tests::robots::assets;
use simd_tests::soak::Steps;

use super::lateness::runtime;

const SECONDS: u64 = 20;
const ROBOTS: usize = 500;
/// Clients that ask.
const ASKING: usize = 6;

/// Prints the table for the program as it is installed, and as an operator sets it up for real time.
pub(crate) fn print() {
    println!(
        "\n{ROBOTS} seven-joint arms, 10 ms, alone and while {ASKING} clients ask for rays, mass matrices and inverse \
         kinematics without a pause, {SECONDS} s"
    );
    println!("                                            lateness of steps: p50, p99, p99.9 (microseconds)");
    rows("physics thread as all others", "");
    // The processor set applies to a thread and those that it starts: the rest of the bench keeps its own.
    let with_its_own = || {
        let processor = leave_the_last_processor();
        let processors = processor.map_or(String::new(), |number| format!("processors = [{number}]\n"));
        rows("priority 40, its own processor", &format!("[realtime]\npriority = 40\n{processors}"));
    };
    std::thread::scope(|scope| {
        scope.spawn(with_its_own);
    });
}

/// Without and with requests, in turn.
fn rows(title: &str, real_time: &str) {
    let runtime = runtime();
    for asking in [0, ASKING, 0, ASKING] {
        let steps = runtime.block_on(measure(real_time, asking));
        let [half, late, latest] = [0.5, 0.99, 0.999].map(|part| steps.lateness.percentile(part) * 1e6);
        println!("  {title:30} {asking:3} asking   {half:8.1} {late:8.1} {latest:8.1}");
    }
}

/// Measures the lateness of a daemon's steps with this many clients.
async fn measure(real_time: &str, asking: usize) -> Steps {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("simd.toml");
    std::fs::write(&path, format!("{real_time}{}", arms())).expect("a file");
    let daemon = Process::start(["--time-step", "0.01", "--config", &path.to_string_lossy()]).await;
    let client = daemon.client().await;
    let asking: Vec<_> = (0..asking).map(|_| tokio::spawn(ask(daemon.endpoint.clone()))).collect();
    // The first requests make data that all later ones share.
    tokio::time::sleep(Duration::from_secs(1)).await;
    let before = Steps::so_far(&client).await.expect("the daemon answers");
    tokio::time::sleep(Duration::from_secs(SECONDS)).await;
    let after = Steps::so_far(&client).await.expect("the daemon answers");
    asking.into_iter().for_each(|asking| asking.abort());
    after.since(&before)
}

/// Beside each other, on a square.
fn arms() -> String {
    let urdf = assets().join("seven_arm/urdf/seven_arm.urdf");
    (0..ROBOTS).fold(String::new(), |mut text, index| {
        let (x, y) = (3.0 * (index % 25) as f64, 3.0 * (index / 25) as f64);
        let arm = format!(
            "[[robots]]\npath = {urdf:?}\nname = \"arm-{index}\"\nxyz = [{x:?}, {y:?}, 0.0]\nfixed = true"
        );
        writeln!(text, "{arm}").expect("text");
        text
    })
}

/// Sends the most expensive read request in an endless loop.
async fn ask(endpoint: String) {
    let client = Client::connect(&endpoint).await.expect("the daemon listens");
    let side = 75.0;
    let ray = |i: usize| {
        let angle = i as f64;
        let (x, y) = (side * (0.5 + 0.5 * angle.cos()), side * (0.5 + 0.5 * angle.sin()));
        ray([0.0, y, 0.4], [side, x, 0.4])
    };
    for round in 0.. {
        let robot = format!("arm-{}", round % ROBOTS);
        let matrix = GetMassMatrixRequest { robot: robot.clone(), configuration: None };
        // Out of reach, so that it searches for as long as it may.
        let position = Some(Vector3 { x: -100.0, y: 0.0, z: 0.0 });
        let search = ComputeInverseKinematicsRequest {
            robot,
            link: "link_7".into(),
            target: Some(Pose { position, orientation: None }),
            max_iterations: 1_000,
            ..Default::default()
        };
        // A refusal for too many waiting calls is an answer too.
        let _rays = client.cast_rays((0..1_000).map(ray)).await;
        let _matrix = client.mass_matrix(matrix).await;
        let _found = client.inverse_kinematics(search).await;
    }
}

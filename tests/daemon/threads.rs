//! Threads of the process, which do not grow with its work.
#![cfg(target_os = "linux")]

use std::path::Path;

use simd_client::Client;
use simd_client::proto::primitive::Geometry;
use simd_client::proto::{DescriptionSource, Primitive, SpawnEntityRequest, SphereGeometry};
use simd_client::proto::{Pose, Vector3, description_source::Source};
use simd_tests::network::session;
use simd_tests::process::{Process, soon};

const ROBOTS: usize = 100;

fn ball(number: usize) -> SpawnEntityRequest {
    let geometry = Some(Geometry::Sphere(SphereGeometry { radius: 0.1 }));
    let primitive = Primitive { geometry, mass: 1.0, color: None };
    let source = Some(Source::Primitive(primitive));
    let position = Some(Vector3 { x: number as f64, ..Default::default() });
    SpawnEntityRequest {
        name: format!("ball_{number}"),
        source: Some(DescriptionSource { source, ..Default::default() }),
        pose: Some(Pose { position, ..Default::default() }),
        ..Default::default()
    }
}

/// Of tokio's runtime: its workers, and those that may work or wait for long.
fn threads_of_the_runtime(pid: u32) -> usize {
    let tasks = std::fs::read_dir(Path::new("/proc").join(pid.to_string()).join("task")).unwrap();
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok());
    names.filter(|name| name.starts_with("tokio-rt")).count()
}

/// Each publication may wait for a moment. A thread for each that is on its way would be some hundred.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn publishing_many_robots_needs_no_thread_for_each() {
    let daemon = Process::start_with(["--zenoh", "tcp/127.0.0.1:0"], ["--name", "many"]).await;
    let client = Client::connect(&daemon.endpoint).await.unwrap();
    for number in 0..ROBOTS {
        client.spawn(ball(number)).await.unwrap();
    }
    let session = session("client", daemon.locator.as_deref().unwrap()).await;
    let poses = session.declare_subscriber("simd/many/link_poses/*").await.unwrap();
    let mut most = 0;
    for _ in 0..100 {
        for _ in 0..ROBOTS {
            soon("a pose", poses.recv_async()).await.unwrap();
        }
        most = most.max(threads_of_the_runtime(daemon.pid().unwrap()));
    }
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    assert!(most <= 16 + 2 * processors, "{most}");
}

//! Threads of the process, which do not grow with its work.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};

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

/// Returns the folder and the name of each thread.
pub(crate) fn threads(pid: u32) -> Vec<(PathBuf, String)> {
    let tasks = std::fs::read_dir(Path::new("/proc").join(pid.to_string()).join("task")).unwrap();
    let folders = tasks.map(|task| task.unwrap().path());
    // A thread that has ended has none.
    folders
        .filter_map(|folder| Some((folder.clone(), std::fs::read_to_string(folder.join("comm")).ok()?)))
        .collect()
}

/// Returns the number of tokio's threads: its workers, and those for long or blocking work.
fn threads_of_the_runtime(pid: u32) -> usize {
    threads(pid).iter().filter(|(_, name)| name.starts_with("tokio-rt")).count()
}

/// Returns whether a list of the kernel, as `0-2,5`, has a number.
fn contains(list: &str, number: usize) -> bool {
    list.split(',').any(|range| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        (first.parse().unwrap()..=last.parse().unwrap()).contains(&number)
    })
}

#[tokio::test]
async fn a_processor_of_the_physics_thread_is_its_own() {
    let allowed = rustix::thread::sched_getaffinity(None).unwrap();
    let processors: Vec<_> = (0..1024).filter(|number| allowed.is_set(*number)).collect();
    let own = processors[processors.len() - 1];
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("simd.toml");
    std::fs::write(&config, format!("[realtime]\nprocessors = [{own}]\n")).unwrap();
    let daemon = Process::start([Path::new("--config"), &config]).await;
    // Its physics thread has answered, and so has made its system requests.
    daemon.client().await.pause().await.unwrap();
    let threads = threads(daemon.pid().unwrap());
    assert!(threads.iter().any(|(_, name)| name.trim() == "simd-driver"), "{threads:?}");
    for (folder, name) in threads {
        let Ok(status) = std::fs::read_to_string(folder.join("status")) else { continue };
        let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap().trim();
        match name.trim() {
            "simd-driver" => assert_eq!(list, own.to_string()),
            // A single processor is used by all threads.
            _ => assert_eq!(contains(list, own), processors.len() == 1, "{name}: {list}"),
        }
    }
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
    for _ in 0..30 {
        for _ in 0..ROBOTS {
            soon("a pose", poses.recv_async()).await.unwrap();
        }
        most = most.max(threads_of_the_runtime(daemon.pid().unwrap()));
    }
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    assert!(most <= 16 + 2 * processors, "{most}");
}

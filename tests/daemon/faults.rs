//! Faults of the system: the daemon continues once they are over.

use std::time::Duration;

use rustix::process::{Pid, Resource, Rlimit, prlimit};
use simd_client::proto::SimulationState;
use simd_client::proto::event::Kind;
use simd_tests::process::{Process, soon};
use tokio::net::TcpStream;

async fn demo() -> Process {
    let arguments = ["--config", "tests/assets/demo.toml"];
    Process::start_with(["--zenoh", "tcp/127.0.0.1:0"], arguments).await
}

/// Returns the files that a process has open.
fn open_files(daemon: &Process) -> u64 {
    std::fs::read_dir(format!("/proc/{}/fd", daemon.pid().unwrap())).unwrap().count() as u64
}

fn limit_open_files(daemon: &Process, current: u64) {
    let pid = Pid::from_raw(i32::try_from(daemon.pid().unwrap()).unwrap());
    let maximum = prlimit(pid, Resource::Nofile, Rlimit { current: Some(current), maximum: None });
    // Without the right to raise it, the maximum stays.
    if maximum.is_err() {
        let limit = Rlimit { current: Some(current), maximum: Some(current) };
        prlimit(pid, Resource::Nofile, limit).unwrap();
    }
}

/// Existing clients are served; new ones wait until others have gone.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn where_no_file_can_be_opened_those_who_are_there_are_served_and_others_later() {
    let mut daemon = demo().await;
    let client = daemon.client().await;
    client.robots().await.unwrap();
    limit_open_files(&daemon, open_files(&daemon) + 4);
    let mut silent = Vec::new();
    for _ in 0..40 {
        silent.push(TcpStream::connect(daemon.address()).await.unwrap());
    }
    for _ in 0..10 {
        assert_eq!(client.robots().await.unwrap().len(), 1);
    }
    drop(silent);
    let another = soon("a place", async {
        loop {
            if let Ok(client) = simd_client::Client::connect(&daemon.endpoint).await
                && client.robots().await.is_ok()
            {
                return client;
            }
        }
    })
    .await;
    assert_eq!(another.robots().await.unwrap().len(), 1);
    daemon.signal("TERM").await;
    assert_eq!(daemon.ended().await.0.code(), Some(0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_that_was_stopped_goes_on_and_says_what_it_dropped() {
    let mut daemon = demo().await;
    let client = daemon.client().await;
    let mut events = client.watch_events(0).await.unwrap();
    let before = client.world_statistics().await.unwrap();
    daemon.signal("STOP").await;
    // Longer than the lag that is made good.
    client.clone().with_timeout(Duration::from_millis(500)).robots().await.unwrap_err();
    daemon.signal("CONT").await;
    let overrun = soon("the overrun", async {
        loop {
            let event = events.next().await.unwrap().unwrap().event;
            if let Some(Kind::Overrun(overrun)) = event.kind {
                return overrun;
            }
        }
    })
    .await;
    assert!(overrun.dropped_lag > 0.2, "{overrun:?}");
    let after = client.world_statistics().await.unwrap();
    assert_eq!(after.state(), SimulationState::Playing);
    assert!(after.dropped_lag > before.dropped_lag && after.iterations > before.iterations);
    daemon.signal("TERM").await;
    assert_eq!(daemon.ended().await.0.code(), Some(0));
}

//! Faults of the system: the daemon continues once they are over.

use std::time::Duration;

use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};
use simd_client::proto::SimulationState;
use simd_client::proto::event::Kind;
use simd_tests::process::{Home, Process, said, soon};
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
    // The daemon inherited this maximum.
    let maximum = getrlimit(Resource::Nofile).maximum;
    prlimit(pid, Resource::Nofile, Rlimit { current: Some(current), maximum }).unwrap();
}

/// Existing clients are served; new ones wait until others have gone.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn if_no_file_can_be_opened_present_clients_are_served_and_others_later() {
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

/// Zenoh's own threads would need files for the first client.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_of_zenoh_that_comes_while_no_file_can_be_opened_does_no_harm() {
    let mut daemon = demo().await;
    let grpc = daemon.client().await;
    let locator = daemon.locator.clone().unwrap();
    let free = open_files(&daemon) + 1;
    limit_open_files(&daemon, free);
    // Its session may wait for long.
    let comes = simd_client::Client::connect(&locator);
    let _ = tokio::time::timeout(Duration::from_secs(2), comes).await;
    assert_eq!(grpc.robots().await.unwrap().len(), 1);
    limit_open_files(&daemon, free + 100);
    let served = soon("a client of Zenoh", async {
        loop {
            if let Ok(client) = simd_client::Client::connect(&locator).await
                && client.robots().await.is_ok()
            {
                return client;
            }
        }
    })
    .await;
    assert_eq!(served.robots().await.unwrap().len(), 1);
    daemon.signal("TERM").await;
    let (status, log) = daemon.ended().await;
    assert_eq!(status.code(), Some(0));
    assert!(!log.contains("panicked"), "{log}");
}

#[tokio::test]
async fn a_limit_of_open_files_that_is_too_low_for_a_start_is_named() {
    let home = Home::new();
    for limit in [10, 20, 40] {
        let simd = simd_tests::process::binaries().join("simd");
        let simd = format!("{} --zenoh tcp/127.0.0.1:0 --listen 127.0.0.1:0", simd.display());
        let line = format!("ulimit -n {limit}; exec {simd}");
        let mut command = home.command("sh");
        command.args(["-c", &line]);
        let said = said("a start without files", command).await;
        assert_eq!(said.code, 1, "{said:?}");
        let sentence = format!("simd: the system's limit of open files is {limit}, and the daemon needs ");
        assert!(said.err.contains(&sentence), "{said:?}");
        assert!(!said.err.contains("panicked"), "{said:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_that_was_stopped_continues_and_says_what_it_dropped() {
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

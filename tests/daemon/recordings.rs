//! Recordings of a daemon that is killed, and of one whose disk is full.

use rustix::process::{Pid, Resource, Rlimit, prlimit};
use simd_client::proto::event::Kind;
use simd_client::proto::{RecordingEndCause, RecordingState, SimulationState, StartRecordingRequest};
use simd_client::{Client, Target, joint_target};
use simd_tests::process::{Home, Process, soon};
use tempfile::TempDir;

async fn recording_daemon() -> (Process, Client, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let recordings = folder.path().to_str().unwrap().to_owned();
    let daemon = Process::start(["--config", "tests/assets/demo.toml", "--recordings", &recordings]).await;
    let client = daemon.client().await;
    (daemon, client, folder)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_daemon_without_a_folder_of_recordings_keeps_recordings_below_the_users_state() {
    let daemon = Process::start(["--config", "tests/assets/demo.toml"]).await;
    let recordings = daemon.home().join("state/simd/recordings");
    let listed = daemon.simctl(["record", "list"]).await;
    assert_eq!(listed.code, 0, "{}", listed.err);
    assert!(!recordings.exists(), "the first recording makes the folder");
    let started = daemon.simctl(["record", "start", "run"]).await;
    assert_eq!(started.code, 0, "{}", started.err);
    let stopped = daemon.simctl(["record", "stop"]).await;
    assert_eq!(stopped.code, 0, "{}", stopped.err);
    assert!(recordings.join("run.mcap").is_file());
}

/// Sends commands and steps until the recording has this many bytes on the disk.
async fn fill(client: &Client, bytes: u64) {
    let robot = client.robots().await.unwrap()[0].name.clone();
    let joint = client.joint_layout(&robot).await.unwrap().joints[0].name.clone();
    let mut number = 0.0;
    soon("so many bytes", async {
        while client.recordings().await.unwrap()[0].bytes < bytes {
            number += 0.001;
            client.set_robot_targets(&robot, [joint_target(&joint, Target::position(number))]).await.unwrap();
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn after_a_kill_the_recording_is_replayed_to_its_end() {
    let (mut daemon, client, folder) = recording_daemon().await;
    let request = StartRecordingRequest { name: "run".into(), ..Default::default() };
    client.start_recording(request).await.unwrap();
    fill(&client, 40_000).await;
    daemon.kill().await;
    let file = folder.path().join("run.mcap");
    let said = Home::new().run("simd", ["replay", file.to_str().unwrap()]).await;
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    assert!(said.out.contains(": equal; it ends at byte"), "{}", said.out);
    // Another daemon of the same folder detects that it is incomplete.
    let recordings = folder.path().to_str().unwrap().to_owned();
    let after = Process::start(["--recordings", &recordings]).await;
    let listed = after.client().await.recordings().await.unwrap();
    assert_eq!(listed[0].state(), RecordingState::Unfinished);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_disk_ends_the_recording_with_an_event_and_the_world_continues() {
    let (mut daemon, client, folder) = recording_daemon().await;
    let mut events = client.watch_events(0).await.unwrap();
    let request = StartRecordingRequest { name: "run".into(), ..Default::default() };
    client.start_recording(request).await.unwrap();
    let pid = Pid::from_raw(i32::try_from(daemon.pid().unwrap()).unwrap());
    fill(&client, 10_000).await;
    let written = client.recordings().await.unwrap()[0].bytes;
    let limit = Rlimit { current: Some(written + 20_000), maximum: None };
    prlimit(pid, Resource::Fsize, limit).unwrap();
    let robot = client.robots().await.unwrap()[0].name.clone();
    let joint = client.joint_layout(&robot).await.unwrap().joints[0].name.clone();
    let commands = async {
        let mut number = 0.0;
        loop {
            number += 0.001;
            client.set_robot_targets(&robot, [joint_target(&joint, Target::position(number))]).await.unwrap();
        }
    };
    let ended = async {
        loop {
            if let Some(Kind::RecordingEnded(ended)) = events.next().await.unwrap().unwrap().event.kind {
                return ended;
            }
        }
    };
    let ended = soon("the end of the recording", async {
        tokio::select! {
            ended = ended => ended,
            () = commands => unreachable!("it goes on"),
        }
    })
    .await;
    assert_eq!(ended.cause(), RecordingEndCause::WriteFailed);
    assert!(ended.message.contains("it cannot be written"), "{}", ended.message);
    let before = client.world_statistics().await.unwrap();
    assert_eq!(before.state(), SimulationState::Playing);
    client.next_events(0, std::time::Duration::ZERO).await.unwrap();
    let file = folder.path().join("run.mcap");
    let said = Home::new().run("simd", ["replay", file.to_str().unwrap()]).await;
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    daemon.signal("TERM").await;
    assert_eq!(daemon.ended().await.0.code(), Some(0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recording_that_is_being_made_is_complete_when_the_daemon_ends() {
    let (mut daemon, client, folder) = recording_daemon().await;
    let recorded = daemon.simctl(["record", "start", "run"]).await;
    assert_eq!((recorded.code, &*recorded.out), (0, "recording run into run.mcap\n"), "{}", recorded.err);
    client.world_statistics().await.unwrap();
    daemon.signal("TERM").await;
    assert_eq!(daemon.ended().await.0.code(), Some(0));
    let file = folder.path().join("run.mcap");
    let said = Home::new().run("simd", ["replay", file.to_str().unwrap()]).await;
    assert!(said.code == 0 && said.out.trim_end().ends_with(": equal"), "{}{}", said.out, said.err);
    let other = Home::new().run("simd", ["replay", "Cargo.toml"]).await;
    assert_eq!(other.code, 2);
    assert!(other.err.contains("it does not begin like an MCAP file"), "{}", other.err);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_download_that_fails_leaves_nothing_and_no_table_overwrites_the_recording() {
    let (daemon, client, _folder) = recording_daemon().await;
    let request = StartRecordingRequest { name: "run".into(), state_rate: Some(100.0), ..Default::default() };
    client.start_recording(request).await.unwrap();
    let step = async || client.joint_states(Vec::new()).await.unwrap().stamp.unwrap().step;
    let begun = step().await;
    soon("a hundred states", async { while step().await < begun + 1_000 {} }).await;
    client.stop_recording("run").await.unwrap();
    let here = Home::new();
    let files = || std::fs::read_dir(here.path()).unwrap().count();
    let download = "simctl record download run";
    let full = daemon.shell(&format!("trap '' XFSZ; ulimit -f 1; {download}"), here.path()).await;
    assert!(full.code == 1 && full.err.contains("File too large"), "{full:?}");
    assert_eq!(files(), 0);
    let whole = daemon.shell(download, here.path()).await;
    assert_eq!((whole.code, files()), (0, 1), "{}", whole.err);
    let file = here.path().join("run.mcap");
    let before = std::fs::read(&file).unwrap();
    let again = daemon.shell(download, here.path()).await;
    assert!(again.code == 1 && again.err.contains("the file already exists"), "{again:?}");
    let table = daemon.shell("simctl record export run.mcap --csv ./run.mcap", here.path()).await;
    assert!(table.code == 1 && table.err.contains("would overwrite the recording"), "{table:?}");
    for to in ["--csv run.csv", "--ros2 bag"] {
        let export = format!("simctl record export run.mcap {to}");
        let there = files();
        let full = daemon.shell(&format!("trap '' XFSZ; ulimit -f 1; {export}"), here.path()).await;
        assert!(full.code == 1 && full.err.contains("File too large"), "{full:?}");
        assert_eq!(files(), there, "{to}");
        let exported = daemon.shell(&export, here.path()).await;
        assert_eq!((exported.code, files()), (0, there + 1), "{}", exported.err);
    }
    assert!(std::fs::read(&file).unwrap() == before, "it was written to");
}

//! A restarted daemon that saves its world continues it, however it ended. A full disk is tested too, for
//! that file and for a saved state that `simctl` exports.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use rustix::process::{Pid, Resource, Rlimit, prlimit};
use simd_client::{Client, Target, joint_target};
use simd_tests::daemon::fixed;
use simd_tests::process::{Home, Process, soon};
use simd_tests::robots::assets;

use crate::paused;

const EVERY: &str = "autosave.every_seconds=0.1";

fn autosave(home: &Home) -> PathBuf {
    home.path().join("world.simdstate")
}

/// Returns a daemon with the robot of the demo, unless its world is restored.
async fn start(file: &Path) -> Process {
    let file = format!("autosave.file={}", file.display());
    let flags = [
        "--config",
        "tests/assets/demo.toml",
        "--set",
        &file,
        "--set",
        EVERY,
        "--set",
        "autosave.restore=true",
    ];
    Process::start_with(["--zenoh", "off"], flags).await
}

/// Returns the step, and the position of the second robot's joint then.
async fn shoulder(client: &Client) -> (u64, f64) {
    let states = client.joint_states(Vec::new()).await.unwrap();
    (states.stamp.unwrap().step, states.robots[1].position[0])
}

async fn end(mut daemon: Process) {
    daemon.signal("TERM").await;
    assert_eq!(daemon.ended().await.0.code(), Some(0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_restarted_daemon_continues_where_it_was() {
    let home = Home::new();
    let file = autosave(&home);
    let daemon = start(&file).await;
    let client = daemon.client().await;
    client.load(assets().join("Bench_Arm-1.2 rev B"), fixed("second")).await.unwrap();
    client.set_robot_targets("second", [joint_target("shoulder", Target::position(0.3))]).await.unwrap();
    soon("the target", async { while (shoulder(&client).await.1 - 0.3).abs() > 1e-3 {} }).await;
    client.pause().await.unwrap();
    let before = shoulder(&client).await;
    end(daemon).await;

    let daemon = start(&file).await;
    let client = daemon.client().await;
    let robots: Vec<String> = client.robots().await.unwrap().into_iter().map(|robot| robot.name).collect();
    assert_eq!(robots, ["bench_arm", "second"], "those of the configuration are not loaded again");
    let after = shoulder(&client).await;
    // It plays again, on its last bit of way to the target.
    assert!(after.0 >= before.0 && (after.1 - before.1).abs() < 0.02, "{after:?} after {before:?}");
    end(daemon).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_autosave_without_a_file_is_kept_below_the_users_state_by_the_daemons_name() {
    let mut daemon = Process::start(["--name", "lab", "--autosave", "--paused"]).await;
    let file = daemon.home().join("state/simd/lab.simdstate");
    daemon.signal("TERM").await;
    assert_eq!(daemon.ended().await.0.code(), Some(0));
    assert!(file.is_file());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_daemon_that_is_killed_while_it_saves_leaves_a_whole_file() {
    let home = Home::new();
    let file = autosave(&home);
    let mut steps = 0;
    for _ in 0..5 {
        let mut daemon = start(&file).await;
        let client = daemon.client().await;
        let step = client.joint_states(Vec::new()).await.unwrap().stamp.unwrap().step;
        assert!(step >= steps, "step {step} after {steps}");
        steps = step;
        let written = || fs::metadata(&file).and_then(|file| file.modified()).ok();
        let before = written();
        soon("the file", async {
            while written() == before {
                tokio::task::yield_now().await
            }
        })
        .await;
        daemon.kill().await;
    }
    assert!(steps > 0, "it went on at least once");
    assert!(!with(&file, ".unusable").exists());
}

fn with(file: &Path, suffix: &str) -> PathBuf {
    format!("{}{suffix}", file.display()).into()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_file_that_cannot_be_used_is_moved_aside_and_the_daemon_starts_as_it_is_configured() {
    let home = Home::new();
    let file = autosave(&home);
    let daemon = start(&file).await;
    end(daemon).await;
    let whole = fs::read(&file).unwrap();
    let damaged = [&whole[..whole.len() / 2], b"", b"no saved state"];
    let asides = [".unusable", ".unusable.2", ".unusable.3"].map(|suffix| with(&file, suffix));
    for (damaged, aside) in damaged.into_iter().zip(&asides) {
        fs::write(&file, damaged).unwrap();
        let mut daemon = start(&file).await;
        daemon.logged("cannot be used").await;
        assert_eq!(fs::read(aside).unwrap(), damaged);
        assert_eq!(daemon.client().await.robots().await.unwrap().len(), 1);
        end(daemon).await;
    }
    assert_eq!(fs::read(&asides[0]).unwrap(), damaged[0], "none replaced another");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn if_the_world_cannot_be_saved_the_log_says_so_once_and_the_world_continues() {
    let home = Home::new();
    let folder = home.path().join("not there for a while");
    fs::create_dir(&folder).unwrap();
    let mut daemon = start(&folder.join("world.simdstate")).await;
    fs::remove_dir_all(&folder).unwrap();
    daemon.logged("the world is not saved to").await;
    let client = daemon.client().await;
    assert_eq!(client.robots().await.unwrap().len(), 1);
    fs::create_dir(&folder).unwrap();
    daemon.logged("the world is saved again").await;
    end(daemon).await;
    assert!(folder.join("world.simdstate").exists());
}

/// For the writer of a file, a limit of its size is like a full disk: a part is written, and no more.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn on_a_full_disk_the_file_before_stays_as_it_was_and_the_world_continues() {
    let home = Home::new();
    let file = autosave(&home);
    let mut daemon = start(&file).await;
    let client = daemon.client().await;
    soon("the file", async {
        while !file.exists() {
            tokio::task::yield_now().await
        }
    })
    .await;
    let pid = Pid::from_raw(i32::try_from(daemon.pid().unwrap()).unwrap());
    prlimit(pid, Resource::Fsize, Rlimit { current: Some(100), maximum: None }).unwrap();
    daemon.logged(&format!("the world is not saved to {}: File too large", file.display())).await;
    let before = fs::read(&file).unwrap();
    assert!(before.len() > 100, "so little would fit: {}", before.len());
    let step = async || client.joint_states(Vec::new()).await.unwrap().stamp.unwrap().step;
    let failed = step().await;
    // For the time of some more attempts.
    soon("further steps", async { while step().await < failed + 400 {} }).await;
    assert!(fs::read(&file).unwrap() == before, "it was written to");
    daemon.signal("TERM").await;
    let (status, left) = daemon.ended().await;
    assert_eq!(status.code(), Some(0), "{left}");
    // The log reported it once while the world ran, and once for the last attempt.
    assert_eq!(left.matches("the world is not saved to").count(), 1, "{left}");
    assert!(fs::read(&file).unwrap() == before, "it was written to");
    assert!(!with(&file, ".new").exists(), "what did not fit takes room");

    let mut daemon = start(&file).await;
    daemon.logged("the world is as it was saved").await;
    assert_eq!(daemon.client().await.robots().await.unwrap().len(), 1);
    end(daemon).await;
}

#[tokio::test]
async fn an_export_onto_a_full_disk_says_so_and_the_saved_state_is_kept() {
    let home = Home::new();
    let daemon = paused().await;
    let saved = daemon.simctl(["state", "save", "mark"]).await;
    assert_eq!(saved.code, 0, "{}", saved.err);
    let full = daemon.simctl(["state", "export", "mark", "/dev/full"]).await;
    assert_eq!((full.code, full.out.as_str()), (1, ""));
    assert!(full.err.starts_with("simctl: cannot write /dev/full: No space left"), "{}", full.err);
    let file = home.path().join("mark.simdstate").display().to_string();
    let exported = daemon.simctl(["state", "export", "mark", &file]).await;
    assert_eq!(exported.code, 0, "{}", exported.err);
    let read = daemon.simctl(["state", "import", &file, "--name", "again"]).await;
    assert_eq!(read.code, 0, "{}", read.err);
}

#[tokio::test]
async fn an_export_that_fails_leaves_the_file_before_and_nothing_beside_it() {
    let home = Home::new();
    let daemon = paused().await;
    let saved = daemon.simctl(["state", "save", "mark"]).await;
    assert_eq!(saved.code, 0, "{}", saved.err);
    let file = home.path().join("mark.simdstate");
    fs::write(&file, "the one before").unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
    // A file of one block of 512 bytes is the largest that the shell's programs may write.
    let line = "simctl state export mark mark.simdstate";
    let full = daemon.shell(&format!("trap '' XFSZ; ulimit -f 1; {line}"), home.path()).await;
    assert!(full.code == 1 && full.err.contains("File too large"), "{full:?}");
    assert_eq!(fs::read(&file).unwrap(), b"the one before");
    assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
    let exported = daemon.shell(line, home.path()).await;
    assert_eq!(exported.code, 0, "{}", exported.err);
    let metadata = fs::metadata(&file).unwrap();
    assert!(metadata.len() > 512, "so little would fit: {}", metadata.len());
    assert_eq!(metadata.permissions().mode() & 0o777, 0o640);
    assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
}

//! A log that cannot be written, and a stdout that is not read: the daemon serves and ends as ever.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufRead as _, BufReader, ErrorKind};
use std::os::unix::fs::MetadataExt as _;
use std::process::Stdio;

use simd_client::proto::event::Kind;
use simd_client::{Target, joint_target};
use simd_tests::daemon::fixed;
use simd_tests::process::{Home, Process, soon};
use simd_tests::robots::assets;
use tokio::net::unix::pipe;

/// More than a pipe holds.
const MANY: usize = 200;

/// Returns a daemon that logs each thing that it does, in a world that is always late.
async fn loud(stderr: impl Into<Stdio>) -> Process {
    let arguments = ["--log", "trace", "--rtf", "1000", "--time-step", "0.0001"];
    Process::start_logging_to(stderr.into(), ["--zenoh", "tcp/127.0.0.1:0"], arguments).await
}

/// Robots are added and deleted, targets are set, overruns are reported; then SIGTERM ends it with 0.
async fn serves_and_ends(daemon: &mut Process) {
    let client = daemon.client().await;
    let mut events = client.watch_events(0).await.unwrap();
    for i in 0..5 {
        let arm = format!("arm_{i}");
        client.load(assets().join("Bench_Arm-1.2 rev B"), fixed(&arm)).await.unwrap();
        for _ in 0..MANY / 5 {
            let target = joint_target("shoulder", Target::position(0.1));
            client.set_robot_targets(&arm, [target]).await.unwrap();
        }
    }
    let warned = async {
        let mut overruns = 0;
        while overruns < 2 {
            let event = events.next().await.unwrap().unwrap().event;
            overruns += usize::from(matches!(event.kind, Some(Kind::Overrun(_))));
        }
    };
    soon("the second overrun", warned).await;
    assert_eq!(client.robots().await.unwrap().len(), 5);
    daemon.signal("TERM").await;
    let (status, _) = daemon.ended().await;
    assert_eq!(status.code(), Some(0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_log_whose_reader_is_gone_harms_nothing() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    serves_and_ends(&mut loud(writer).await).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_log_on_a_full_disk_harms_nothing() {
    let full = File::options().write(true).open("/dev/full").unwrap();
    serves_and_ends(&mut loud(full).await).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_log_that_is_not_read_does_no_harm() {
    let (_reader, writer) = std::io::pipe().unwrap();
    serves_and_ends(&mut loud(writer).await).await;
}

/// As after Ctrl-S and Ctrl-Q. More is logged than the pipe and the daemon keep.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_returning_reader_of_the_log_learns_how_much_is_missing() {
    let (reader, writer) = std::io::pipe().unwrap();
    let daemon = loud(writer).await;
    let client = daemon.client().await;
    // The line of a spawn has the whole robot, 100 kB of it.
    for i in 0..MANY / 4 {
        client.load(assets().join("Bench_Arm-1.2 rev B"), fixed(&format!("arm_{i}"))).await.unwrap();
    }
    let read = tokio::task::spawn_blocking(move || {
        let mut lines = BufReader::new(reader).lines();
        lines.find(|line| line.as_ref().is_ok_and(|line| line.contains("lines of this log that could not")))
    });
    let notice = soon("the line about what is missing", read).await.unwrap().unwrap().unwrap();
    let lost: u64 = notice.rsplit(' ').next().unwrap().parse().unwrap();
    assert!(lost > 0, "{notice}");
}

/// Returns the writing end of a pipe that has no room.
async fn full_pipe() -> (Stdio, pipe::Receiver) {
    let (writer, reader) = pipe::pipe().unwrap();
    writer.writable().await.unwrap();
    loop {
        match writer.try_write(&[b'\n'; 4096]) {
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => break,
            Err(error) => panic!("{error}"),
        }
    }
    (writer.into_blocking_fd().unwrap().into(), reader)
}

#[tokio::test]
async fn a_stdout_that_is_not_read_delays_neither_start_nor_end() {
    let (stdout, _reader) = full_pipe().await;
    let mut command = Home::new().command(simd_tests::process::binaries().join("simd"));
    command.args(["--listen", "127.0.0.1:0", "--zenoh", "off"]).stdout(stdout);
    let mut child = command.spawn().unwrap();
    let mut log = tokio::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("serving gRPC") {
        line.clear();
        soon("the log", tokio::io::AsyncBufReadExt::read_line(&mut log, &mut line)).await.unwrap();
    }
    let pid = child.id().unwrap().to_string();
    std::process::Command::new("kill").args(["-TERM", &pid]).status().unwrap();
    assert_eq!(soon("the end of the daemon", child.wait()).await.unwrap().code(), Some(0));
}

#[tokio::test]
async fn a_mistake_that_is_not_read_causes_no_delay() {
    let (stderr, _reader) = full_pipe().await;
    let mut command = Home::new().command(simd_tests::process::binaries().join("simd"));
    command.arg("--lisen").stderr(stderr);
    let status = soon("the end of the daemon", async { command.status().await.unwrap() }).await;
    assert_eq!(status.code(), Some(2));
}

#[tokio::test]
async fn simctl_says_that_its_answer_could_not_be_written() {
    let daemon = crate::paused().await;
    let said = daemon.shell("simctl robot list > /dev/full", Home::new().path()).await;
    assert_eq!(said.code, 1);
    assert!(said.err.starts_with("simctl: ") && said.err.contains("No space left"), "{}", said.err);
    for closed in ["2>&-", "2>/dev/full"] {
        let said = daemon.shell(&format!("simctl joint get missing {closed}"), Home::new().path()).await;
        assert_eq!((said.code, said.out.as_str()), (69, ""));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_log_for_programs_has_an_object_on_each_line() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("log");
    let arguments = ["--log-format", "json", "--log", "debug"];
    let stderr = Stdio::from(File::create(&path).unwrap());
    let mut daemon = Process::start_logging_to(stderr, ["--zenoh", "tcp/127.0.0.1:0"], arguments).await;
    let client = daemon.client().await;
    client.load(assets().join("Bench_Arm-1.2 rev B"), fixed("arm")).await.unwrap();
    daemon.signal("TERM").await;
    assert_eq!(daemon.ended().await.0.code(), Some(0));
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.lines().count() > 3, "{text}");
    let mut messages = Vec::new();
    for line in text.lines() {
        let read: serde_json::Value =
            serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
        let has = |name: &str| read.get(name).is_some();
        assert!(has("timestamp") && has("level") && has("target"), "{line}");
        messages.push(read["fields"]["message"].as_str().unwrap_or_default().to_owned());
    }
    assert!(messages.iter().any(|message| message.starts_with("spawned ")), "{messages:?}");
}

/// Returns a line as the journal reads it: its priority and the remaining text.
fn priority(line: &str) -> Option<(u8, &str)> {
    let (priority, rest) = line.strip_prefix('<')?.split_once('>')?;
    Some((priority.parse().ok()?, rest))
}

/// If the stderr of a service is the journal's stream, its environment has the device and the inode of that
/// stream. A program that such a service starts with another stderr has them too.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_log_in_the_journal_has_the_priority_of_each_line_and_one_elsewhere_has_none() {
    let folder = tempfile::TempDir::new().unwrap();
    for (format, is_journal) in [("text", true), ("json", true), ("text", false)] {
        let path = folder.path().join("log");
        let file = File::create(&path).unwrap();
        let of = file.metadata().unwrap();
        let stream = format!("{}:{}", of.dev(), if is_journal { of.ino() } else { of.ino() + 1 });
        let environment = [("JOURNAL_STREAM", OsStr::new(&stream))];
        let arguments = ["--log-format", format, "--log", "debug"];
        let zenoh = ["--zenoh", "tcp/127.0.0.1:0"];
        let mut daemon = Process::start_as(&environment, Stdio::from(file), zenoh, arguments).await;
        let client = daemon.client().await;
        client.load(assets().join("Bench_Arm-1.2 rev B"), fixed("arm")).await.unwrap();
        daemon.signal("TERM").await;
        assert_eq!(daemon.ended().await.0.code(), Some(0));
        let text = std::fs::read_to_string(&path).unwrap();
        let mut seen = BTreeSet::new();
        for line in text.lines() {
            let Some((priority, rest)) = priority(line) else {
                assert!(!is_journal, "{line}");
                continue;
            };
            seen.insert(priority);
            if format == "json" {
                let read: serde_json::Value = serde_json::from_str(rest).unwrap();
                let expected = match read["level"].as_str().unwrap() {
                    "ERROR" => 3,
                    "WARN" => 4,
                    "INFO" => 6,
                    _ => 7,
                };
                assert_eq!(priority, expected, "{line}");
            }
        }
        assert!(text.lines().count() > 3, "{text}");
        assert_eq!(seen.contains(&6), is_journal, "{text}");
        assert!(seen.is_subset(&BTreeSet::from([3, 4, 6, 7])), "{text}");
    }
}

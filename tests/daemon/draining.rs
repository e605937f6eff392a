//! SIGTERM and SIGINT end the daemon cleanly, also with clients connected.

use std::time::Instant;

use simd_client::{ControlOptions, Error};
use simd_tests::process::{Process, said, soon};
use tokio::io::{AsyncBufReadExt as _, AsyncWriteExt as _, BufReader};
use tokio::net::TcpStream;

use crate::{demo, paused};

/// Waits for the daemon to end, with 0 and without a further signal.
async fn ends_well(daemon: &mut Process, signalled: Instant) {
    let (status, log) = daemon.ended().await;
    println!("draining took {:?}", signalled.elapsed());
    assert_eq!(status.code(), Some(0), "{log}");
    assert!(log.trim_end().ends_with("drained"), "{log}");
}

async fn drains(mut daemon: Process, signal: &str) {
    let client = daemon.client().await;
    // A stream that has an answer under way, one that was answered, one that waits for events.
    let mut waiting = client.control(ControlOptions::default()).await.unwrap();
    waiting.next().await.unwrap();
    waiting.send_all(Vec::new()).unwrap();
    let mut idle = client.control(ControlOptions::default()).await.unwrap();
    idle.next().await.unwrap();
    let mut events = client.watch_events(0).await.unwrap();
    let mut states = client.watch(Vec::new(), 0.0).await.unwrap();
    states.next().await.unwrap().unwrap();
    // And one of simctl's, which has shown something.
    let mut watcher = daemon.simctl_command(["joint", "watch", "bench_arm"]).spawn().unwrap();
    let mut shown = BufReader::new(watcher.stdout.take().unwrap()).lines();
    let first = soon("a line of the watch", shown.next_line()).await.unwrap().unwrap();
    assert!(first.contains("shoulder="), "{first}");

    let signalled = Instant::now();
    daemon.signal(signal).await;
    // Each stream ends with OK: anything else would be an error.
    let ended = async {
        while states.next().await.unwrap().is_some() {}
        while events.next().await.unwrap().is_some() {}
        loop {
            match waiting.next().await {
                Ok(_) => {}
                Err(Error::StreamEnded { .. }) => break,
                Err(other) => panic!("{other:?}"),
            }
        }
        assert!(matches!(idle.next().await, Err(Error::StreamEnded { .. })));
    };
    soon("the end of the streams", ended).await;
    ends_well(&mut daemon, signalled).await;

    while soon("the end of the watch", shown.next_line()).await.unwrap().is_some() {}
    let watcher = soon("the end of simctl", watcher.wait_with_output()).await.unwrap();
    assert_eq!(watcher.status.code(), Some(78), "a watch that was to go on says that it ended");
    let sentence = String::from_utf8(watcher.stderr).unwrap();
    assert_eq!(sentence, format!("simctl: the daemon at {} ended the stream\n", daemon.endpoint));
}

#[tokio::test]
async fn sigterm_ends_the_streams_of_a_playing_world_with_ok() {
    drains(demo().await, "TERM").await;
}

#[tokio::test]
async fn sigint_ends_the_streams_of_a_paused_world_with_ok() {
    drains(paused().await, "INT").await;
}

#[tokio::test]
async fn a_call_that_would_take_hours_does_not_hold_up_the_end() {
    let mut daemon = paused().await;
    let call = tokio::spawn(said("a long call", daemon.simctl_command(["sim", "step", "100000000"])));
    let client = daemon.client().await;
    while client.world_statistics().await.unwrap().iterations == 0 {}
    let signalled = Instant::now();
    daemon.signal("TERM").await;
    ends_well(&mut daemon, signalled).await;
    let said = call.await.unwrap();
    assert_eq!((said.code, said.err.as_str()), (78, "simctl: the daemon is shutting down\n"));
}

/// A script that is killed leaves no daemon behind that it started for itself.
#[tokio::test]
async fn the_end_of_stdin_ends_it_where_that_was_asked_for() {
    let mut daemon = Process::start(["--paused", "--until-stdin-closes"]).await;
    let mut other = paused().await;
    daemon.client().await.world_statistics().await.unwrap();
    let closed = Instant::now();
    other.close_stdin();
    daemon.close_stdin();
    ends_well(&mut daemon, closed).await;
    other.client().await.world_statistics().await.unwrap();
}

/// Returns a connection that begins HTTP/2 and then does not answer, as if its machine hangs: the daemon
/// gives it the whole grace period. Once a later client is served, it was accepted.
async fn mute(daemon: &Process) -> TcpStream {
    let mut stream = TcpStream::connect(daemon.address()).await.unwrap();
    stream.write_all(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0").await.unwrap();
    daemon.client().await.world_statistics().await.unwrap();
    stream
}

#[tokio::test]
async fn a_client_that_answers_nothing_does_not_hold_up_the_end() {
    let mut daemon = paused().await;
    let _mute = mute(&daemon).await;
    let signalled = Instant::now();
    daemon.signal("TERM").await;
    ends_well(&mut daemon, signalled).await;
}

#[tokio::test]
async fn a_second_signal_ends_it_at_once_and_says_so() {
    let mut daemon = paused().await;
    let _mute = mute(&daemon).await;
    daemon.signal("TERM").await;
    daemon.logged("draining").await;
    daemon.signal("TERM").await;
    let (status, log) = daemon.ended().await;
    assert_eq!(status.code(), Some(1), "{log}");
    assert_eq!(log.lines().last(), Some("simd: cut off by a second signal"));
}

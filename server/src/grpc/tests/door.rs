//! Health checks get an answer, whatever other clients request.

use std::sync::mpsc;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio_util::task::TaskTracker;

use super::*;

/// Returns the answer on a separate connection, until it is closed.
async fn get(address: SocketAddr, path: &str) -> String {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes()).await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    answer
}

#[tokio::test]
async fn health_is_answered_while_each_thread_for_connections_is_busy() {
    let threads = FrontEndThreads::start().unwrap();
    let (tracker, mut releases) = (TaskTracker::new(), Vec::new());
    for _ in 0..threads.count() {
        let (release, released) = mpsc::channel::<()>();
        let (busy, is_busy) = tokio::sync::oneshot::channel();
        threads.serve(&tracker, async move {
            busy.send(()).unwrap();
            // The whole thread waits.
            released.recv().unwrap();
        });
        is_busy.await.unwrap();
        releases.push(release);
    }
    let daemon = Daemon::start_on(threads, RunState::Paused, config::Connections::default()).await;
    for path in ["/healthz", "/readyz", "/metrics"] {
        let answer = get(daemon.address, path).await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{path}: {answer}");
        assert!(answer.to_ascii_lowercase().contains("connection: close"), "{path}: {answer}");
    }
    assert!(tracker.len() == releases.len(), "they are all busy still");
    for release in releases {
        release.send(()).unwrap();
    }
    daemon.simulation().get_simulation_state(v1::GetSimulationStateRequest {}).await.unwrap();
}

#[tokio::test]
async fn a_connection_that_begins_with_another_request_is_served_as_before() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut stream = TcpStream::connect(daemon.address).await.unwrap();
    for path in ["/robots", "/healthz"] {
        let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).await.unwrap();
        assert_eq!(&answer, b"HTTP/1.1 200", "{path}");
        // The rest of the answer: both are short.
        let mut rest = [0; 4096];
        assert!(stream.read(&mut rest).await.unwrap() > 0);
    }
}

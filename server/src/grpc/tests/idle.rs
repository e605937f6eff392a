//! Connections without a call, requests that do not arrive, and unread answers.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use bytes::Bytes;
use http_body::{Body, Frame};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::time::{Instant, timeout};
use tonic::codegen::{Service as _, http};

use super::incoming::closed;
use super::*;
use crate::config::Connections as DaemonLimits;

const HOUR: Duration = Duration::from_secs(3600);

/// Type, flags and payload length of a frame.
type FrameHead = (u8, u8, usize);
const PING: u8 = 6;
const GOAWAY: u8 = 7;

/// Makes an HTTP/2 connection that only answers pings, and returns the pings and the frames.
async fn answers_pings(address: SocketAddr) -> (usize, Vec<FrameHead>) {
    let mut stream = TcpStream::connect(address).await.unwrap();
    // The preface and empty settings.
    stream.write_all(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0").await.unwrap();
    let (mut pings, mut frames) = (0, Vec::new());
    let mut head = [0; 9];
    while stream.read_exact(&mut head).await.is_ok() {
        let length = usize::from(head[0]) << 16 | usize::from(head[1]) << 8 | usize::from(head[2]);
        let mut payload = vec![0; length];
        stream.read_exact(&mut payload).await.unwrap();
        frames.push((head[3], head[4], length));
        if head[3] == PING && head[4] == 0 {
            pings += 1;
            stream.write_all(&[&[0, 0, 8, PING, 1, 0, 0, 0, 0], &*payload].concat()).await.unwrap();
        }
    }
    (pings, frames)
}

#[tokio::test]
async fn a_client_that_only_answers_pings_is_closed_with_a_goaway() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut events = daemon.events().watch_events(v1::WatchEventsRequest::default()).await.unwrap();
    tokio::time::pause();
    let start = Instant::now();
    let (pings, frames) = timeout(HOUR, answers_pings(daemon.address)).await.unwrap();
    assert!(start.elapsed() >= DaemonLimits::default().idle, "{:?}", start.elapsed());
    assert!(pings > 5, "{pings}");
    assert!(frames.iter().any(|(kind, ..)| *kind == GOAWAY), "{frames:?}");
    // An idle stream counts as a call.
    assert_eq!(daemon.connections.count(), 1);
    tokio::time::resume();
    daemon.simulation().reset_simulation(v1::ResetSimulationRequest::default()).await.unwrap();
    events.get_mut().message().await.unwrap().unwrap();
}

#[tokio::test]
async fn an_idle_client_continues_after_its_connection_was_closed() {
    let daemon = Daemon::start(RunState::Paused).await;
    daemon.simulation().get_physics(v1::GetPhysicsRequest {}).await.unwrap();
    tokio::time::pause();
    // It was opened later, and so it is closed later.
    timeout(HOUR, answers_pings(daemon.address)).await.unwrap();
    assert_eq!(daemon.connections.count(), 0);
    tokio::time::resume();
    for _ in 0..3 {
        daemon.simulation().get_physics(v1::GetPhysicsRequest {}).await.unwrap();
    }
    assert_eq!(daemon.connections.count(), 1);
}

/// The beginning of a message, without the rest.
struct Stuck(bool);

impl Body for Stuck {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        if std::mem::replace(&mut self.0, true) {
            return Poll::Pending;
        }
        Poll::Ready(Some(Ok(Frame::data(Bytes::from_static(&[0, 0, 0, 1])))))
    }
}

#[tokio::test]
async fn a_request_that_does_not_arrive_is_refused_with_a_reason() {
    let daemon = Daemon::start(RunState::Paused).await;
    tokio::time::pause();
    let start = Instant::now();
    let request =
        http::Request::post(format!("http://{}/simd.v1.SimulationService/GetPhysics", daemon.address))
            .header("content-type", "application/grpc")
            .body(tonic::body::Body::new(Stuck(false)));
    let mut channel = daemon.channel.clone();
    std::future::poll_fn(|context| channel.poll_ready(context)).await.unwrap();
    let response = timeout(HOUR, channel.call(request.unwrap())).await.unwrap().unwrap();
    let status = Status::from_header_map(response.headers()).unwrap();
    assert_eq!(reason(&status), "LIMIT_EXCEEDED", "{status:?}");
    assert!(status.message().contains("within 30 s"), "{status:?}");
    assert!(start.elapsed() >= DaemonLimits::default().body, "{:?}", start.elapsed());
    // The connection still serves other calls.
    daemon.simulation().get_physics(v1::GetPhysicsRequest {}).await.unwrap();
}

/// Each byte earns time: a large body may take long, but a trickling one may not.
#[tokio::test]
async fn a_slow_body_of_http_1_ends_its_connection() {
    let daemon = Daemon::start_with(
        RunState::Paused,
        DaemonLimits { body_bytes_per_second: 10, ..DaemonLimits::default() },
    )
    .await;
    let start = Instant::now();
    let mut browser = TcpStream::connect(daemon.address).await.unwrap();
    let head = "POST /simd.v1.SimulationService/GetPhysics HTTP/1.1\r\nHost: localhost\r\n\
                Content-Type: application/grpc-web+proto\r\nContent-Length: 10000\r\n\r\n";
    browser.write_all(head.as_bytes()).await.unwrap();
    tokio::time::pause();
    // For 50 bytes: 30 s and 5 s.
    for _ in 0..50 {
        browser.write_all(&[0]).await.unwrap();
    }
    let mut answer = [0; 12];
    timeout(HOUR, browser.read_exact(&mut answer)).await.unwrap().unwrap();
    assert_eq!(&answer, b"HTTP/1.1 200");
    let waited = start.elapsed();
    assert!((35..40).contains(&waited.as_secs()), "{waited:?}");
    timeout(HOUR, closed(&browser)).await.unwrap();
}

/// A controller may be silent for long, but not forever.
#[tokio::test]
async fn a_stream_of_requests_has_a_separate_limit_from_slow_bodies() {
    let limits = DaemonLimits { stream_silence: Duration::from_secs(1000), ..DaemonLimits::default() };
    let daemon = Daemon::start_with(RunState::Paused, limits).await;
    let (requests, receiver) = tokio::sync::mpsc::channel(1);
    let receiver = tokio_stream::wrappers::ReceiverStream::new(receiver);
    let mut control = daemon.joints().control(receiver).await.unwrap().into_inner();
    let start = Instant::now();
    requests.send(v1::ControlRequest::default()).await.unwrap();
    control.message().await.unwrap().unwrap();
    tokio::time::pause();
    let ended = timeout(HOUR, control.message()).await.unwrap().unwrap_err();
    assert_eq!(reason(&ended), "LIMIT_EXCEEDED", "{ended:?}");
    assert!(start.elapsed() >= limits.stream_silence, "{:?}", start.elapsed());
}

#[tokio::test]
async fn a_client_that_reads_no_answer_is_idle_and_one_that_waits_for_it_is_not() {
    let daemon = Daemon::start(RunState::Playing).await;
    // The highest rate: unread states fill a small HTTP/2 window.
    let request = v1::WatchJointStatesRequest { rate: 1000.0, ..Default::default() };
    let endpoint = Endpoint::from_shared(format!("http://{}", daemon.address)).unwrap();
    let channel = endpoint.initial_stream_window_size(4096).connect().await.unwrap();
    let unread = JointServiceClient::new(channel).watch_joint_states(request).await.unwrap();
    daemon.simulation().get_physics(v1::GetPhysicsRequest {}).await.unwrap();
    let mut read =
        daemon.events().watch_events(v1::WatchEventsRequest::default()).await.unwrap().into_inner();
    let full = async {
        while daemon.connections.idle().is_empty() {
            tokio::task::yield_now().await;
        }
    };
    timeout(Duration::from_secs(60), full).await.unwrap();
    tokio::time::pause();
    let gone = async {
        while daemon.connections.count() > 1 {
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
    };
    timeout(HOUR, gone).await.unwrap();
    tokio::time::resume();
    daemon.simulation().reset_simulation(v1::ResetSimulationRequest::default()).await.unwrap();
    read.message().await.unwrap().unwrap();
    drop(unread);
}

/// They are closed before either side sends.
#[tokio::test]
async fn connections_that_close_at_once_leave_nothing_behind() {
    let daemon = Daemon::start(RunState::Paused).await;
    for _ in 0..20 {
        for _ in 0..100 {
            drop(TcpStream::connect(daemon.address).await.unwrap());
        }
        daemon.simulation().get_physics(v1::GetPhysicsRequest {}).await.unwrap();
    }
    let gone = async {
        while daemon.connections.count() > 1 {
            tokio::task::yield_now().await;
        }
    };
    timeout(Duration::from_secs(60), gone).await.unwrap();
}

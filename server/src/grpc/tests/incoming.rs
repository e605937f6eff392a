//! Which connections are served, and for how long.

use std::future::poll_fn;
use std::io;
use std::pin::{Pin, pin};
use std::time::Duration;

use futures_util::FutureExt as _;
use tokio::io::{AsyncRead, AsyncWrite, DuplexStream, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, timeout};
use tokio_stream::StreamExt as _;

use super::super::incoming::{Connection, ConnectionLimits, incoming};
use super::*;

const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
const LIMITS: ConnectionLimits = ConnectionLimits {
    connections: 2,
    preface: Duration::from_secs(5),
    http1: 1,
    http1_silence: Duration::from_secs(600),
};

/// A client's end of a connection, and the daemon's.
async fn connection() -> (DuplexStream, Connection<DuplexStream>) {
    let (client, server) = tokio::io::duplex(64);
    let mut incoming = pin!(incoming(tokio_stream::once(Ok(server)), LIMITS));
    let Ok(connection) = incoming.next().await.unwrap();
    (client, connection)
}

async fn send(client: &mut DuplexStream, bytes: &[u8]) {
    let sent = poll_fn(|context| Pin::new(&mut *client).poll_write(context, bytes)).await.unwrap();
    assert_eq!(sent, bytes.len());
}

/// How many bytes came.
async fn receive(connection: &mut Connection<DuplexStream>) -> io::Result<usize> {
    let mut bytes = [0; 64];
    let mut buffer = ReadBuf::new(&mut bytes);
    poll_fn(|context| Pin::new(&mut *connection).poll_read(context, &mut buffer)).await?;
    Ok(buffer.filled().len())
}

#[tokio::test(start_paused = true)]
async fn an_error_of_accepting_is_a_pause_and_nothing_else() {
    let full = || Err(io::Error::other("too many open files"));
    let source = tokio_stream::iter([full(), full(), Ok(tokio::io::duplex(1).0)]);
    let mut incoming = pin!(incoming(source, LIMITS));
    let start = Instant::now();
    let Ok(_connection) = incoming.next().await.unwrap();
    assert!(start.elapsed() >= Duration::from_millis(100), "{:?}", start.elapsed());
}

#[tokio::test]
async fn a_connection_beyond_the_limit_waits_until_another_one_is_dropped() {
    let source = tokio_stream::iter([(); 3]).map(|()| Ok(tokio::io::duplex(1).0));
    let mut incoming = pin!(incoming(source, LIMITS));
    let first = incoming.next().await.unwrap();
    let _second = incoming.next().await.unwrap();
    assert!(incoming.next().now_or_never().is_none());
    drop(first);
    assert!(incoming.next().now_or_never().flatten().is_some());
}

#[tokio::test(start_paused = true)]
async fn a_connection_without_a_whole_preface_times_out() {
    for begun in [0, 1, PREFACE.len() - 1] {
        let (mut client, mut connection) = connection().await;
        let start = Instant::now();
        if begun > 0 {
            send(&mut client, &PREFACE[..begun]).await;
            assert_eq!(receive(&mut connection).await.unwrap(), begun);
        }
        assert_eq!(receive(&mut connection).await.unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!(start.elapsed() >= LIMITS.preface, "{:?}", start.elapsed());
    }
}

#[tokio::test(start_paused = true)]
async fn a_connection_that_began_may_be_silent() {
    let (mut client, mut connection) = connection().await;
    send(&mut client, PREFACE).await;
    assert_eq!(receive(&mut connection).await.unwrap(), PREFACE.len());
    timeout(Duration::from_secs(3600), receive(&mut connection)).await.unwrap_err();
    send(&mut client, b"again").await;
    assert_eq!(receive(&mut connection).await.unwrap(), 5);
}

/// Whatever is no preface is HTTP/1.1, be it only at its last byte.
#[tokio::test(start_paused = true)]
async fn a_connection_of_http_1_ends_where_nothing_goes_over_it_for_long() {
    for begin in [b"GET / HTTP/1.1\r\n".as_slice(), b"P", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\r"] {
        let (mut client, mut connection) = connection().await;
        send(&mut client, begin).await;
        assert_eq!(receive(&mut connection).await.unwrap(), begin.len());
        if begin == b"P" {
            send(&mut client, b"OST").await;
            receive(&mut connection).await.unwrap();
        }
        let start = Instant::now();
        tokio::time::advance(LIMITS.http1_silence / 2).await;
        // What is written is no silence.
        poll_fn(|context| Pin::new(&mut connection).poll_write(context, b"x")).await.unwrap();
        assert_eq!(receive(&mut connection).await.unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!(start.elapsed() >= LIMITS.http1_silence * 3 / 2, "{:?}", start.elapsed());
    }
}

#[tokio::test(start_paused = true)]
async fn browsers_leave_room_for_programs() {
    let pipes = [(); 2].map(|()| tokio::io::duplex(64));
    let (mut clients, servers): (Vec<_>, Vec<_>) = pipes.into_iter().unzip();
    let mut incoming = pin!(incoming(tokio_stream::iter(servers.into_iter().map(Ok)), LIMITS));
    let Ok(mut first) = incoming.next().await.unwrap();
    let Ok(mut second) = incoming.next().await.unwrap();
    for client in &mut clients {
        send(client, b"GET /").await;
    }
    receive(&mut first).await.unwrap();
    let refused = receive(&mut second).await.unwrap_err().to_string();
    assert!(refused.contains("too many"), "{refused}");
}

/// A browser keeps its connection; hyper ends it.
#[tokio::test]
async fn the_daemon_closes_a_connection_of_http_1_that_is_kept_for_nothing() {
    let daemon = Daemon::start(RunState::Paused).await;
    let browser = TcpStream::connect(daemon.address).await.unwrap();
    browser.writable().await.unwrap();
    browser.try_write(b"GET /robots HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    browser.readable().await.unwrap();
    let mut answer = [0; 12];
    browser.try_read(&mut answer).unwrap();
    assert_eq!(&answer, b"HTTP/1.1 200");
    let mut program = daemon.simulation();
    program.get_physics(v1::GetPhysicsRequest {}).await.unwrap();
    tokio::time::pause();
    timeout(Duration::from_secs(120), closed(&browser)).await.unwrap();
    program.get_physics(v1::GetPhysicsRequest {}).await.unwrap();
}

#[tokio::test]
async fn the_daemon_closes_a_silent_connection_and_serves_on() {
    let daemon = Daemon::start(RunState::Paused).await;
    let silent = TcpStream::connect(daemon.address).await.unwrap();
    // The daemon has accepted it, since it has accepted the next one and answered it.
    let channel = Endpoint::from_shared(format!("http://{}", daemon.address)).unwrap();
    let mut later = SimulationServiceClient::new(channel.connect().await.unwrap());
    later.get_physics(v1::GetPhysicsRequest {}).await.unwrap();
    tokio::time::pause();
    timeout(Duration::from_secs(60), closed(&silent)).await.unwrap();
    later.get_physics(v1::GetPhysicsRequest {}).await.unwrap();
}

/// Ends when the other side has closed the connection.
async fn closed(stream: &TcpStream) {
    loop {
        stream.readable().await.unwrap();
        match stream.try_read(&mut [0; 64]) {
            Ok(0) => return,
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(_) => return,
        }
    }
}

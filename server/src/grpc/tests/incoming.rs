//! Arriving connections, and how long they may be silent.

use std::future::poll_fn;
use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::pin::Pin;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, DuplexStream, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, timeout};
use tokio_util::sync::CancellationToken;
use tonic::transport::server::Connected as _;

use super::super::activity::Call;
use super::super::incoming::{Connection, accept};
use super::*;
use crate::config::Connections as ConnectionLimits;

const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

fn limits() -> ConnectionLimits {
    ConnectionLimits {
        max: 2,
        max_per_peer: 2,
        loopback_reserve: 0,
        max_http1: 1,
        ..ConnectionLimits::default()
    }
}

/// Returns the results of connections from the loopback address that arrive in this order.
async fn accepted(
    source: impl IntoIterator<Item = io::Result<DuplexStream>>,
) -> Vec<Connection<DuplexStream>> {
    let source = source.into_iter().map(|io| io.map(|io| (io, IpAddr::from(Ipv4Addr::LOCALHOST))));
    let connections = Connections::new(limits(), std::sync::Arc::default());
    let mut served = Vec::new();
    let source = tokio_stream::iter(source.collect::<Vec<_>>());
    let serve = |io, slot, address| served.push(Connection::new(io, slot, address));
    accept(source, &connections, &CancellationToken::new(), serve).await;
    served
}

/// Returns a client's end of a connection, and the daemon's.
async fn connection() -> (DuplexStream, Connection<DuplexStream>) {
    let (client, server) = tokio::io::duplex(64);
    (client, accepted([Ok(server)]).await.remove(0))
}

async fn send(client: &mut DuplexStream, bytes: &[u8]) {
    let sent = poll_fn(|context| Pin::new(&mut *client).poll_write(context, bytes)).await.unwrap();
    assert_eq!(sent, bytes.len());
}

/// Returns the number of received bytes.
async fn receive(connection: &mut Connection<DuplexStream>) -> io::Result<usize> {
    let mut bytes = [0; 64];
    let mut buffer = ReadBuf::new(&mut bytes);
    poll_fn(|context| Pin::new(&mut *connection).poll_read(context, &mut buffer)).await?;
    Ok(buffer.filled().len())
}

#[tokio::test(start_paused = true)]
async fn an_error_of_accepting_is_a_pause_and_nothing_else() {
    let full = || Err(io::Error::other("too many open files"));
    let start = Instant::now();
    assert_eq!(accepted([full(), full(), Ok(tokio::io::duplex(1).0)]).await.len(), 1);
    assert!(start.elapsed() >= Duration::from_millis(100), "{:?}", start.elapsed());
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
        assert!(start.elapsed() >= limits().begin, "{:?}", start.elapsed());
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

/// A connection without the preface is HTTP/1.1, even if it differs only in its last byte.
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
        tokio::time::advance(limits().http1_silence / 2).await;
        // A write is traffic too.
        poll_fn(|context| Pin::new(&mut connection).poll_write(context, b"x")).await.unwrap();
        assert_eq!(receive(&mut connection).await.unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!(start.elapsed() >= limits().http1_silence * 3 / 2, "{:?}", start.elapsed());
    }
}

#[tokio::test(start_paused = true)]
async fn browsers_leave_room_for_programs() {
    let pipes = [(); 2].map(|()| tokio::io::duplex(64));
    let (mut clients, servers): (Vec<_>, Vec<_>) = pipes.into_iter().unzip();
    let mut served = accepted(servers.into_iter().map(Ok)).await;
    let (mut second, mut first) = (served.remove(1), served.remove(0));
    // The first has a call at work.
    let _call = Call::begin(&first.connect_info().activity);
    for client in &mut clients {
        send(client, b"GET /").await;
    }
    receive(&mut first).await.unwrap();
    let refused = receive(&mut second).await.unwrap_err().to_string();
    assert!(refused.contains("all connections are in use"), "{refused}");
}

/// A client whose connection is cut gets an error, on reads and on writes.
#[tokio::test]
async fn a_connection_that_is_cut_fails_also_where_its_client_does_not_read() {
    let (_client, mut connection) = connection().await;
    let mut writes = 0;
    let mut write = poll_fn(|context| {
        loop {
            match Pin::new(&mut connection).poll_write(context, &[0; 64]) {
                std::task::Poll::Ready(Ok(_)) => writes += 1,
                std::task::Poll::Ready(Err(error)) => return std::task::Poll::Ready(error),
                std::task::Poll::Pending => {
                    connection.ended().cancel();
                    return std::task::Poll::Pending;
                }
            }
        }
    });
    assert_eq!((&mut write).await.kind(), io::ErrorKind::ConnectionAborted);
    assert_eq!(writes, 1);
    assert_eq!(receive(&mut connection).await.unwrap_err().kind(), io::ErrorKind::ConnectionAborted);
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

/// Waits until the other side has closed the connection.
pub(super) async fn closed(stream: &TcpStream) {
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

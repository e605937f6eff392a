//! Connections that others hold, and those left for the rest.
//!
//! On Linux all of 127.0.0.0/8 is this machine: here, 127.0.0.2 and so on represent other machines.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::time::Duration;

use simd_client::{Client, proto};
use simd_proto::v1::event_service_client::EventServiceClient;
use simd_server::config::Connections;
use simd_tests::daemon::{Daemon, Via};
use simd_tests::http;
use simd_tests::process::soon;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tonic::Streaming;
use tonic::transport::{Channel, Endpoint};

/// First bytes of an HTTP/2 client: the preface and empty settings.
const OPENING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
/// Head of a request over gRPC-Web, and the first byte of its body.
const SLOW: &[u8] = b"POST /simd.v1.SimulationService/GetPhysics HTTP/1.1\r\nHost: localhost\r\n\
                      Content-Type: application/grpc-web+proto\r\nContent-Length: 10000\r\n\r\n\0";

async fn daemon(connections: Connections) -> Daemon {
    Daemon::start_via(Via::Grpc, |config| config.connections = connections).await
}

/// A stream over a separate connection from 127.0.0.`last`; it is never idle.
struct Held {
    _events: Streaming<proto::WatchEventsResponse>,
    _channel: Channel,
}

async fn hold(address: SocketAddr, last: u8) -> Result<Held, Box<dyn std::error::Error>> {
    let from = IpAddr::from(Ipv4Addr::new(127, 0, 0, last));
    let endpoint = Endpoint::from_shared(format!("http://{address}"))?.local_address(Some(from));
    let channel = endpoint.connect().await?;
    let mut events = EventServiceClient::new(channel.clone());
    let events = events.watch_events(proto::WatchEventsRequest::default()).await?.into_inner();
    Ok(Held { _events: events, _channel: channel })
}

/// Opens this many connections that send these bytes and nothing more.
async fn open(address: SocketAddr, count: usize, bytes: &[u8]) -> Vec<TcpStream> {
    let mut streams = Vec::new();
    for _ in 0..count {
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(bytes).await.unwrap();
        streams.push(stream);
    }
    streams
}

/// Waits until the daemon has closed all of them.
async fn closed(streams: Vec<TcpStream>) {
    for mut stream in streams {
        // One that is cut may end with an error, which is an end as well.
        let _ = soon("the end of a connection", stream.read_to_end(&mut Vec::new())).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn connections_from_elsewhere_leave_room_for_the_loopback_address() {
    let limits = Connections { max: 240, max_per_peer: 50, loopback_reserve: 40, ..Default::default() };
    let daemon = daemon(limits).await;
    let mut held = Vec::new();
    for i in 0..200 {
        held.push(hold(daemon.address, 2 + i / 50).await.unwrap());
    }
    // All places outside the reserve are in use, even for 127.0.0.6, which has no connection yet.
    for last in [2, 5, 6] {
        assert!(hold(daemon.address, last).await.is_err(), "127.0.0.{last}");
    }
    // The daemon's own client is one of the loopback address's.
    for _ in 1..40 {
        held.push(hold(daemon.address, 1).await.unwrap());
    }
    daemon.client.physics().await.unwrap();
    // A closed connection makes room for another.
    held.remove(0);
    soon("a place", async { while hold(daemon.address, 6).await.is_err() {} }).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_address_has_its_share_and_no_more() {
    let daemon = daemon(Connections { max_per_peer: 100, ..Default::default() }).await;
    let mut held = Vec::new();
    for _ in 0..100 {
        held.push(hold(daemon.address, 2).await.unwrap());
    }
    assert!(hold(daemon.address, 2).await.is_err());
    let _other = hold(daemon.address, 3).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn more_idle_connections_than_there_are_slots_lock_no_client_out() {
    let daemon =
        daemon(Connections { max: 200, max_per_peer: 200, loopback_reserve: 0, ..Default::default() }).await;
    let _idle = open(daemon.address, 250, OPENING).await;
    let client = Client::connect(&daemon.address.to_string()).await.unwrap();
    client.physics().await.unwrap();
    assert_eq!(http::get(daemon.address, "/robots", &[]).await.status, 200);
    // This older connection is closed after those that never called.
    daemon.client.physics().await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn as_many_slow_bodies_as_browsers_may_have_connections_lock_no_browser_out() {
    let daemon = daemon(Connections::default()).await;
    let _slow = open(daemon.address, Connections::default().max_http1, SLOW).await;
    for _ in 0..10 {
        assert_eq!(http::get(daemon.address, "/robots", &[]).await.status, 200);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn connections_that_are_silent_idle_or_slow_are_closed_and_clients_continue() {
    let short = Duration::from_millis(100);
    let limits = Connections { begin: short, idle: short, body: short, ..Default::default() };
    let daemon = daemon(limits).await;
    let (idle, address) = (Client::connect(&daemon.address.to_string()).await.unwrap(), daemon.address);
    idle.physics().await.unwrap();
    let events = hold(address, 2).await.unwrap();
    closed(open(address, 100, b"").await).await;
    closed(open(address, 100, OPENING).await).await;
    closed(open(address, 100, SLOW).await).await;
    // Its connection was idle for longer than theirs.
    idle.physics().await.unwrap();
    let mut events = events._events;
    daemon.client.reset(Default::default()).await.unwrap();
    soon("an event", events.message()).await.unwrap().unwrap();
}

/// Silent connections from this machine or another: Zenoh does not say.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn silent_connections_keep_no_client_from_zenoh() {
    // A shorter time than the daemon's own, for more than may be about to begin a session.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("zenoh.json5");
    std::fs::write(&file, "{ transport: { unicast: { accept_timeout: 500 } } }").unwrap();
    let daemon = Daemon::start_via(Via::Zenoh, |config| config.zenoh.file = Some(file)).await;
    let locator = daemon.running.locators()[0].clone();
    let address: SocketAddr = locator.trim_start_matches("tcp/").parse().unwrap();
    let _silent = open(address, 110, b"").await;
    let client = Client::connect(&locator).await.unwrap();
    client.physics().await.unwrap();
    let more = open(address, 200, b"").await;
    let client = soon("a session", async {
        loop {
            if let Ok(client) = Client::connect(&locator).await {
                break client;
            }
        }
    });
    client.await.physics().await.unwrap();
    closed(more).await;
}

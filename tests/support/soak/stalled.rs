//! Readers that stopped: they hold connections and streams, and read nothing.

use std::time::{Duration, Instant};

use simd_client::Client;
use tokio::io::AsyncWriteExt as _;
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use zenoh::handlers::FifoChannel;

use super::Stage;
use crate::network;
use crate::process::{Home, binaries};

/// How long one is stopped before it is killed and another comes.
const PERIOD: Duration = Duration::from_secs(60);
const TURN: Duration = Duration::from_millis(100);

pub(super) fn start(stage: &Stage, actors: &mut JoinSet<()>) {
    for locator in [false, true] {
        let stage = stage.clone();
        actors.spawn(async move { stopped_processes(&stage, locator).await });
    }
    let stage = stage.clone();
    actors.spawn(async move { stalled_streams(&stage).await });
}

async fn held(stage: &Stage) {
    let begun = Instant::now();
    while stage.is_on() && begun.elapsed() < PERIOD {
        tokio::time::sleep(TURN).await;
    }
}

/// `simctl joint watch`, whose process is stopped amid it.
async fn stopped_processes(stage: &Stage, over_zenoh: bool) {
    let endpoint = if over_zenoh { &stage.locator } else { &stage.endpoint };
    while stage.is_on() {
        let mut command = Home::new().command(binaries().join("simctl"));
        command.args(["joint", "watch", "writer_0", "-e", endpoint, "--rate", "200"]);
        let Ok(mut child) = command.spawn() else {
            return stage.tally.fail("simctl does not start".to_owned());
        };
        // Until it has shown something.
        if let Some(stdout) = &mut child.stdout {
            let _ = tokio::io::AsyncReadExt::read(stdout, &mut [0; 64]).await;
        }
        let pid = child.id().unwrap_or_default().to_string();
        let _ = tokio::process::Command::new("kill").args(["-STOP", &pid]).status().await;
        held(stage).await;
        let _ = child.kill().await;
    }
}

/// A stream of gRPC that is not read, one over gRPC-Web, a session of Zenoh whose subscriber is full, and
/// half a request.
async fn stalled_streams(stage: &Stage) {
    while stage.is_on() {
        let mut streams = Vec::new();
        let mut clients = Vec::new();
        for number in [0, 2] {
            let Some(client) = stage.tally.note("connect", stage.client(number).await) else { continue };
            streams
                .push(stage.tally.note("a watch that is not read", client.watch(Vec::new(), 1000.0).await));
            clients.push(client);
        }
        let session = network::session("client", &stage.locator).await;
        let subscriber = session.declare_subscriber("simd/soak/**").with(FifoChannel::new(1)).await;
        let half = async {
            let mut stream = TcpStream::connect(stage.address).await.ok()?;
            stream.write_all(b"POST /simd.v1.JointService/Get").await.ok()?;
            Some(stream)
        };
        let half = half.await;
        held(stage).await;
        drop((streams, clients, subscriber, half));
        // A session that does not read is not closed in good order, but by its end.
        let _ = tokio::time::timeout(Duration::from_secs(10), async { session.close().await }).await;
    }
    // The last word is with a client that is well.
    let asked = async { Client::connect(&stage.endpoint).await?.robots().await };
    if let Err(error) = asked.await {
        stage.tally.fail(format!("after the stalled readers: {error}"));
    }
}

//! Readers that stopped: they hold connections and streams, and read nothing.

use std::time::{Duration, Instant};

use simd_client::Client;
use tokio::io::AsyncWriteExt as _;
use tokio::net::TcpStream;
use tokio::task::JoinSet;

use super::Stage;
use crate::process::{Home, binaries};

/// Time for which one is stopped before it is killed and another starts.
const PERIOD: Duration = Duration::from_secs(60);
const TURN: Duration = Duration::from_millis(100);

/// Starts this many: stopped programs, and unread streams and subscribers.
pub(super) fn start(stage: &Stage, stopped: usize, actors: &mut JoinSet<()>) {
    for number in 0..stopped {
        let stage = stage.clone();
        actors.spawn(async move {
            match number % 5 {
                0 => stopped_processes(&stage, false).await,
                // Within this process a subscriber that is full would stop all of its sessions.
                1 | 3 => stopped_processes(&stage, true).await,
                kind => stalled_stream(&stage, kind - 2).await,
            }
        });
    }
}

async fn held(stage: &Stage) {
    let begun = Instant::now();
    while stage.is_on() && begun.elapsed() < PERIOD {
        tokio::time::sleep(TURN).await;
    }
}

/// `simctl joint watch`, whose process is stopped meanwhile.
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

/// A stream of gRPC, or over gRPC-Web, that is not read, and half a request beside it.
async fn stalled_stream(stage: &Stage, transport: usize) {
    while stage.is_on() {
        let mut stream = None;
        if let Some(client) = stage.tally.note("connect", stage.client(transport).await) {
            let watch = client.watch(Vec::new(), 1000.0).await;
            stream = Some((stage.tally.note("a watch that is not read", watch), client));
        }
        let half = async {
            let mut stream = TcpStream::connect(stage.address).await.ok()?;
            stream.write_all(b"POST /simd.v1.JointService/Get").await.ok()?;
            Some(stream)
        };
        let half = half.await;
        held(stage).await;
        drop((stream, half));
    }
    // The last word is with a client that is well.
    let asked = async { Client::connect(&stage.endpoint).await?.robots().await };
    if let Err(error) = asked.await {
        stage.tally.fail(format!("after the stalled readers: {error}"));
    }
}

//! A soak: a real `simd` in a world that comes and goes, with readers on every transport, for minutes or
//! hours. `make soak` runs it for an hour and prints what the process costs; the suite of the daemon runs
//! it for seconds. It fails where an acknowledged command was lost, where anything panicked and where the
//! daemon ended.

mod churn;
mod gauge;
mod readers;
mod stalled;
mod tally;
mod writers;

use std::fs::File;
use std::process::Stdio;
use std::sync::Arc;
use std::time::{Duration, Instant};

use simd_client::Client;
use tempfile::TempDir;
use tokio::sync::RwLock;
use tokio::task::JoinSet;

use self::gauge::Gauge;
pub use self::tally::Tally;
use crate::process::{Process, soon};
use crate::web;

/// How long, and how much of it is seen.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Of the churn.
    pub duration: Duration,
    /// Between two lines of the table.
    pub every: Duration,
}

/// What actors share: the way to the daemon, and what came of their calls.
#[derive(Clone)]
struct Stage {
    endpoint: String,
    address: std::net::SocketAddr,
    locator: String,
    tally: Arc<Tally>,
    /// Held by a writer that reads back what it set, against a client that restores the world.
    world: Arc<RwLock<()>>,
    ends: Instant,
}

impl Stage {
    fn is_on(&self) -> bool {
        Instant::now() < self.ends
    }

    /// Another connection, over each transport in turn.
    async fn client(&self, number: usize) -> Result<Client, simd_client::Error> {
        match number % 3 {
            0 => Client::connect(&self.endpoint).await,
            1 => Client::connect(&self.locator).await,
            _ => Ok(web::client(self.address)),
        }
    }
}

/// Runs it and prints a line each [`Options::every`]; what came of it.
///
/// # Panics
/// Where the daemon does not start.
#[allow(clippy::panic, clippy::print_stdout, reason = "a bench prints, and fails where it cannot go on")]
pub async fn run(options: Options) -> Arc<Tally> {
    let folder = TempDir::new().unwrap_or_else(|error| panic!("{error}"));
    let log = folder.path().join("log");
    let file = File::create(&log).unwrap_or_else(|error| panic!("{error}"));
    let zenoh = ["--zenoh", "tcp/127.0.0.1:0"];
    let mut daemon = Process::start_logging_to(Stdio::from(file), zenoh, ["--name", "soak"]).await;
    let tally = Arc::new(Tally::default());
    let stage = Stage {
        endpoint: daemon.endpoint.clone(),
        address: daemon.address().parse().unwrap_or_else(|error| panic!("{error}")),
        locator: daemon.locator.clone().unwrap_or_default(),
        tally: tally.clone(),
        world: Arc::default(),
        ends: Instant::now() + options.duration,
    };
    writers::prepare(&stage).await.unwrap_or_else(|error| panic!("{error}"));

    let mut actors = JoinSet::new();
    writers::start(&stage, &mut actors);
    readers::start(&stage, &mut actors);
    churn::start(&stage, &mut actors);
    stalled::start(&stage, &mut actors);
    let mut gauge = Gauge::new(&stage, daemon.pid()).await;
    while stage.is_on() && tally.failures().is_empty() {
        let next = stage.ends.min(Instant::now() + options.every);
        tokio::time::sleep_until(next.into()).await;
        gauge.read(&stage).await;
    }
    // They look at the clock between two calls.
    let ended = async {
        while let Some(actor) = actors.join_next().await {
            if let Err(error) = actor {
                tally.fail(format!("an actor failed: {error}"));
            }
        }
    };
    soon("the end of all actors", ended).await;

    daemon.signal("TERM").await;
    let (status, _) = daemon.ended().await;
    if status.code() != Some(0) {
        tally.fail(format!("the daemon ended with {status}"));
    }
    let log = std::fs::read_to_string(&log).unwrap_or_default();
    for line in log.lines().filter(|line| line.contains("panicked") || line.contains(" ERROR ")) {
        tally.fail(format!("the daemon's log: {line}"));
    }
    println!("{}", gauge.slopes());
    println!("{tally}");
    println!("the log has {} lines, {} bytes", log.lines().count(), log.len());
    tally
}

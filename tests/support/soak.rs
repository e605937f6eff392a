//! A soak: a real `simd` with a changing world and readers on every transport, for minutes or hours. `make
//! soak` runs it and prints the costs of the process; the daemon's suite runs it for seconds.
//!
//! First the world plays alone, to compare the lateness of its steps with; then all clients join. It fails if
//! an acknowledged command was lost, clients saw other refusals than the daemon counted, anything panicked or
//! the daemon ended.

mod churn;
mod flood;
mod gauge;
mod kernel;
mod lateness;
mod punctual;
mod readers;
mod refusals;
mod sleeper;
mod stalled;
mod tally;
mod writers;

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs::File;
use std::process::Stdio;
use std::sync::Arc;
use std::time::{Duration, Instant};

use simd_client::Client;
use tempfile::TempDir;
use tokio::sync::RwLock;
use tokio::task::JoinSet;

use self::gauge::Gauge;
pub use self::gauge::Slope;
pub use self::kernel::kernel;
pub use self::lateness::{Spread, Steps};
use self::punctual::Punctual;
use self::sleeper::Sleeper;
pub use self::tally::Tally;
use crate::process::{Process, soon};
use crate::web;

/// Time between two measurements of the daemon's costs.
const INTERVAL: Duration = Duration::from_secs(5);
/// Time with twice as much churn.
const CROWDED: Duration = Duration::from_secs(300);

/// Duration, numbers of clients, and output.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Time of the world alone.
    pub quiet: Duration,
    /// Time of the churn.
    pub duration: Duration,
    /// Time between two lines of the table.
    pub every: Duration,
    /// Clients that read.
    pub readers: usize,
    /// Number of these that have stopped reading.
    pub stopped: usize,
    /// `SCHED_FIFO` of the physics thread; 0 means none.
    pub priority: u32,
    /// The daemon locks its memory. Then it gives none of it back, and its memory is its peak.
    pub locks_memory: bool,
    /// The processor that the physics thread has for itself. The caller keeps its own threads off it.
    pub processor: Option<usize>,
}

/// Result of a run.
#[derive(Clone, Debug)]
pub struct Report {
    /// Counts of the calls.
    pub tally: Arc<Tally>,
    /// Steps of the world alone.
    pub quiet: Steps,
    /// Steps of the world with all clients.
    pub loaded: Steps,
    /// How late a thread was woken that only sleeps, in both.
    pub sleeper: [Spread; 2],
    /// How late steps were in the moments in which that thread was in time, in both.
    pub punctual: [Spread; 2],
    /// Growth of allocated memory after the first part of the run, MiB an hour.
    pub heap_slope: Slope,
    /// Growth of memory that belongs to no file after the first part of the run, MiB an hour.
    pub memory_slope: Slope,
}

/// Data that actors share: the connection to the daemon, and the results of their calls.
#[derive(Clone)]
struct Stage {
    endpoint: String,
    address: std::net::SocketAddr,
    locator: String,
    tally: Arc<Tally>,
    /// Held by a writer that reads back its own values, against a client that restores the world.
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

/// Runs it and prints a line each [`Options::every`]. Returns the result.
///
/// # Panics
/// Panics if the daemon does not start.
#[allow(clippy::panic, clippy::print_stdout, reason = "a bench prints, and fails where it cannot go on")]
pub async fn run(options: Options) -> Report {
    let folder = TempDir::new().unwrap_or_else(|error| panic!("{error}"));
    let [log, config] = ["log", "simd.toml"].map(|name| folder.path().join(name));
    let file = File::create(&log).unwrap_or_else(|error| panic!("{error}"));
    let Options { priority, locks_memory, .. } = options;
    let processors = options.processor.map_or(String::new(), |number| format!("processors = [{number}]\n"));
    let text = format!("[realtime]\npriority = {priority}\nlock_memory = {locks_memory}\n{processors}");
    std::fs::write(&config, text).unwrap_or_else(|error| panic!("{error}"));
    let zenoh = ["--zenoh", "tcp/127.0.0.1:0"];
    let flags = [OsStr::new("--name"), OsStr::new("soak"), OsStr::new("--config"), config.as_os_str()];
    let mut daemon = Process::start_logging_to(Stdio::from(file), zenoh, flags).await;
    println!("{}", scheduling(daemon.pid(), options.priority));
    if let Some(number) = options.processor {
        println!("[realtime] processors = [{number}]: only for the physics thread");
    }
    let tally = Arc::new(Tally::default());
    let mut stage = Stage {
        endpoint: daemon.endpoint.clone(),
        address: daemon.address().parse().unwrap_or_else(|error| panic!("{error}")),
        locator: daemon.locator.clone().unwrap_or_default(),
        tally: tally.clone(),
        world: Arc::default(),
        ends: Instant::now(),
    };
    writers::prepare(&stage).await.unwrap_or_else(|error| panic!("{error}"));
    let observer = daemon.client().await;
    let so_far = || async { Steps::so_far(&observer).await.unwrap_or_else(|error| panic!("{error}")) };

    let begun = so_far().await;
    let sleeper = Arc::new(Sleeper::start(options.priority, options.processor, &begun.lateness));
    let punctual = Punctual::start(daemon.client().await, Arc::clone(&sleeper));
    tokio::time::sleep(options.quiet).await;
    let came = so_far().await;
    let quiet = came.since(&begun);
    let punctual_alone =
        soon("the last look at steps", punctual.end()).await.unwrap_or_else(|error| panic!("{error}"));
    let alone = sleeper.take();
    println!("{:.1} minutes of the world alone", options.quiet.as_secs_f64() / 60.0);

    let mut actors = JoinSet::new();
    let begun = Instant::now();
    // There is more churn at first than later: the memory for the most of everything at once is allocated
    // before its growth is measured.
    stage.ends = begun + options.duration;
    churn::start(&stage, 0..churn::CHURNS, stage.ends, &mut actors);
    let crowded = begun + CROWDED.min(options.duration / 10);
    churn::start(&stage, churn::CHURNS..2 * churn::CHURNS, crowded, &mut actors);
    writers::start(&stage, &mut actors);
    readers::start(&stage, options.readers.saturating_sub(options.stopped), &mut actors);
    stalled::start(&stage, options.stopped, &mut actors);
    flood::start(&stage, &mut actors);
    let punctual = Punctual::start(daemon.client().await, Arc::clone(&sleeper));
    let mut gauge = Gauge::new(&stage, daemon.pid()).await;
    while stage.is_on() && tally.failures().is_empty() {
        let line = stage.ends.min(Instant::now() + options.every);
        while Instant::now() < line {
            tokio::time::sleep_until(line.min(Instant::now() + INTERVAL).into()).await;
            gauge.look(&stage).await;
        }
        gauge.line(&stage).await;
    }
    let loaded = so_far().await.since(&came);
    let punctual_among = soon("the last look at steps", punctual.end()).await.unwrap_or_else(|error| {
        tally.fail(format!("the look at steps: {error}"));
        Spread::default()
    });
    let among = sleeper.take();
    drop(sleeper);
    if !tally.failures().is_empty() {
        // They would run to the end.
        println!("{tally}");
        actors.abort_all();
    }
    // They look at the clock between two calls.
    let ended = async {
        while let Some(actor) = actors.join_next().await {
            if let Err(error) = actor
                && !error.is_cancelled()
            {
                tally.fail(format!("an actor failed: {error}"));
            }
        }
    };
    soon("the end of all actors", ended).await;
    if let Err(error) = observer.robots().await {
        tally.fail(format!("at the end: {error}"));
    }
    let counted = refusals::counted(&stage).await;

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
    println!("{}", refused(&tally, &counted));
    println!("{tally}");
    println!("the log has {} lines, {} bytes", log.lines().count(), log.len());
    let (heap_slope, memory_slope) = (gauge.heap_slope(), gauge.memory_slope());
    let punctual = [punctual_alone, punctual_among];
    Report { tally, quiet, loaded, sleeper: [alone, among], punctual, heap_slope, memory_slope }
}

/// Returns a table of refusals. A difference is a failure, except for refusals of calls whose client did not wait for
/// the answer.
fn refused(tally: &Tally, counted: &BTreeMap<String, refusals::Refusals>) -> String {
    let seen = tally.refused();
    let mut text = "refused, by reason: seen by clients, counted by the daemon".to_owned();
    let reasons: BTreeSet<&String> = seen.keys().chain(counted.keys()).collect();
    let mut unanswered = tally.unanswered();
    for reason in reasons {
        let seen = seen.get(reason).copied().unwrap_or_default();
        let calls = counted.get(reason);
        let counted: u64 = calls.iter().flat_map(|calls| calls.values()).sum();
        text += &format!("\n  {seen:9} {counted:9}  {reason}");
        let unseen = counted.saturating_sub(seen).min(unanswered);
        unanswered -= unseen;
        if seen + unseen != counted {
            let calls = calls.unwrap_or(&BTreeMap::new()).clone();
            tally.fail(format!(
                "{reason}: clients saw {seen} refusals, and the daemon counted {counted}: {calls:?}"
            ));
        }
    }
    text
}

/// Returns the scheduling that the physics thread asks of the system, and the one that it has.
fn scheduling(pid: Option<u32>, priority: u32) -> String {
    let tasks = std::fs::read_dir(format!("/proc/{}/task", pid.unwrap_or_default()));
    let folders = tasks.into_iter().flatten().flatten().map(|task| task.path());
    let mut drivers = folders.filter(|folder| {
        std::fs::read_to_string(folder.join("comm")).is_ok_and(|name| name.trim() == "simd-driver")
    });
    // Fields 40 and 41; 38 and 39 come after the name in parentheses.
    let stat = drivers.next().and_then(|folder| std::fs::read_to_string(folder.join("stat")).ok());
    let has = stat.as_deref().and_then(|stat| {
        let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(37);
        Some((fields.next()?.to_owned(), fields.next()?.to_owned()))
    });
    match has {
        Some((priority, policy)) if policy == "1" => {
            format!("[realtime] priority = {priority}: the physics thread has SCHED_FIFO {priority}")
        }
        _ if priority == 0 => {
            "[realtime] is as it is by default: the physics thread has no priority".to_owned()
        }
        _ => format!("[realtime] priority = {priority}, which the system does not give: see the log"),
    }
}

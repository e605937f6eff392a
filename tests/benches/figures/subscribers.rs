//! Costs of many subscribers of every state: states delivered, their age on arrival, and processor time of
//! the daemon for each subscriber. The lateness of steps is compared with a run without any.

use std::io::{BufRead as _, BufReader, Lines};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant, SystemTime};

use simd_client::proto::JointStates;
use simd_client::{Client, JointWatch, every_joint};
use simd_server::daemon::Running;
use simd_tests::statistics::percentile;
use tokio::task::JoinSet;

use super::lateness::{arm, runtime, start};
use super::recording::{Sample, turn};

/// The argument that makes this program the subscribers.
pub(crate) const SUBSCRIBE: &str = "--subscribe";

/// Number of subscribers, each with a separate connection.
const SUBSCRIBERS: usize = 100;
/// States that each asks for, a second: all of them.
const RATE: f64 = 1_000.0;
const SECONDS: f64 = 10.0;
/// Time between the last subscription and the measurement, so that no earlier state is counted.
const SETTLE: Duration = Duration::from_secs(1);
/// Unit in which `/proc` counts processor time: `USER_HZ` is 100 on Linux.
const TICK: f64 = 0.01;

/// States are read and not counted.
const SETTLING: u8 = 0;
/// They are counted.
const COUNTING: u8 = 1;
/// They are read no longer.
const OVER: u8 = 2;

/// Prints the table.
pub(crate) fn print() {
    println!(
        "\n{SUBSCRIBERS} subscribers of every state of a seven-joint arm at 1 kHz, in another process, {SECONDS} s each"
    );
    println!("               actual factor   lateness of steps: p50, p99, p99.9, largest (microseconds)");
    let runtime = runtime();
    runtime.block_on(async {
        let running = start(vec![arm(0)], 1e-3).await;
        turn(&running, 1.0, &mut Sample::default()).await;
        let alone = measured(&running, "none").await;
        let mut subscribers = Subscribers::start(&format!("http://{}", running.address));
        subscribers.line();
        let with = measured(&running, &SUBSCRIBERS.to_string()).await;
        let line = subscribers.line();
        println!("  {line}");
        let each = (with - alone) / SUBSCRIBERS as f64;
        println!(
            "  processor time of the daemon: {with:.2} s a second, {alone:.2} without; {:.2} ms a second for each \
             subscriber, {:.1} microseconds for each state that is asked for",
            each * 1e3,
            each / RATE * 1e6
        );
        running.drain().await;
    });
}

/// Prints how late steps are, and returns the processor time of this process, in seconds a second.
async fn measured(running: &Running, title: &str) -> f64 {
    let (used, begun) = (processor_time(), Instant::now());
    let mut sample = Sample::default();
    turn(running, SECONDS, &mut sample).await;
    let share = (processor_time() - used) / begun.elapsed().as_secs_f64();
    sample.print(title);
    share
}

/// Returns the time of this process, user and system, s.
fn processor_time() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux");
    // The text before the last parenthesis is the program's name, which may have spaces.
    let (_name, fields) = stat.rsplit_once(')').expect("a name in parentheses");
    let ticks =
        |index| fields.split_whitespace().nth(index).and_then(|field: &str| field.parse::<f64>().ok());
    // utime and stime: see proc(5).
    (ticks(11).expect("utime") + ticks(12).expect("stime")) * TICK
}

/// This program once more, as the subscribers; ended with its guard.
struct Subscribers {
    process: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Subscribers {
    fn start(endpoint: &str) -> Self {
        let this = std::env::current_exe().expect("this program");
        let mut command = Command::new(this);
        command.args([SUBSCRIBE, endpoint]).stdout(Stdio::piped());
        let mut process = command.spawn().expect("it can be started");
        let stdout = process.stdout.take().expect("it is piped");
        Self { process, lines: BufReader::new(stdout).lines() }
    }

    /// Waits for the next line of its output and returns it.
    fn line(&mut self) -> String {
        self.lines.next().expect("it goes on").expect("a line")
    }
}

impl Drop for Subscribers {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Subscribes, prints when counting starts, and then the counts.
pub(crate) fn subscribe() {
    let endpoint = std::env::args().nth(2).expect("an endpoint");
    runtime().block_on(async {
        let phase = Arc::new(AtomicU8::new(SETTLING));
        let mut readers = JoinSet::new();
        for _ in 0..SUBSCRIBERS {
            let client = Client::connect(&endpoint).await.expect("the daemon listens");
            let watch = client.watch(vec![every_joint("arm-0")], RATE).await.expect("a stream");
            readers.spawn(read(watch, Arc::clone(&phase)));
        }
        tokio::time::sleep(SETTLE).await;
        phase.store(COUNTING, Ordering::Relaxed);
        println!("counting");
        let begun = Instant::now();
        tokio::time::sleep(Duration::from_secs_f64(SECONDS)).await;
        phase.store(OVER, Ordering::Relaxed);
        let seconds = begun.elapsed().as_secs_f64();
        let of_each = readers.join_all().await;
        let rates = of_each.iter().map(|ages| ages.len() as f64 / seconds);
        let (least, whole) = rates.fold((f64::INFINITY, 0.0), |(least, sum), rate| (rate.min(least), sum + rate));
        let mut ages: Vec<f64> = of_each.into_iter().flatten().collect();
        ages.sort_by(f64::total_cmp);
        println!(
            "states a second: {whole:.0} in all, {:.1} at each, {least:.1} at the slowest; age when they arrive: \
             {:.0}, {:.0}, {:.0} microseconds (p50, p99, largest)",
            whole / SUBSCRIBERS as f64,
            percentile(&ages, 0.5),
            percentile(&ages, 0.99),
            percentile(&ages, 1.0)
        );
    });
}

/// Returns the age of each state that is counted when it arrives, microseconds.
async fn read(mut watch: JointWatch, phase: Arc<AtomicU8>) -> Vec<f64> {
    let mut ages = Vec::new();
    loop {
        let states = watch.next().await.expect("the daemon goes on").expect("a state");
        match phase.load(Ordering::Relaxed) {
            SETTLING => {}
            COUNTING => ages.push(age(states)),
            _ => return ages,
        }
    }
}

/// Since the daemon published it, by the clock of the system, which both have.
fn age(states: JointStates) -> f64 {
    let now = SystemTime::now();
    let published = states.stamp.and_then(|stamp| stamp.wall_time).expect("a moment");
    let then = SystemTime::try_from(published).expect("a time");
    now.duration_since(then).unwrap_or_default().as_secs_f64() * 1e6
}

//! Steps at times when the machine woke a thread in time that only sleeps. The other load of a machine delays
//! every thread of a processor: the kernel, its host, another program that disables interrupts. Once in a
//! second is enough to determine the 99.9th percentile of a thousand steps a second.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use simd_client::{Client, Error};
use tokio::task::JoinHandle;

use super::sleeper::Sleeper;
use super::{Spread, Steps};

/// Time between two reads of the daemon's histogram: a moment.
const MOMENT: Duration = Duration::from_millis(100);
/// The machine is in time if the sleeping thread is never later than this.
const IN_TIME: Duration = Duration::from_micros(150);
/// A step is late together with a sleep within this time of it, which can belong to the next moment.
const SAME_TIME: Duration = Duration::from_millis(20);

/// It looks until it is ended.
pub(super) struct Punctual {
    ends: Arc<AtomicBool>,
    task: JoinHandle<Result<Spread, Error>>,
}

impl Punctual {
    pub(super) fn start(client: Client, sleeper: Arc<Sleeper>) -> Self {
        let ends = Arc::new(AtomicBool::new(false));
        let task = tokio::spawn(look(client, sleeper, Arc::clone(&ends)));
        Self { ends, task }
    }

    /// How late the steps were of the moments in which the machine was in time.
    ///
    /// # Errors
    /// Returns an error if the daemon did not answer.
    pub(super) async fn end(self) -> Result<Spread, String> {
        self.ends.store(true, Ordering::Relaxed);
        self.task.await.map_err(|error| error.to_string())?.map_err(|error| error.to_string())
    }
}

async fn look(client: Client, sleeper: Arc<Sleeper>, ends: Arc<AtomicBool>) -> Result<Spread, Error> {
    let mut punctual = Spread::default();
    let mut begun = Instant::now();
    let mut before = Steps::so_far(&client).await?.lateness;
    // From the previous moment: steps directly after it can belong to it.
    let mut last: Option<(Instant, Instant, Spread)> = None;
    while !ends.load(Ordering::Relaxed) {
        tokio::time::sleep(MOMENT).await;
        let asked = Instant::now();
        let now = Steps::so_far(&client).await?.lateness;
        if let Some((from, to, steps)) = last.replace((begun, Instant::now(), now.since(&before)))
            && sleeper.latest(from.checked_sub(SAME_TIME).unwrap_or(from), to + SAME_TIME) <= IN_TIME
        {
            punctual.add(&steps);
        }
        (begun, before) = (asked, now);
    }
    Ok(punctual)
}

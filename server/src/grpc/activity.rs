//! Activity of a connection: which side waits for the other, and since when.
//!
//! It is measured by calls and not by bytes. So a client that only answers pings, trickles a request or does
//! not read an answer counts as idle.

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::time::Instant;

/// Reason why closing a connection loses nothing or little. The smallest loss comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Idleness {
    /// No call has arrived yet.
    Unused,
    /// No call is open.
    BetweenCalls,
    /// Each call waits for its client: to send the rest of the request, or to read the answer.
    WaitsForClient,
}

/// The calls of one connection.
#[derive(Debug)]
pub(super) struct Activity(Mutex<Calls>);

#[derive(Debug)]
struct Calls {
    /// Number of calls that wait for the daemon.
    at_work: usize,
    /// Number of calls that wait for their client.
    waiting: usize,
    is_used: bool,
    /// Last time at which a call began, ended, or was at work.
    since: Instant,
}

impl Activity {
    pub(super) fn new(now: Instant) -> Arc<Self> {
        Arc::new(Self(Mutex::new(Calls { at_work: 0, waiting: 0, is_used: false, since: now })))
    }

    /// Returns the reason and the begin of idleness; `None` if a call is at work.
    pub(super) fn idle_since(&self) -> Option<(Idleness, Instant)> {
        let calls = self.lock();
        let why = match *calls {
            Calls { at_work: 1.., .. } => return None,
            Calls { waiting: 1.., .. } => Idleness::WaitsForClient,
            Calls { is_used: true, .. } => Idleness::BetweenCalls,
            Calls { is_used: false, .. } => Idleness::Unused,
        };
        Some((why, calls.since))
    }

    fn lock(&self) -> MutexGuard<'_, Calls> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One call, until it is dropped.
#[derive(Debug)]
pub(super) struct Call {
    activity: Arc<Activity>,
    /// Number of reasons why it waits for its client. Changed under the lock of `activity`.
    reasons: AtomicU8,
}

impl Call {
    /// Begins a call that is at work.
    pub(super) fn begin(activity: &Arc<Activity>) -> Arc<Self> {
        let mut calls = activity.lock();
        calls.at_work += 1;
        calls.is_used = true;
        calls.since = Instant::now();
        Arc::new(Self { activity: Arc::clone(activity), reasons: AtomicU8::new(0) })
    }

    /// Adds a reason why it waits for its client.
    pub(super) fn wait(&self) {
        let mut calls = self.activity.lock();
        if self.reasons.fetch_add(1, Ordering::Relaxed) == 0 {
            calls.at_work -= 1;
            calls.waiting += 1;
            calls.since = Instant::now();
        }
    }

    /// Removes a reason of [`Self::wait`].
    pub(super) fn resume(&self) {
        let mut calls = self.activity.lock();
        if self.reasons.fetch_sub(1, Ordering::Relaxed) == 1 {
            calls.waiting -= 1;
            calls.at_work += 1;
        }
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        let mut calls = self.activity.lock();
        match self.reasons.load(Ordering::Relaxed) {
            0 => calls.at_work -= 1,
            1.. => calls.waiting -= 1,
        }
        calls.since = Instant::now();
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    async fn second() -> Instant {
        tokio::time::advance(Duration::from_secs(1)).await;
        Instant::now()
    }

    #[tokio::test(start_paused = true)]
    async fn a_connection_is_idle_since_its_last_call_began_ended_or_came_to_wait_for_the_client() {
        let start = Instant::now();
        let activity = Activity::new(start);
        assert_eq!(activity.idle_since(), Some((Idleness::Unused, start)));
        second().await;
        let call = Call::begin(&activity);
        assert_eq!(activity.idle_since(), None);
        let received = second().await;
        call.wait();
        assert_eq!(activity.idle_since(), Some((Idleness::WaitsForClient, received)));
        // It waits for two reasons at once, of which one ends.
        second().await;
        call.wait();
        call.resume();
        assert_eq!(activity.idle_since(), Some((Idleness::WaitsForClient, received)));
        call.resume();
        assert_eq!(activity.idle_since(), None);
        let other = Call::begin(&activity);
        call.wait();
        drop(call);
        assert_eq!(activity.idle_since(), None);
        let end = second().await;
        drop(other);
        second().await;
        assert_eq!(activity.idle_since(), Some((Idleness::BetweenCalls, end)));
    }
}

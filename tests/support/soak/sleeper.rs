//! A thread that only sleeps: it measures how late the machine wakes a thread.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::Spread;

/// Number of sleeps for each step of the world. The cause of a late step may begin after one sleep and end
/// before the next: with more sleeps less of it is missed.
const PER_STEP: u32 = 4;
/// A part of a step of the world.
const PERIOD: Duration = Duration::from_micros(1_000 / PER_STEP as u64);
/// Number of sleeps that are kept until they are read: ten seconds of them.
const RECENT: usize = 40_000;
/// If it is later than this it restarts, as the world drops its delay.
const BEHIND: Duration = Duration::from_millis(200);

/// It runs until this is dropped, on the processor of the physics thread and with a priority higher by one:
/// no step delays it.
#[derive(Debug)]
pub(super) struct Sleeper {
    woken: Mutex<Woken>,
}

#[derive(Debug)]
struct Woken {
    /// From the thread, which does not wait: the reader is on a busy processor.
    sleeps: Receiver<Sleep>,
    /// Set if there were more of them than fit.
    overflowed: Arc<AtomicBool>,
    /// Sleeps that it is through with, of late: all since this moment.
    recent: VecDeque<Sleep>,
    since: Instant,
    /// How late they were, of one sleep a step, since this was last taken.
    counted: Spread,
    /// Sleeps in all.
    count: u32,
}

#[derive(Clone, Copy, Debug)]
struct Sleep {
    ended: Instant,
    late: Duration,
}

impl Sleeper {
    /// Its lateness is counted within the bounds of `like`.
    pub(super) fn start(priority: u32, processor: Option<usize>, like: &Spread) -> Self {
        let (sender, sleeps) = sync_channel(RECENT);
        let overflowed = Arc::new(AtomicBool::new(false));
        let overflows = Arc::clone(&overflowed);
        thread::spawn(move || {
            ask(priority, processor);
            sleep(&sender, &overflows);
        });
        let (recent, since, counted) = (VecDeque::with_capacity(RECENT), Instant::now(), like.empty());
        Self { woken: Mutex::new(Woken { sleeps, overflowed, recent, since, counted, count: 0 }) }
    }

    /// Returns its lateness since the last call, of one sleep a step.
    pub(super) fn take(&self) -> Spread {
        let mut woken = self.look();
        let empty = woken.counted.empty();
        std::mem::replace(&mut woken.counted, empty)
    }

    /// Returns its maximum lateness for a sleep that ended, or should have ended, between two times. Returns
    /// the longest possible time if some of these sleeps are not kept, or one is not over.
    pub(super) fn latest(&self, from: Instant, to: Instant) -> Duration {
        let woken = self.look();
        if woken.since > from || woken.recent.back().is_none_or(|last| last.ended < to) {
            return Duration::MAX;
        }
        let since = woken.recent.iter().rev().take_while(|sleep| sleep.ended >= from);
        let within = since.filter(|sleep| sleep.ended - sleep.late <= to);
        within.map(|sleep| sleep.late).max().unwrap_or_default()
    }

    /// Returns all up to now.
    fn look(&self) -> MutexGuard<'_, Woken> {
        let mut woken = self.woken.lock().unwrap_or_else(PoisonError::into_inner);
        while let Ok(sleep) = woken.sleeps.try_recv() {
            woken.add(sleep);
        }
        if woken.overflowed.swap(false, Ordering::Relaxed) {
            woken.since = Instant::now();
        }
        woken
    }
}

impl Woken {
    fn add(&mut self, sleep: Sleep) {
        if self.recent.len() == RECENT
            && let Some(oldest) = self.recent.pop_front()
        {
            self.since = self.since.max(oldest.ended);
        }
        self.recent.push_back(sleep);
        if self.count.is_multiple_of(PER_STEP) {
            self.counted.observe(sleep.late.as_secs_f64());
        }
        self.count = self.count.wrapping_add(1);
    }
}

/// Until no one looks any more.
fn sleep(sender: &SyncSender<Sleep>, overflowed: &AtomicBool) {
    let mut due = Instant::now();
    loop {
        due += PERIOD;
        thread::sleep(due.saturating_duration_since(Instant::now()));
        let ended = Instant::now();
        let late = ended.saturating_duration_since(due);
        match sender.try_send(Sleep { ended, late }) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => overflowed.store(true, Ordering::Relaxed),
            Err(TrySendError::Disconnected(_)) => return,
        }
        if late > BEHIND {
            due = ended;
        }
    }
}

/// A setting that the system refuses here, it refuses the daemon too, and the run reports it.
#[cfg(target_os = "linux")]
fn ask(priority: u32, processor: Option<usize>) {
    use rustix::thread::{CpuSet, sched_setaffinity};
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy,
    };
    use thread_priority::{ThreadPriority, thread_native_id};

    if let Some(processor) = processor {
        let mut own = CpuSet::new();
        own.set(processor);
        let _ = sched_setaffinity(None, &own);
    }
    if let Some(priority) = priority.checked_add(1).filter(|_| priority > 0)
        && let Some(priority) = u8::try_from(priority).ok().and_then(|it| it.try_into().ok())
    {
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let priority = ThreadPriority::Crossplatform(priority);
        let _ = set_thread_priority_and_policy(thread_native_id(), priority, policy);
    }
}

#[cfg(not(target_os = "linux"))]
fn ask(_priority: u32, _processor: Option<usize>) {}

//! A thread that does nothing but sleep: how late the machine wakes a thread, whatever it does.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::Spread;

/// It sleeps so often for each step of the world. What delays a step may begin right after a sleep, and end before the next: the
/// more sleeps there are, the less of it goes unseen.
const PER_STEP: u32 = 4;
/// A part of a step of the world.
const PERIOD: Duration = Duration::from_micros(1_000 / PER_STEP as u64);
/// So many sleeps are kept, and wait to be looked at: ten seconds of them.
const RECENT: usize = 40_000;
/// Later than this it begins anew, as the world drops what it is behind.
const BEHIND: Duration = Duration::from_millis(200);

/// It runs until this is dropped, on the processor of the physics thread and with a priority higher by one: no step delays it.
#[derive(Debug)]
pub(super) struct Sleeper {
    woken: Mutex<Woken>,
}

#[derive(Debug)]
struct Woken {
    /// Of the thread, which waits for no one: who looks is on a processor with much to do.
    sleeps: Receiver<Sleep>,
    /// More of them came than there is room for.
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
    /// Its lateness is counted within the same bounds as what it is `like`.
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

    /// How late it was since this was last asked, of one sleep a step.
    pub(super) fn take(&self) -> Spread {
        let mut woken = self.look();
        let empty = woken.counted.empty();
        std::mem::replace(&mut woken.counted, empty)
    }

    /// The latest that it was for a sleep that ended, or should have ended, between two moments; the longest time there is where
    /// some of these sleeps are not kept, or one is not over.
    pub(super) fn latest(&self, from: Instant, to: Instant) -> Duration {
        let woken = self.look();
        if woken.since > from || woken.recent.back().is_none_or(|last| last.ended < to) {
            return Duration::MAX;
        }
        let since = woken.recent.iter().rev().take_while(|sleep| sleep.ended >= from);
        let within = since.filter(|sleep| sleep.ended - sleep.late <= to);
        within.map(|sleep| sleep.late).max().unwrap_or_default()
    }

    /// All up to now.
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

/// What the system refuses it refuses the daemon too, and the run says so.
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

//! A thread that does nothing but sleep: how late the machine wakes a thread, whatever it does.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::Spread;

/// It sleeps so often for each step of the world. What delays a step may begin right after a sleep, and end before the next: the
/// more sleeps there are, the less of it goes unseen.
const PER_STEP: u32 = 4;
/// A part of a step of the world.
const PERIOD: Duration = Duration::from_micros(1_000 / PER_STEP as u64);
/// Later than this it begins anew, as the world drops what it is behind.
const BEHIND: Duration = Duration::from_millis(200);

/// It runs until this is dropped, on the processor of the physics thread and with a priority higher by one: no step delays it.
#[derive(Debug)]
pub(super) struct Sleeper {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    ends: AtomicBool,
    /// When it was woken and how late that was, since this was last taken.
    woken: Mutex<Vec<(Instant, Duration)>>,
}

impl Sleeper {
    pub(super) fn start(priority: u32, processor: Option<usize>) -> Self {
        let shared = Arc::new(Shared::default());
        let own = Arc::clone(&shared);
        let thread = thread::spawn(move || {
            ask(priority, processor);
            sleep(&own);
        });
        Self { shared, thread: Some(thread) }
    }

    /// How late it was since this was last asked, of one sleep a step, within the same bounds as the daemon counts.
    pub(super) fn take(&self, like: &Spread) -> Spread {
        let woken = std::mem::take(&mut *self.woken());
        // Without the lock, which the thread would wait for.
        like.counted(woken.iter().step_by(PER_STEP as usize).map(|(_, late)| late.as_secs_f64()))
    }

    /// The latest that it was for a sleep that ended, or should have ended, between two moments; these are after it was last
    /// taken.
    pub(super) fn latest(&self, from: Instant, to: Instant) -> Duration {
        let woken = self.woken();
        let since = woken.iter().rev().take_while(|(at, _)| *at >= from);
        since.filter(|(at, late)| *at - *late <= to).map(|(_, late)| *late).max().unwrap_or_default()
    }

    fn woken(&self) -> MutexGuard<'_, Vec<(Instant, Duration)>> {
        self.shared.woken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Sleeper {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn sleep(shared: &Shared) {
    let mut due = Instant::now();
    while !shared.ends.load(Ordering::Relaxed) {
        due += PERIOD;
        thread::sleep(due.saturating_duration_since(Instant::now()));
        let at = Instant::now();
        let late = at.saturating_duration_since(due);
        shared.woken.lock().unwrap_or_else(PoisonError::into_inner).push((at, late));
        if late > BEHIND {
            due = at;
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

//! A thread that does nothing but sleep, as often as the world steps: how late the machine wakes a thread, whatever it does.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::Spread;

/// A step of the world.
const PERIOD: Duration = Duration::from_millis(1);
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
    /// How late it was woken, seconds, since this was last taken.
    lateness: Mutex<Vec<f64>>,
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

    /// How late it was since this was last asked, within the same bounds as the daemon counts.
    pub(super) fn take(&self, like: &Spread) -> Spread {
        let lateness =
            std::mem::take(&mut *self.shared.lateness.lock().unwrap_or_else(PoisonError::into_inner));
        // Without the lock, which the thread would wait for.
        like.counted(&lateness)
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
        let late = due.elapsed();
        shared.lateness.lock().unwrap_or_else(PoisonError::into_inner).push(late.as_secs_f64());
        if late > BEHIND {
            due = Instant::now();
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

//! News of the physics thread for many readers: it wakes one task, and that wakes the readers.

use std::future::poll_fn;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::Poll;
use std::thread::Thread;

use futures_util::task::AtomicWaker;

/// Counts what was handed over, and wakes the one task that announces it.
#[derive(Debug, Default)]
pub(super) struct Announcer {
    handed_over: AtomicU64,
    task: AtomicWaker,
    /// The thread that wakes the task, where the physics thread leaves that to one: see `relay`.
    relay: OnceLock<Thread>,
    /// What the relay has woken the task for.
    relayed: AtomicU64,
}

impl Announcer {
    /// To be called after something was handed over. Waits for nothing.
    pub(super) fn hand_over(&self) {
        self.handed_over.fetch_add(1, Ordering::Release);
        match self.relay.get() {
            Some(thread) => thread.unpark(),
            None => self.task.wake(),
        }
    }

    /// From now on this thread calls [`Announcer::relay`] when it is unparked.
    pub(super) fn relay_by(&self, thread: Thread) {
        let _ = self.relay.set(thread);
    }

    /// Wakes the task if something was handed over since the last time.
    pub(super) fn relay(&self) {
        let handed_over = self.handed_over.load(Ordering::Acquire);
        if self.relayed.swap(handed_over, Ordering::Relaxed) != handed_over {
            self.task.wake();
        }
    }

    /// Waits until something was handed over since `announced`, which is then all of it.
    pub(super) async fn next(&self, announced: &mut u64) {
        poll_fn(|context| {
            // Before the look, so that what is handed over between the two wakes it.
            self.task.register(context.waker());
            let handed_over = self.handed_over.load(Ordering::Acquire);
            match std::mem::replace(announced, handed_over) == handed_over {
                true => Poll::Pending,
                false => Poll::Ready(()),
            }
        })
        .await;
    }
}

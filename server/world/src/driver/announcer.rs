//! Wakes many readers on news of the physics thread: the thread wakes one task, and the task wakes the
//! readers.

use std::future::poll_fn;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::Poll;
use std::thread::Thread;

use futures_util::task::AtomicWaker;

/// Counts handed-over items, and wakes the one task that announces them.
#[derive(Debug, Default)]
pub(super) struct Announcer {
    handed_over: AtomicU64,
    task: AtomicWaker,
    /// Thread that wakes the task in place of the physics thread, if any: see `relay`.
    relay: OnceLock<Thread>,
    /// Value of `handed_over` at the relay's last wake.
    relayed: AtomicU64,
}

impl Announcer {
    /// Announces an item that was handed over, without waiting.
    pub(super) fn hand_over(&self) {
        self.handed_over.fetch_add(1, Ordering::Release);
        match self.relay.get() {
            Some(thread) => thread.unpark(),
            None => self.task.wake(),
        }
    }

    /// Sets the thread that calls [`Announcer::relay`] from now on when it is unparked.
    pub(super) fn relay_by(&self, thread: Thread) {
        let _ = self.relay.set(thread);
    }

    /// Wakes the task if an item was handed over since the last call.
    pub(super) fn relay(&self) {
        let handed_over = self.handed_over.load(Ordering::Acquire);
        if self.relayed.swap(handed_over, Ordering::Relaxed) != handed_over {
            self.task.wake();
        }
    }

    /// Waits until an item was handed over since `announced`, and updates `announced`.
    pub(super) async fn next(&self, announced: &mut u64) {
        poll_fn(|context| {
            // Registered before the look, so that an item handed over in between wakes the task.
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

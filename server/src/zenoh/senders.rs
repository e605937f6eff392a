//! Threads that replies leave on.
//!
//! Zenoh sends a reply on the thread that asks it to, and waits there for up to five seconds where the asker does not
//! read; then it gives up that asker's connection. Who asks is not said with a query, so that one queue an asker
//! cannot be. Instead each reply that waits has a thread, and there are as many threads as queries that
//! are answered at one time: a client that does not read holds up its own replies and no others.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use tokio::sync::Semaphore;

use simd_world::blocking_threads::BlockingThreads;

/// Sending goes through a few functions of Zenoh's, and needs no more.
const STACK_BYTES: usize = 512 * 1024;

/// What becomes of replies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replies {
    /// That wait for their askers now.
    pub waiting: usize,
    /// That were sent since the start.
    pub sent: u64,
}

/// So many replies can wait at one time.
#[derive(Debug)]
pub(super) struct Senders {
    /// One reply is sent where it was made, which saves the way to another thread: nearly always there
    /// is no more than one.
    in_place: Semaphore,
    threads: BlockingThreads,
    waiting: AtomicUsize,
    sent: AtomicU64,
}

impl Senders {
    /// # Errors
    /// Returns an error if the system gives no threads.
    pub(super) fn new(threads: usize) -> std::io::Result<Self> {
        let threads = BlockingThreads::waiting("zenoh-reply", threads, STACK_BYTES)?;
        let (waiting, sent) = (AtomicUsize::new(0), AtomicU64::new(0));
        Ok(Self { in_place: Semaphore::new(1), threads, waiting, sent })
    }

    /// Sends, while other tasks go on: it may wait for a receiver that does not read.
    pub(super) async fn send(&self, send: impl FnOnce() + Send + 'static) {
        let _counted = CountWaiting::new(self);
        if let Ok(_permit) = self.in_place.try_acquire() {
            return tokio::task::block_in_place(send);
        }
        if let Err(error) = self.threads.run(send).await {
            tracing::warn!("a reply is not sent: {error}");
        }
    }

    /// What became of replies so far.
    pub(super) fn replies(&self) -> Replies {
        let (waiting, sent) = (self.waiting.load(Ordering::Relaxed), self.sent.load(Ordering::Relaxed));
        Replies { waiting, sent }
    }
}

/// A reply that is being sent.
struct CountWaiting<'a>(&'a Senders);

impl<'a> CountWaiting<'a> {
    fn new(senders: &'a Senders) -> Self {
        senders.waiting.fetch_add(1, Ordering::Relaxed);
        Self(senders)
    }
}

impl Drop for CountWaiting<'_> {
    fn drop(&mut self) {
        self.0.waiting.fetch_sub(1, Ordering::Relaxed);
        self.0.sent.fetch_add(1, Ordering::Relaxed);
    }
}

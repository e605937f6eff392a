//! Threads that send replies.
//!
//! Zenoh sends a reply on the calling thread, and waits there for up to five seconds if the client does not
//! read. Then it drops that client's connection. A query does not identify its sender, so there cannot be a
//! queue for each client. Instead, each waiting reply has a thread, and there are as many threads as
//! simultaneous queries. A client that does not read delays only its own replies.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use tokio::sync::Semaphore;

use simd_world::blocking_threads::BlockingThreads;

/// Stack size, bytes: sending only passes a few functions of Zenoh.
const STACK_BYTES: usize = 512 * 1024;

/// Numbers of replies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replies {
    /// Number of replies that wait for their clients now.
    pub waiting: usize,
    /// Number of replies sent since the start.
    pub sent: u64,
}

/// Threads for a limited number of simultaneous replies.
#[derive(Debug)]
pub(super) struct Senders {
    /// Permit to send one reply on the thread that made it, which saves a switch of threads: usually there is
    /// only one.
    in_place: Semaphore,
    threads: BlockingThreads,
    waiting: AtomicUsize,
    sent: AtomicU64,
}

impl Senders {
    /// # Errors
    /// Returns an error if the system refuses threads.
    pub(super) fn new(threads: usize) -> std::io::Result<Self> {
        let threads = BlockingThreads::waiting("zenoh-reply", threads, STACK_BYTES)?;
        let (waiting, sent) = (AtomicUsize::new(0), AtomicU64::new(0));
        Ok(Self { in_place: Semaphore::new(1), threads, waiting, sent })
    }

    /// Sends a reply while other tasks continue: it may wait for a receiver that does not read.
    pub(super) async fn send(&self, send: impl FnOnce() + Send + 'static) {
        let _counted = CountWaiting::new(self);
        if let Ok(_permit) = self.in_place.try_acquire() {
            return tokio::task::block_in_place(send);
        }
        if let Err(error) = self.threads.run(send).await {
            tracing::warn!("a reply is not sent: {error}");
        }
    }

    /// Returns the counts of replies so far.
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

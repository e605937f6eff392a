//! The one queue to the driver: bounded, and a full one refuses at once.
//!
//! It has no lock. The physics thread may have a real-time priority: it would wait for a client's thread that was taken
//! off its processor while it held one, for as long as the scheduler lets others run before that.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;
use std::time::{Duration, Instant};

use crossbeam_queue::ArrayQueue;
use tokio_util::sync::CancellationToken;

use super::event::Event;
use crate::call_error::CallError;

/// The end that calls are posted into.
#[derive(Clone, Debug)]
pub(crate) struct Mailbox {
    shared: Arc<Shared>,
    /// Shared by all that can post.
    _posters: Arc<Posters>,
}

/// The driver's end.
#[derive(Debug)]
pub(crate) struct Inbox {
    shared: Arc<Shared>,
    /// How long the reader looks for a call before it waits for one.
    spin: Duration,
}

/// Ends the driver when the last of them is gone.
#[derive(Debug)]
struct Posters(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    calls: ArrayQueue<Event>,
    /// The one that waits for calls.
    reader: OnceLock<Thread>,
    /// There is no [`Mailbox`] any more.
    has_no_posters: AtomicBool,
    /// There is no [`Inbox`] any more.
    has_no_reader: AtomicBool,
    refusals: AtomicU64,
    /// Calls in it.
    waiting: AtomicUsize,
    /// Calls in it that interrupt a step.
    interrupting: AtomicUsize,
    /// The driver ends before its next event.
    closing: AtomicBool,
    /// Cancelled when the driver has ended, well or not.
    ended: CancellationToken,
    /// What it panicked with.
    failure: OnceLock<String>,
}

/// A mailbox for `capacity` calls.
pub(crate) fn mailbox(capacity: usize) -> (Mailbox, Inbox) {
    let shared = Arc::new(Shared {
        calls: ArrayQueue::new(capacity.max(1)),
        reader: OnceLock::new(),
        has_no_posters: AtomicBool::new(false),
        has_no_reader: AtomicBool::new(false),
        refusals: AtomicU64::new(0),
        waiting: AtomicUsize::new(0),
        interrupting: AtomicUsize::new(0),
        closing: AtomicBool::new(false),
        ended: CancellationToken::new(),
        failure: OnceLock::new(),
    });
    let posters = Arc::new(Posters(shared.clone()));
    (Mailbox { shared: shared.clone(), _posters: posters }, Inbox { shared, spin: Duration::ZERO })
}

impl Shared {
    /// Wakes the reader, if it waits.
    fn wake(&self) {
        if let Some(reader) = self.reader.get() {
            reader.unpark();
        }
    }

    /// Drops what waits: its callers get an answer that way.
    fn clear(&self) {
        while self.calls.pop().is_some() {}
    }
}

impl Drop for Posters {
    fn drop(&mut self) {
        self.0.has_no_posters.store(true, Ordering::SeqCst);
        self.0.wake();
    }
}

impl Drop for Inbox {
    fn drop(&mut self) {
        self.shared.has_no_reader.store(true, Ordering::SeqCst);
        self.shared.clear();
    }
}

impl Mailbox {
    /// Posts without ever waiting.
    pub(crate) fn post(&self, event: Event) -> Result<(), CallError> {
        self.put(event)?;
        self.shared.wake();
        Ok(())
    }

    /// The same, and wakes nothing: the poster looks for who takes it.
    pub(crate) fn put(&self, event: Event) -> Result<(), CallError> {
        // Before it is in, so that it is never taken out uncounted.
        let interrupting = usize::from(event.interrupts());
        self.shared.interrupting.fetch_add(interrupting, Ordering::Relaxed);
        self.shared.waiting.fetch_add(1, Ordering::Relaxed);
        let refused = if self.shared.has_no_reader.load(Ordering::SeqCst) {
            Some(self.end())
        } else if self.shared.calls.push(event).is_err() {
            self.shared.refusals.fetch_add(1, Ordering::Relaxed);
            Some(CallError::MailboxFull { capacity: self.shared.calls.capacity() })
        } else {
            None
        };
        if let Some(refused) = refused {
            self.shared.interrupting.fetch_sub(interrupting, Ordering::Relaxed);
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
            return Err(refused);
        }
        // Its reader may have gone meanwhile, and then has not seen it.
        if self.shared.has_no_reader.load(Ordering::SeqCst) {
            self.shared.clear();
            return Err(self.end());
        }
        Ok(())
    }

    /// Says which thread waits for calls, before the first is posted.
    pub(crate) fn wakes(&self, reader: Thread) {
        let _ = self.shared.reader.set(reader);
    }

    /// Ends the driver after the step that it is in.
    pub(crate) fn close(&self) {
        self.shared.closing.store(true, Ordering::Release);
        self.shared.wake();
    }

    /// Calls that found it full.
    pub(crate) fn refusals(&self) -> u64 {
        self.shared.refusals.load(Ordering::Relaxed)
    }

    /// Calls in it.
    pub(crate) fn waiting(&self) -> usize {
        self.shared.waiting.load(Ordering::Relaxed)
    }

    /// Cancelled when the driver has ended, well or not.
    pub(crate) fn ended(&self) -> &CancellationToken {
        &self.shared.ended
    }

    /// What the driver failed with, if it did.
    pub(crate) fn failure(&self) -> Option<&str> {
        self.shared.failure.get().map(String::as_str)
    }

    /// Why a driver that has ended gives no answer.
    pub(crate) fn end(&self) -> CallError {
        match self.failure() {
            Some(failure) => CallError::Internal { message: format!("the physics thread ended: {failure}") },
            None => CallError::ShuttingDown,
        }
    }
}

impl Inbox {
    /// What waits already.
    pub(crate) fn try_next(&self) -> Option<Event> {
        if self.is_closing() {
            return Some(Event::Shutdown);
        }
        if let Some(event) = self.shared.calls.pop() {
            return Some(self.taken(event));
        }
        // What was posted last came before its poster went.
        let is_orphaned = self.shared.has_no_posters.load(Ordering::SeqCst);
        is_orphaned.then(|| self.shared.calls.pop().map_or(Event::Shutdown, |event| self.taken(event)))
    }

    /// Has the reader look for a call for so long, each time, before it waits for one: it keeps its processor, and who posts
    /// has none to wake.
    pub(crate) fn spin_for(&mut self, spin: Duration) {
        self.spin = spin;
    }

    /// What comes while the reader looks for it, which it does until the deadline at the longest.
    fn look(&self, deadline: Option<Instant>) -> Option<Event> {
        if self.spin.is_zero() {
            return None;
        }
        let ends = Instant::now() + self.spin;
        let ends = deadline.map_or(ends, |deadline| deadline.min(ends));
        while Instant::now() < ends {
            if let Some(event) = self.try_next() {
                return Some(event);
            }
            std::hint::spin_loop();
        }
        None
    }

    /// What comes before a deadline.
    pub(crate) fn next_before(&self, deadline: Instant) -> Option<Event> {
        self.shared.reader.get_or_init(std::thread::current);
        if let Some(event) = self.look(Some(deadline)) {
            return Some(event);
        }
        loop {
            if let Some(event) = self.try_next() {
                return Some(event);
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            std::thread::park_timeout(left);
        }
    }

    /// What comes, however long that takes. The driver ends when there is no [`Mailbox`] any more.
    pub(crate) fn next(&self) -> Event {
        self.shared.reader.get_or_init(std::thread::current);
        if let Some(event) = self.look(None) {
            return event;
        }
        loop {
            match self.try_next() {
                Some(event) => return event,
                None => std::thread::park(),
            }
        }
    }

    fn taken(&self, event: Event) -> Event {
        self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
        self.shared.interrupting.fetch_sub(usize::from(event.interrupts()), Ordering::Relaxed);
        event
    }

    /// Whether there is something to take: a call, or the end.
    pub(crate) fn has_some(&self) -> bool {
        let has_no_posters = self.shared.has_no_posters.load(Ordering::SeqCst);
        self.is_closing() || has_no_posters || !self.shared.calls.is_empty()
    }

    /// Whether a call waits that interrupts a step.
    pub(crate) fn has_interrupting(&self) -> bool {
        self.watch().has_interrupting()
    }

    /// For the threads that work for a step.
    pub(crate) fn watch(&self) -> Watch<'_> {
        Watch(&self.shared)
    }

    /// How many calls may wait.
    pub(crate) fn capacity(&self) -> usize {
        self.shared.calls.capacity()
    }

    /// Calls that found it full.
    pub(crate) fn refusals(&self) -> u64 {
        self.shared.refusals.load(Ordering::Relaxed)
    }

    /// What tells the others that the driver has ended.
    pub(crate) fn ending(&self) -> Ending {
        Ending(self.shared.clone())
    }

    /// Whether it was closed, with calls in it or not.
    pub(crate) fn is_closing(&self) -> bool {
        self.watch().is_closing()
    }
}

/// What an inbox tells on any thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watch<'a>(&'a Shared);

impl Watch<'_> {
    /// Whether a call waits that interrupts a step.
    pub(crate) fn has_interrupting(self) -> bool {
        self.0.interrupting.load(Ordering::Relaxed) > 0
    }

    /// Whether it was closed, with calls in it or not.
    pub(crate) fn is_closing(self) -> bool {
        self.0.closing.load(Ordering::Acquire)
    }
}

/// Tells the others that the driver has ended, at the latest when it is dropped: also by a panic of
/// whatever the driver does last.
#[derive(Debug)]
pub(crate) struct Ending(Arc<Shared>);

impl Ending {
    /// Why it failed; the first reason holds.
    pub(crate) fn fail(&self, failure: &str) {
        let _ = self.0.failure.set(failure.to_owned());
    }

    /// What still waits is to be dropped after this, so that a waiting caller finds the reason.
    pub(crate) fn end(&self) {
        self.0.ended.cancel();
    }
}

impl Drop for Ending {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.fail("it panicked while it ended");
        }
        self.end();
    }
}

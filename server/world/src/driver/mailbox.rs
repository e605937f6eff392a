//! The one queue to the driver: bounded, and it refuses at once when full.
//!
//! It has no lock. The physics thread may have a real-time priority. It would wait for a client's thread that
//! the scheduler suspended while it held a lock, for as long as other threads run before it.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;
use std::time::{Duration, Instant};

use crossbeam_queue::ArrayQueue;
use tokio_util::sync::CancellationToken;

use super::event::Event;
use crate::call_error::CallError;

/// Posting end.
#[derive(Clone, Debug)]
pub(crate) struct Mailbox {
    shared: Arc<Shared>,
    /// Shared by all posting ends.
    _posters: Arc<Posters>,
}

/// The driver's end.
#[derive(Debug)]
pub(crate) struct Inbox {
    shared: Arc<Shared>,
    /// Time for which the reader polls for a call before it sleeps.
    spin: Duration,
}

/// Ends the driver when the last poster is dropped.
#[derive(Debug)]
struct Posters(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    calls: ArrayQueue<Event>,
    /// Thread that waits for calls.
    reader: OnceLock<Thread>,
    /// Whether the last [`Mailbox`] is gone.
    has_no_posters: AtomicBool,
    /// Whether the [`Inbox`] is gone.
    has_no_reader: AtomicBool,
    refusals: AtomicU64,
    /// Number of queued calls.
    waiting: AtomicUsize,
    /// Number of queued calls that interrupt a step.
    interrupting: AtomicUsize,
    /// Whether the driver ends before its next event.
    closing: AtomicBool,
    /// Cancelled when the driver has ended, with or without a panic.
    ended: CancellationToken,
    /// Message of the driver's panic.
    failure: OnceLock<String>,
}

/// Returns a mailbox for `capacity` calls.
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

    /// Drops the queued calls, whose callers thereby get an answer.
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
    /// Posts a call without waiting.
    pub(crate) fn post(&self, event: Event) -> Result<(), CallError> {
        self.put(event)?;
        self.shared.wake();
        Ok(())
    }

    /// Like `post`, without waking the reader: the poster drives itself.
    pub(crate) fn put(&self, event: Event) -> Result<(), CallError> {
        // Counted before the push, so that no uncounted call is taken.
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
        // The reader may have ended in the meantime without seeing the call.
        if self.shared.has_no_reader.load(Ordering::SeqCst) {
            self.shared.clear();
            return Err(self.end());
        }
        Ok(())
    }

    /// Sets the thread that waits for calls, before the first is posted.
    pub(crate) fn wakes(&self, reader: Thread) {
        let _ = self.shared.reader.set(reader);
    }

    /// Ends the driver after its present step.
    pub(crate) fn close(&self) {
        self.shared.closing.store(true, Ordering::Release);
        self.shared.wake();
    }

    /// Returns the number of calls that found the mailbox full.
    pub(crate) fn refusals(&self) -> u64 {
        self.shared.refusals.load(Ordering::Relaxed)
    }

    /// Returns the number of queued calls.
    pub(crate) fn waiting(&self) -> usize {
        self.shared.waiting.load(Ordering::Relaxed)
    }

    /// Returns the token that is cancelled when the driver has ended, with or without a panic.
    pub(crate) fn ended(&self) -> &CancellationToken {
        &self.shared.ended
    }

    /// Returns the message of the driver's panic, if any.
    pub(crate) fn failure(&self) -> Option<&str> {
        self.shared.failure.get().map(String::as_str)
    }

    /// Returns the error for calls to a driver that has ended.
    pub(crate) fn end(&self) -> CallError {
        match self.failure() {
            Some(failure) => CallError::Internal { message: format!("the physics thread ended: {failure}") },
            None => CallError::ShuttingDown,
        }
    }
}

impl Inbox {
    /// Takes a queued event, without waiting.
    pub(crate) fn try_next(&self) -> Option<Event> {
        if self.is_closing() {
            return Some(Event::Shutdown);
        }
        if let Some(event) = self.shared.calls.pop() {
            return Some(self.taken(event));
        }
        // The last call of a poster was queued before the poster was dropped.
        let is_orphaned = self.shared.has_no_posters.load(Ordering::SeqCst);
        is_orphaned.then(|| self.shared.calls.pop().map_or(Event::Shutdown, |event| self.taken(event)))
    }

    /// Sets how long the reader polls for a call before it sleeps. Polling keeps its processor, and posters
    /// need not wake it.
    pub(crate) fn spin_for(&mut self, spin: Duration) {
        self.spin = spin;
    }

    /// Polls for an event, at most until the deadline.
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

    /// Waits for an event until a deadline.
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

    /// Waits for an event without a limit. The driver ends when the last [`Mailbox`] is gone.
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

    /// Returns whether an event is available: a call, or the end.
    pub(crate) fn has_some(&self) -> bool {
        let has_no_posters = self.shared.has_no_posters.load(Ordering::SeqCst);
        self.is_closing() || has_no_posters || !self.shared.calls.is_empty()
    }

    /// Returns whether a call is queued that interrupts a step.
    pub(crate) fn has_interrupting(&self) -> bool {
        self.watch().has_interrupting()
    }

    /// Returns a view for the threads that work for a step.
    pub(crate) fn watch(&self) -> Watch<'_> {
        Watch(&self.shared)
    }

    /// Returns the maximum number of queued calls.
    pub(crate) fn capacity(&self) -> usize {
        self.shared.calls.capacity()
    }

    /// Returns the number of calls that found the mailbox full.
    pub(crate) fn refusals(&self) -> u64 {
        self.shared.refusals.load(Ordering::Relaxed)
    }

    /// Returns the handle that reports the driver's end.
    pub(crate) fn ending(&self) -> Ending {
        Ending(self.shared.clone())
    }

    /// Returns whether the mailbox was closed, with or without queued calls.
    pub(crate) fn is_closing(&self) -> bool {
        self.watch().is_closing()
    }
}

/// View of an inbox for any thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watch<'a>(&'a Shared);

impl Watch<'_> {
    /// Returns whether a call is queued that interrupts a step.
    pub(crate) fn has_interrupting(self) -> bool {
        self.0.interrupting.load(Ordering::Relaxed) > 0
    }

    /// Returns whether the mailbox was closed, with or without queued calls.
    pub(crate) fn is_closing(self) -> bool {
        self.0.closing.load(Ordering::Acquire)
    }
}

/// Reports the driver's end, at the latest when dropped, even if the driver's last actions panic.
#[derive(Debug)]
pub(crate) struct Ending(Arc<Shared>);

impl Ending {
    /// Stores the reason of the failure; the first one holds.
    pub(crate) fn fail(&self, failure: &str) {
        let _ = self.0.failure.set(failure.to_owned());
    }

    /// Reports the end. Queued calls must be dropped afterwards, so that waiting callers find the reason.
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

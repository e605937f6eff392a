//! The one queue to the driver: bounded, and a full one refuses at once.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use tokio_util::sync::CancellationToken;

use super::event::Event;
use crate::call_error::CallError;

/// The end that calls are posted into.
#[derive(Clone, Debug)]
pub(crate) struct Mailbox {
    sender: SyncSender<Event>,
    shared: Arc<Shared>,
}

/// The driver's end.
#[derive(Debug)]
pub(crate) struct Inbox {
    receiver: Receiver<Event>,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    capacity: usize,
    refusals: AtomicU64,
    /// Calls in it.
    waiting: AtomicUsize,
    /// Calls in it that interrupt a step.
    interrupting: AtomicUsize,
    /// Set beside [`Event::Shutdown`], which may find the mailbox full.
    closing: AtomicBool,
    /// Cancelled when the driver has ended, well or not.
    ended: CancellationToken,
    /// What it panicked with.
    failure: OnceLock<String>,
}

/// A mailbox for `capacity` calls.
pub(crate) fn mailbox(capacity: usize) -> (Mailbox, Inbox) {
    let (sender, receiver) = sync_channel(capacity);
    let shared = Arc::new(Shared {
        capacity,
        refusals: AtomicU64::new(0),
        waiting: AtomicUsize::new(0),
        interrupting: AtomicUsize::new(0),
        closing: AtomicBool::new(false),
        ended: CancellationToken::new(),
        failure: OnceLock::new(),
    });
    (Mailbox { sender, shared: shared.clone() }, Inbox { receiver, shared })
}

impl Mailbox {
    /// Posts without ever waiting.
    pub(crate) fn post(&self, event: Event) -> Result<(), CallError> {
        // Before it is in, so that it is never taken out uncounted.
        let interrupting = usize::from(event.interrupts());
        self.shared.interrupting.fetch_add(interrupting, Ordering::Relaxed);
        self.shared.waiting.fetch_add(1, Ordering::Relaxed);
        self.sender.try_send(event).map_err(|refused| {
            self.shared.interrupting.fetch_sub(interrupting, Ordering::Relaxed);
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
            match refused {
                TrySendError::Full(_) => {
                    self.shared.refusals.fetch_add(1, Ordering::Relaxed);
                    CallError::MailboxFull { capacity: self.shared.capacity }
                }
                TrySendError::Disconnected(_) => self.end(),
            }
        })
    }

    /// Ends the driver after the step that it is in.
    pub(crate) fn close(&self) {
        self.shared.closing.store(true, Ordering::Release);
        // Only to wake it: where the mailbox is full it is awake, and sees the flag.
        let _ = self.sender.try_send(Event::Shutdown);
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
        match self.receiver.try_recv() {
            Ok(event) => Some(self.taken(event)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Event::Shutdown),
        }
    }

    /// What comes before a deadline.
    pub(crate) fn next_before(&self, deadline: Instant) -> Option<Event> {
        if self.is_closing() {
            return Some(Event::Shutdown);
        }
        match self.receiver.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(event) => Some(self.taken(event)),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Event::Shutdown),
        }
    }

    /// What comes, however long that takes. Nobody left to post ends the driver.
    pub(crate) fn next(&self) -> Event {
        if self.is_closing() {
            return Event::Shutdown;
        }
        self.receiver.recv().map_or(Event::Shutdown, |event| self.taken(event))
    }

    fn taken(&self, event: Event) -> Event {
        // What ends the driver is posted uncounted.
        if !matches!(event, Event::Shutdown) {
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        self.shared.interrupting.fetch_sub(usize::from(event.interrupts()), Ordering::Relaxed);
        event
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
        self.shared.capacity
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

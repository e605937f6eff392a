//! A driver that callers may run: one whose call finds it idle does what it asks for on its own thread, so that a call
//! within the process hands nothing over to another thread and back.
//!
//! The driver lies in a lock. The thread that holds it does what is in the mailbox, in its order: the driver's own thread, which
//! then waits outside of the lock, or a caller. A caller that finds the lock taken wakes the thread, which looks again
//! once it has the lock; so no call is left behind. While the world plays, the thread keeps the lock.

#[cfg(test)]
mod tests;

use std::fmt;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};
use std::thread::Thread;
use std::time::{Duration, Instant};

use super::finish;
use super::mailbox::Ending;
use super::main_loop::Driver;
use super::world::World;
use crate::run_state::RunState;

/// A caller drives for this long at the most; then the thread goes on, and the caller waits as others do, so that its
/// time limit and its signals are looked at.
const LONGEST: Duration = Duration::from_millis(20);

/// Where callers drive, whatever world it is.
pub(crate) trait Callers: fmt::Debug + Send + Sync {
    /// Does what is in the mailbox until `is_answered`, or has the driver's thread do it.
    fn drive(&self, is_answered: &mut dyn FnMut() -> bool);

    /// Says which thread is the driver's own, before the first call.
    fn wakes(&self, thread: Thread);
}

/// A driver in its lock.
pub(super) struct Shared<W> {
    /// `None` once it has ended.
    driver: Mutex<Option<Owned<W>>>,
    thread: OnceLock<Thread>,
}

/// Fields are dropped in this order.
struct Owned<W> {
    driver: Driver<W>,
    ending: Ending,
}

impl<W> fmt::Debug for Shared<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl<W: World> Shared<W> {
    pub(super) fn new(driver: Driver<W>) -> Self {
        let ending = driver.inbox.ending();
        Self { driver: Mutex::new(Some(Owned { driver, ending })), thread: OnceLock::new() }
    }

    /// On the driver's thread, until the driver has ended.
    pub(super) fn serve(&self) {
        loop {
            {
                // A panic within it is caught, so that it is never poisoned.
                let mut lock = self.driver.lock().unwrap_or_else(PoisonError::into_inner);
                if run(&mut lock, |driver| {
                    let is_busy = driver.state == RunState::Playing || driver.has_work();
                    if !is_busy {
                        driver.publish_pending();
                    }
                    is_busy
                })
                .is_break()
                {
                    return;
                }
            }
            std::thread::park();
        }
    }

    fn wake(&self) {
        if let Some(thread) = self.thread.get() {
            thread.unpark();
        }
    }
}

impl<W: World> Callers for Shared<W> {
    fn drive(&self, is_answered: &mut dyn FnMut() -> bool) {
        let mut lock = match self.driver.try_lock() {
            Ok(lock) => lock,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return self.wake(),
        };
        let ends = Instant::now() + LONGEST;
        let ended = run(&mut lock, |driver| {
            // In this order: whether it is answered takes the answer.
            driver.has_work() && !is_answered() && Instant::now() < ends
        });
        let is_left = match lock.as_mut() {
            Some(Owned { driver, .. }) => driver.state == RunState::Playing || driver.has_work(),
            None => false,
        };
        drop(lock);
        if is_left || ended.is_break() {
            self.wake();
        }
    }

    fn wakes(&self, thread: Thread) {
        let _ = self.thread.set(thread);
    }
}

/// Runs the driver while `goes_on`. `Break` where the driver has ended, by now or before.
fn run<W: World>(
    lock: &mut MutexGuard<'_, Option<Owned<W>>>,
    mut goes_on: impl FnMut(&mut Driver<W>) -> bool,
) -> ControlFlow<()> {
    let Some(Owned { driver, .. }) = lock.as_mut() else { return ControlFlow::Break(()) };
    let runs = AssertUnwindSafe(|| {
        while goes_on(driver) {
            if driver.run_once().is_break() {
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    });
    let outcome = match catch_unwind(runs) {
        Ok(ControlFlow::Continue(())) => return ControlFlow::Continue(()),
        Ok(ControlFlow::Break(())) => Ok(()),
        Err(panicked) => Err(panicked),
    };
    if let Some(Owned { driver, ending }) = lock.take() {
        finish(driver, &ending, outcome);
    }
    ControlFlow::Break(())
}

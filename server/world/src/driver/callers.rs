//! A driver that callers may run. A caller that finds it idle executes its call on its own thread. So a call
//! within the process needs no switch to another thread and back.
//!
//! The driver is in a lock. The thread that holds the lock executes the mailbox in order. This is either the
//! driver's own thread, which waits outside of the lock, or a caller. A caller that finds the lock taken
//! wakes the driver's thread, which looks again once it has the lock, so no call is lost. While the world
//! plays, the driver's thread keeps the lock.

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

/// Longest time for which a caller drives. Then the driver's thread continues, and the caller waits as others
/// do, so that it notices its time limit and its signals.
const LONGEST: Duration = Duration::from_millis(20);

/// Interface for callers that drive, independent of the type of the world.
pub(crate) trait Callers: fmt::Debug + Send + Sync {
    /// Executes the mailbox until `is_answered`, or wakes the driver's thread for it.
    fn drive(&self, is_answered: &mut dyn FnMut() -> bool);

    /// Sets the driver's own thread, before the first call.
    fn wakes(&self, thread: Thread);
}

/// A driver in its lock.
pub(super) struct Shared<W> {
    /// `None` once the driver has ended.
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

    /// Serves on the driver's thread until the driver ends.
    pub(super) fn serve(&self) {
        loop {
            {
                // Never poisoned in practice: a panic within the lock is caught.
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
            // The order matters: `is_answered` takes the answer.
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

/// Runs the driver while `goes_on`. Returns `Break` if the driver has ended, now or before.
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

//! Reads that take milliseconds: inverse kinematics, mass matrices, rays. They run on threads of low
//! priority, few at a time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio_util::sync::CancellationToken;

use super::{CallError, SimHandle};
use crate::account::Account;
use crate::blocking_threads::BlockingThreads;
use crate::fair_permits::FairPermits;
use crate::info::DaemonLimits;

/// Permits for heavy work, shared by all transports. Each waiting call holds its request in memory, at most a
/// message's size.
#[derive(Debug)]
pub(super) struct HeavyWork {
    permits: FairPermits,
}

/// Whether the last caller that waits for some work is gone.
#[derive(Clone, Debug, Default)]
pub struct Cancelled(Arc<AtomicBool>);

impl Cancelled {
    /// Returns whether the work is cancelled. Long work checks it often, and ends early.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Sets the flag when the caller's future is dropped.
struct SetOnDrop(Cancelled);

impl Drop for SetOnDrop {
    fn drop(&mut self) {
        self.0.0.store(true, Ordering::Relaxed);
    }
}

impl HeavyWork {
    /// Makes permits for half of the processors.
    pub(super) fn new(limits: &DaemonLimits) -> Self {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Self::with((processors / 2).max(1), limits.waiting_reads, limits.waiting_reads_of_client)
    }

    /// Makes one permit, for looks into recordings.
    pub(super) fn of_recordings() -> Self {
        let what = "waiting calls for contents of recordings";
        Self { permits: FairPermits::new(1, 16, 4, what) }
    }

    /// Makes two permits, for large answers.
    pub(super) fn of_answers() -> Self {
        Self { permits: FairPermits::new(2, 256, 32, "waiting calls for large answers") }
    }

    fn with(permits: usize, waiting: usize, of_one: usize) -> Self {
        let what = "waiting calls for kinematics and rays";
        Self { permits: FairPermits::new(permits, waiting, of_one, what) }
    }

    /// Runs the work on a thread where it blocks no other task. The permit is held until the work ends, even
    /// if its caller disconnects before: there are never more such threads than permits.
    ///
    /// # Errors
    /// Returns an error at once if too many calls wait already.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        account: &Account,
        threads: &BlockingThreads,
        work: impl FnOnce(&Cancelled) -> T + Send + 'static,
    ) -> Result<T, CallError> {
        let permit = self.permits.acquire(account).await?;
        let on_drop = SetOnDrop(Cancelled::default());
        let cancelled = on_drop.0.clone();
        let done = threads.run(move || {
            let _permit = permit;
            (!cancelled.is_set()).then(|| work(&cancelled))
        });
        match done.await {
            Ok(Some(done)) => Ok(done),
            Ok(None) => Err(CallError::Internal { message: "no caller waits for this work".into() }),
            Err(error) => Err(CallError::Internal { message: error.to_string() }),
        }
    }
}

impl SimHandle {
    /// Runs work of some milliseconds that only reads a published state, where it blocks no other task.
    ///
    /// # Errors
    /// Returns an error at once if too many such calls wait.
    pub async fn heavy<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Cancelled) -> T + Send + 'static,
    ) -> Result<T, CallError> {
        self.inner.heavy.run(&self.call.account, self.loader().threads(), work).await
    }

    /// Makes a large answer where it blocks no other task. It ends early if its caller disconnects.
    ///
    /// # Errors
    /// Returns an error at once if too many such calls wait.
    pub async fn make_large<F>(&self, work: F) -> Result<F::Output, CallError>
    where
        F: Future<Output: Send + 'static> + Send + 'static,
    {
        // Runtime of the waiting task, which provides the timers of the work.
        let runtime = tokio::runtime::Handle::current();
        let caller = CancellationToken::new();
        let gone = caller.clone();
        let _gone_on_drop = caller.drop_guard();
        let threads = self.loader().threads();
        let made = self.inner.large_answers.run(&self.call.account, threads, move |_cancelled| {
            runtime.block_on(gone.run_until_cancelled(work))
        });
        let no_caller = || CallError::Internal { message: "no caller waits for this answer".into() };
        made.await?.ok_or_else(no_caller)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Sender, channel};
    use std::task::Poll;

    use super::*;

    /// Polls once, which is enough to queue or to begin.
    async fn poll_once<F: Future>(future: std::pin::Pin<&mut F>) -> Poll<F::Output> {
        let mut future = future;
        std::future::poll_fn(|context| Poll::Ready(future.as_mut().poll(context))).await
    }

    /// Returns work that signals its begin, and ends when asked to or when cancelled.
    fn held()
    -> (impl FnOnce(&Cancelled) -> bool + Send + 'static, Sender<()>, tokio::sync::oneshot::Receiver<()>)
    {
        let (begun, has_begun) = tokio::sync::oneshot::channel();
        let (end, is_ended) = channel::<()>();
        let work = move |cancelled: &Cancelled| {
            begun.send(()).unwrap();
            is_ended.recv().unwrap();
            cancelled.is_set()
        };
        (work, end, has_begun)
    }

    #[tokio::test]
    async fn a_permit_is_held_until_the_work_ends_and_not_until_its_caller_leaves() {
        let threads = BlockingThreads::computing().unwrap();
        let heavy = HeavyWork::with(1, 1, 1);
        let (work, end, has_begun) = held();
        {
            let mut call = Box::pin(heavy.run(&Account::Process, &threads, work));
            assert!(poll_once(call.as_mut()).await.is_pending());
            has_begun.await.unwrap();
        }
        let mut next = Box::pin(heavy.run(&Account::Process, &threads, |_| 7));
        assert!(poll_once(next.as_mut()).await.is_pending(), "its caller is gone, and the first runs");
        end.send(()).unwrap();
        assert_eq!(next.await.unwrap(), 7);
    }

    #[tokio::test]
    async fn one_more_than_may_wait_is_refused_at_once() {
        let threads = BlockingThreads::computing().unwrap();
        let heavy = HeavyWork::with(1, 1, 1);
        let (work, end, has_begun) = held();
        let mut running = Box::pin(heavy.run(&Account::Process, &threads, work));
        assert!(poll_once(running.as_mut()).await.is_pending());
        has_begun.await.unwrap();
        let mut waiting = Box::pin(heavy.run(&Account::Process, &threads, |_| ()));
        assert!(poll_once(waiting.as_mut()).await.is_pending());
        assert!(matches!(
            heavy.run(&Account::Process, &threads, |_| ()).await,
            Err(CallError::LimitExceeded { .. })
        ));
        end.send(()).unwrap();
        assert!(!running.await.unwrap(), "its caller waits for it");
        waiting.await.unwrap();
    }

    #[tokio::test]
    async fn work_whose_caller_left_is_cancelled_and_what_only_waits_is_not_begun() {
        let threads = BlockingThreads::computing().unwrap();
        let heavy = HeavyWork::with(1, 2, 2);
        let (begun, has_begun) = tokio::sync::oneshot::channel();
        let (ended, has_ended) = tokio::sync::oneshot::channel();
        {
            let mut call = Box::pin(heavy.run(&Account::Process, &threads, move |cancelled: &Cancelled| {
                begun.send(()).unwrap();
                while !cancelled.is_set() {
                    std::thread::yield_now();
                }
                ended.send(()).unwrap();
            }));
            assert!(poll_once(call.as_mut()).await.is_pending());
            has_begun.await.unwrap();
            let mut waiting =
                Box::pin(heavy.run(&Account::Process, &threads, |_| panic!("it has no caller")));
            assert!(poll_once(waiting.as_mut()).await.is_pending());
        }
        has_ended.await.unwrap();
        heavy.run(&Account::Process, &threads, |_| ()).await.unwrap();
    }
}

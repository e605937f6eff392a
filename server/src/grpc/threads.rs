//! The threads that serve connections. Each has a runtime of its own, and a connection stays on one of them to its end, so that
//! what it asks is read, done and answered without a hand-over from thread to thread.
//!
//! One more thread is the door: it accepts connections, and answers those that ask whether the daemon is well. No call is made
//! there, so that it is never busy.

use std::future::Future;
use std::io;
use std::sync::Arc;

use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;
use tokio_util::task::TaskTracker;

/// So many at the most: what a connection asks is done by the physics thread or by those for long work.
const MOST: usize = 8;

/// Threads for connections; they end when this is dropped, and cut what they serve.
#[derive(Debug)]
pub struct FrontEndThreads {
    threads: Vec<FrontEndThread>,
    door: FrontEndThread,
}

#[derive(Debug)]
struct FrontEndThread {
    handle: Handle,
    /// Each connection that it serves has one of these too.
    serving: Arc<()>,
    /// Dropped when the thread is to end.
    _end: Option<oneshot::Sender<()>>,
}

impl FrontEndThreads {
    /// One for each processor.
    ///
    /// # Errors
    /// Returns an error if the system gives no threads.
    pub fn start() -> io::Result<Self> {
        let count = std::thread::available_parallelism().map_or(1, usize::from).min(MOST);
        let threads = (0..count).map(|index| FrontEndThread::start(format!("front-end-{index}")));
        Ok(Self { threads: threads.collect::<io::Result<_>>()?, door: FrontEndThread::start("door".into())? })
    }

    /// The runtime that connections are accepted on.
    pub fn door(&self) -> &Handle {
        &self.door.handle
    }

    /// Threads that serve connections.
    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        self.threads.len()
    }

    /// The runtime that tests run on, whose time they hold.
    #[cfg(test)]
    pub(super) fn of_this_runtime() -> Self {
        let thread = || FrontEndThread { handle: Handle::current(), serving: Arc::default(), _end: None };
        Self { threads: vec![thread()], door: thread() }
    }

    /// Serves a connection on the thread that has the fewest.
    pub(super) fn serve(&self, serving: &TaskTracker, connection: impl Future<Output = ()> + Send + 'static) {
        let Some(thread) = self.threads.iter().min_by_key(|thread| Arc::strong_count(&thread.serving)) else {
            return;
        };
        let served = Arc::clone(&thread.serving);
        let connection = async move {
            connection.await;
            drop(served);
        };
        serving.spawn_on(connection, &thread.handle);
    }
}

impl FrontEndThread {
    fn start(name: String) -> io::Result<Self> {
        // Nothing that waits for long is started there.
        let runtime = Builder::new_current_thread().enable_all().max_blocking_threads(1).build()?;
        let handle = runtime.handle().clone();
        let (end, ended) = oneshot::channel();
        std::thread::Builder::new().name(name).spawn(move || {
            // Never sent, so that this returns when the other end is dropped.
            let _ = runtime.block_on(ended);
            runtime.shutdown_background();
        })?;
        Ok(Self { handle, serving: Arc::default(), _end: Some(end) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn connections_are_shared_out_and_each_stays_on_its_thread() {
        let threads = FrontEndThreads::start().unwrap();
        let (tracker, count) = (TaskTracker::new(), threads.threads.len());
        let (names, mut named) = tokio::sync::mpsc::unbounded_channel();
        let release = tokio_util::sync::CancellationToken::new();
        for _ in 0..2 * count {
            let (names, release) = (names.clone(), release.clone());
            threads.serve(&tracker, async move {
                let name = || std::thread::current().name().unwrap_or_default().to_owned();
                let first = name();
                release.cancelled().await;
                assert_eq!(name(), first);
                names.send(first).unwrap();
            });
        }
        assert!(threads.threads.iter().all(|thread| Arc::strong_count(&thread.serving) == 3));
        release.cancel();
        let mut seen = std::collections::BTreeMap::<String, usize>::new();
        for _ in 0..2 * count {
            *seen.entry(named.recv().await.unwrap()).or_default() += 1;
        }
        assert_eq!(seen.into_values().collect::<Vec<_>>(), vec![2; count]);
    }

    #[tokio::test]
    async fn what_is_served_is_cut_with_the_threads() {
        let threads = FrontEndThreads::start().unwrap();
        let (held, gone) = oneshot::channel::<()>();
        threads.serve(&TaskTracker::new(), async move {
            std::future::pending::<()>().await;
            drop(held);
        });
        drop(threads);
        gone.await.unwrap_err();
    }
}

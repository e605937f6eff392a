//! Threads that serve connections. Each has its own runtime, and a connection stays on one of them to its
//! end. So a request is read, executed and answered without a switch of threads.
//!
//! Another thread is the door: it accepts connections, and answers health checks. It makes no calls, so that
//! it is never busy.

use std::future::Future;
use std::io;
use std::sync::Arc;

use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;
use tokio_util::task::TaskTracker;

/// Maximum number: the physics thread and the threads for long work execute most requests.
const MAX_THREADS: usize = 8;

/// Threads for connections; dropping this ends them, and cuts their connections.
#[derive(Debug)]
pub struct FrontEndThreads {
    threads: Vec<FrontEndThread>,
    door: FrontEndThread,
}

#[derive(Debug)]
struct FrontEndThread {
    handle: Handle,
    /// Each served connection holds a clone.
    serving: Arc<()>,
    /// Dropped to end the thread.
    _end: Option<oneshot::Sender<()>>,
}

impl FrontEndThreads {
    /// Starts a thread for each processor.
    ///
    /// # Errors
    /// Returns an error if the system refuses threads.
    pub fn start() -> io::Result<Self> {
        let count = std::thread::available_parallelism().map_or(1, usize::from).min(MAX_THREADS);
        let threads = (0..count).map(|index| FrontEndThread::start(format!("front-end-{index}")));
        Ok(Self { threads: threads.collect::<io::Result<_>>()?, door: FrontEndThread::start("door".into())? })
    }

    /// Returns the runtime that accepts connections.
    pub fn door(&self) -> &Handle {
        &self.door.handle
    }

    /// Returns the number of threads that serve connections.
    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        self.threads.len()
    }

    /// Uses the calling runtime, whose time tests control.
    #[cfg(test)]
    pub(super) fn of_this_runtime() -> Self {
        let thread = || FrontEndThread { handle: Handle::current(), serving: Arc::default(), _end: None };
        Self { threads: vec![thread()], door: thread() }
    }

    /// Serves a connection on the thread with the fewest connections.
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
        // No long blocking work is started there.
        let runtime = Builder::new_current_thread().enable_all().max_blocking_threads(1).build()?;
        let handle = runtime.handle().clone();
        let (end, ended) = oneshot::channel();
        std::thread::Builder::new().name(name).spawn(move || {
            // Nothing is ever sent: this returns when the other end is dropped.
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
    async fn served_connections_are_cut_with_the_threads() {
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

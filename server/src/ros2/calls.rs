//! Limits simultaneous queries. A task works on each query. It is answered on a thread that no other query
//! waits for, since Zenoh blocks there while the client does not read.

use std::sync::Arc;

use tokio::runtime::Handle;
use tokio::sync::Semaphore;

use simd_world::blocking_threads::BlockingThreads;

/// Number of threads for replies.
const THREADS: usize = 4;
const STACK_BYTES: usize = 512 * 1024;
/// Room for queries, and threads for their answers.
#[derive(Debug)]
pub(super) struct Calls {
    runtime: Handle,
    room: Arc<Semaphore>,
    threads: Arc<BlockingThreads>,
}

impl Calls {
    /// Makes room for this many queries in progress or waiting to be answered.
    ///
    /// # Errors
    /// Returns an error if the system refuses threads.
    pub(super) fn new(room: usize) -> std::io::Result<Self> {
        let threads = Arc::new(BlockingThreads::waiting("ros2-reply", THREADS, STACK_BYTES)?);
        Ok(Self { runtime: Handle::current(), room: Arc::new(Semaphore::new(room)), threads })
    }

    /// Begins to work on a query, if there is room. `work` returns the function that sends the answer, if
    /// any. It does not wait, so that Zenoh's own threads may call it.
    pub(super) fn serve<W, S>(&self, work: impl FnOnce() -> W)
    where
        W: Future<Output = Option<S>> + Send + 'static,
        S: FnOnce() + Send + 'static,
    {
        let Ok(room) = Arc::clone(&self.room).try_acquire_owned() else {
            return tracing::debug!("a query of ROS 2 is dropped: its queue is full");
        };
        let (work, threads) = (work(), Arc::clone(&self.threads));
        self.runtime.spawn(async move {
            if let Some(send) = work.await
                && threads.run(send).await.is_err()
            {
                tracing::debug!("a reply of ROS 2 is not sent");
            }
            drop(room);
        });
    }
}

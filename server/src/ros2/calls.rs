//! Queries that are answered at one time: so many, and no more. Each is worked on by a task, and answered on a thread that
//! no other waits for, since Zenoh waits there for an asker that does not read.

use std::sync::Arc;

use tokio::runtime::Handle;
use tokio::sync::Semaphore;

use simd_world::blocking_threads::BlockingThreads;

/// Threads that replies leave on.
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
    /// For so many queries that are worked on or wait to be answered.
    ///
    /// # Errors
    /// Returns an error if the system gives no threads.
    pub(super) fn new(room: usize) -> std::io::Result<Self> {
        let threads = Arc::new(BlockingThreads::waiting("ros2-reply", THREADS, STACK_BYTES)?);
        Ok(Self { runtime: Handle::current(), room: Arc::new(Semaphore::new(room)), threads })
    }

    /// Begins to work on a query, if there is room. `work` gives what sends the answer, if there is to be one. Waits for
    /// nothing, so that Zenoh's own threads may call it.
    pub(super) fn serve<W, S>(&self, work: impl FnOnce() -> W)
    where
        W: Future<Output = Option<S>> + Send + 'static,
        S: FnOnce() + Send + 'static,
    {
        let Ok(room) = Arc::clone(&self.room).try_acquire_owned() else {
            return tracing::debug!("a query of ROS 2 finds no room");
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

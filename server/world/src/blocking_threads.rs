//! Threads that may block or compute for long, separate from threads that serve calls.

use std::io;
use std::time::Duration;

use tokio::runtime::{Builder, Handle, Runtime};
use tokio::task::JoinHandle;

/// Time after which an idle thread ends.
const IDLE: Duration = Duration::from_secs(10);

/// Nice value of computing threads, relative to the physics thread: if both want a processor, the physics
/// thread gets nine tenths.
#[cfg(target_os = "linux")]
const NICE: i32 = 10;

/// A bounded number of threads, started on demand.
#[derive(Debug)]
pub struct BlockingThreads {
    handle: Handle,
    /// Runtime, used only for its blocking threads. Taken when it ends.
    runtime: Option<Runtime>,
}

impl BlockingThreads {
    /// Makes threads for computations of milliseconds or seconds, with a lower priority than the physics
    /// thread.
    ///
    /// # Errors
    /// Returns an error if the system refuses threads.
    pub fn computing() -> io::Result<Self> {
        let count = std::thread::available_parallelism().map_or(1, usize::from) + 2;
        Self::new(Builder::new_current_thread().thread_name("compute").on_thread_start(lower_priority), count)
    }

    /// Makes threads for work that waits and computes nothing.
    ///
    /// # Errors
    /// Returns an error if the system refuses threads.
    pub fn waiting(name: &str, count: usize, stack_bytes: usize) -> io::Result<Self> {
        Self::new(Builder::new_current_thread().thread_name(name).thread_stack_size(stack_bytes), count)
    }

    fn new(builder: &mut Builder, count: usize) -> io::Result<Self> {
        let runtime = builder.max_blocking_threads(count).thread_keep_alive(IDLE).build()?;
        Ok(Self { handle: runtime.handle().clone(), runtime: Some(runtime) })
    }

    /// Runs some work on one of the threads, once one is free.
    pub fn run<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> JoinHandle<T> {
        self.handle.spawn_blocking(work)
    }
}

impl Drop for BlockingThreads {
    fn drop(&mut self) {
        // Otherwise, dropping a runtime waits for its threads.
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

/// Lowers the priority of the calling thread. Linux has a priority for each thread; other systems have one
/// for the process, which stays unchanged.
pub(crate) fn lower_priority() {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, NICE) {
        tracing::debug!(%error, "computing threads keep normal priority");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn computing_threads_give_way_and_waiting_ones_do_not() {
        let niceness = || rustix::process::getpriority_process(None).unwrap();
        let own = niceness();
        let computing = BlockingThreads::computing().unwrap().run(niceness).await.unwrap();
        assert_eq!(computing, NICE.max(own));
        assert_eq!(BlockingThreads::waiting("waits", 1, 65_536).unwrap().run(niceness).await.unwrap(), own);
        assert_eq!(niceness(), own, "no other thread has a lower priority for it");
    }

    #[tokio::test]
    async fn more_work_than_threads_waits_for_its_turn() {
        let threads = BlockingThreads::waiting("waits", 1, 65_536).unwrap();
        let (release, held) = std::sync::mpsc::channel::<()>();
        let first = threads.run(move || held.recv().is_ok());
        let second = threads.run(|| 2);
        assert!(!second.is_finished());
        release.send(()).unwrap();
        assert!(first.await.unwrap());
        assert_eq!(second.await.unwrap(), 2);
    }
}

//! Rollouts: copies of the world, computed on threads of low priority while their callers wait.
//!
//! A rollout is computed in slices of some milliseconds. It has as many threads as processors, and one less
//! while the world follows the wall clock. Two simultaneous rollouts share the threads, and other work of
//! these threads runs between slices. A slice may end within copies, which the next one continues. The two
//! belong to different clients: each client has one rollout computed at a time. So its long ones do not keep
//! all others waiting.

mod job;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use futures_util::future::try_join_all;
pub use job::CopiesDone;
use job::{Job, SLICE, lock};
use simd_core::Moment;
use simd_core::rollout::{BatchResult, Rollout, RolloutRequest, Shape};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::{CallError, RunState, SimHandle};
use crate::driver::{Event, Pace, Published};
use crate::fair_permits::FairPermits;
use crate::info::DaemonLimits;

/// Maximum number of rollouts computed at one time.
const ROLLOUTS: usize = 2;
/// Number of largest answers that are kept until their callers have read them.
const ANSWERS: u64 = 4;
/// Size of a permit of memory, bytes.
const KIBIBYTE: u64 = 1024;
/// Maximum steps of copies for each permitted second of a rollout: a thread makes a few million of an arm's.
const STEPS_A_SECOND: u64 = 100_000_000;

/// Shared state of rollouts.
#[derive(Debug)]
pub(super) struct RolloutWork {
    permits: FairPermits,
    compute_permits: ComputePermits,
    /// Permits for answers, one per KiB.
    room: Arc<Semaphore>,
}

impl RolloutWork {
    pub(super) fn new(limits: &DaemonLimits) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let what = "waiting rollouts";
        let (waiting, of_one) = (limits.waiting_rollouts, limits.waiting_rollouts_of_client);
        let room = limits.rollout_bytes.saturating_mul(ANSWERS).div_ceil(KIBIBYTE);
        let room = usize::try_from(room).unwrap_or(usize::MAX).min(Semaphore::MAX_PERMITS);
        Self {
            permits: FairPermits::new(ROLLOUTS, waiting, of_one, what).with_one_each(),
            compute_permits: ComputePermits::new(threads),
            room: Arc::new(Semaphore::new(room)),
        }
    }
}

/// Permits to compute: as many as processors, and one less while the world follows the wall clock.
///
/// Threads of low priority yield to the physics thread, but not immediately with each scheduler. With a
/// processor free of rollouts, the physics thread need not wait for that.
#[derive(Debug)]
struct ComputePermits {
    always: Arc<Semaphore>,
    /// The last permit; none with only one processor.
    spare: Arc<Semaphore>,
    threads: usize,
}

impl ComputePermits {
    fn new(processors: usize) -> Self {
        let threads = processors.max(1);
        let always = (threads - 1).max(1);
        let semaphore = |permits| Arc::new(Semaphore::new(permits));
        Self { always: semaphore(always), spare: semaphore(threads - always), threads }
    }

    /// Waits for a permit; with `leaves_one`, one permit stays unused.
    async fn next(&self, leaves_one: bool) -> Result<OwnedSemaphorePermit, CallError> {
        let spare = || Arc::clone(&self.spare).try_acquire_owned().ok();
        if let Some(permit) = (!leaves_one).then(spare).flatten() {
            return Ok(permit);
        }
        Arc::clone(&self.always).acquire_owned().await.map_err(|_closed| CallError::ShuttingDown)
    }
}

/// Start of the copies.
#[derive(Clone, Debug)]
pub enum RolloutFrom {
    /// The present world.
    Present,
    /// The saved state with this name.
    Saved(String),
}

/// Moment at which copies start.
#[derive(Clone, Debug)]
pub enum RolloutStart {
    /// Moment of this state.
    Published(Arc<Published>),
    /// Moment of a saved state.
    Saved(Moment),
}

/// A rollout in progress, which dropping this cancels.
#[derive(Debug)]
struct Running {
    handle: SimHandle,
    job: Arc<Job>,
}

/// Result of a rollout.
#[derive(Debug)]
pub struct RolloutAnswer {
    /// Dimensions of the arrays.
    pub shape: Shape,
    /// Fingerprint of the state where the copies started.
    pub fingerprint: u64,
    /// Start of the copies.
    pub start: RolloutStart,
    /// Results of batches, in the order of the copies.
    pub batches: Vec<BatchResult>,
    /// Processor time, seconds.
    pub seconds: f64,
    _room: OwnedSemaphorePermit,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.job.is_cancelled.store(true, Ordering::Relaxed);
    }
}

impl Running {
    /// Returns the result of each batch.
    ///
    /// # Errors
    /// Returns an error if it exceeds the permitted time of a rollout, or the daemon drains.
    async fn compute(&self) -> Result<Vec<BatchResult>, CallError> {
        let threads = self.handle.inner.rollouts.compute_permits.threads.min(self.job.rollout.batches());
        try_join_all((0..threads).map(|_| self.slices())).await?;
        lock(&self.job.permit).take();
        if self.job.draining.is_cancelled() {
            return Err(CallError::ShuttingDown);
        }
        let batches: Option<Vec<_>> = lock(&self.job.results).drain(..).collect();
        batches.ok_or_else(|| {
            let limit = self.handle.inner.info.limits.rollout_seconds;
            let (done, copies) = (self.job.done.load(Ordering::Relaxed), self.job.rollout.shape().copies);
            let what = format!(
                "the seconds of processor time of a rollout, of which {done} of {copies} copies were done (ask for \
                 fewer copies or steps),"
            );
            CallError::LimitExceeded { what, value: limit.saturating_add(1), limit }
        })
    }

    /// Runs slices one after the other, until none is left to begin.
    async fn slices(&self) -> Result<(), CallError> {
        loop {
            let permit =
                self.handle.inner.rollouts.compute_permits.next(self.handle.follows_wall_clock()).await?;
            let job = Arc::clone(&self.job);
            let slice = self.handle.loader().threads().run(move || {
                let _permit = permit;
                job.slice(SLICE)
            });
            let goes_on = slice.await.map_err(|error| CallError::Internal { message: error.to_string() })?;
            if !goes_on {
                return Ok(());
            }
        }
    }
}

/// Refuses a rollout that no machine completes in the permitted seconds: at once, and not after these
/// seconds.
fn check_steps(request: &RolloutRequest, seconds: u64) -> Result<(), CallError> {
    let value = (request.copies as u64).saturating_mul(request.steps);
    let limit = seconds.max(1).saturating_mul(STEPS_A_SECOND);
    if value <= limit {
        return Ok(());
    }
    let what = "the steps of all copies of a rollout together (ask for fewer copies or steps)".to_owned();
    Err(CallError::LimitExceeded { what, value, limit })
}

impl SimHandle {
    /// Returns whether the world plays with a pace.
    fn follows_wall_clock(&self) -> bool {
        let statistics = self.newest().statistics;
        statistics.state == RunState::Playing && matches!(statistics.pace, Pace::RealTime { .. })
    }

    /// Runs a rollout, once its caller has a permit. Dropping the future cancels it.
    ///
    /// # Errors
    /// Returns an error if too many wait, the request has unknown names or exceeds a limit, it takes too
    /// long, or the daemon drains.
    pub async fn rollout(
        &self,
        from: RolloutFrom,
        request: RolloutRequest,
        done: CopiesDone,
    ) -> Result<RolloutAnswer, CallError> {
        check_steps(&request, self.inner.info.limits.rollout_seconds)?;
        let work = &self.inner.rollouts;
        let permit = self.until_drained(work.permits.acquire(&self.call.account)).await??;
        let (saved, start) = match from {
            RolloutFrom::Present => {
                let (saved, published) = self.ask(|reply| Event::WholeState { reply }).await?;
                (saved, RolloutStart::Published(published))
            }
            RolloutFrom::Saved(name) => {
                let newest = self.newest();
                let kept = newest.state.saved(&name).map_err(CallError::World)?;
                (kept.saved().clone(), RolloutStart::Saved(kept.info().at))
            }
        };
        let limits = &self.inner.info.limits;
        let most_bytes = limits.rollout_bytes;
        // The computing thread holds the permit, longer than a caller that disconnects.
        let plan = self.loader().threads().run(move || (Rollout::new(saved, request, most_bytes), permit));
        let (rollout, permit) =
            plan.await.map_err(|error| CallError::Internal { message: error.to_string() })?;
        let rollout = rollout.map_err(CallError::World)?;
        let shape = rollout.shape().clone();
        let room = u32::try_from(shape.bytes().div_ceil(KIBIBYTE)).unwrap_or(u32::MAX);
        let room = Arc::clone(&work.room).try_acquire_many_owned(room).map_err(|_full| {
            let limit = most_bytes.saturating_mul(ANSWERS);
            let what = "the bytes of all answers of rollouts that callers have not read".to_owned();
            CallError::LimitExceeded { what, value: limit.saturating_add(shape.bytes()), limit }
        })?;
        let most = Duration::from_secs(limits.rollout_seconds);
        let job = Arc::new(Job::new(rollout, done, self.draining(), (most, Some(permit))));
        let running = Running { handle: self.clone(), job };
        let batches = running.compute().await?;
        let spent = Duration::from_nanos(running.job.spent.load(Ordering::Relaxed));
        let fingerprint = running.job.rollout.start_fingerprint();
        Ok(RolloutAnswer { shape, fingerprint, start, batches, seconds: spent.as_secs_f64(), _room: room })
    }
}

#[cfg(test)]
mod tests {
    use futures_util::FutureExt;

    use super::*;

    /// Takes the permits that are available at once.
    fn given(permits: &ComputePermits, leaves_one: bool) -> Vec<OwnedSemaphorePermit> {
        let mut all = Vec::new();
        while let Some(permit) = permits.next(leaves_one).now_or_never() {
            all.push(permit.unwrap());
        }
        all
    }

    #[test]
    fn a_world_that_follows_the_wall_clock_keeps_a_processor() {
        for (processors, kept) in [(1, 1), (2, 1), (8, 7)] {
            let permits = ComputePermits::new(processors);
            assert_eq!(given(&permits, false).len(), processors, "all of them else");
            let taken = given(&permits, true);
            assert_eq!(taken.len(), kept);
            assert_eq!(
                given(&permits, false).len(),
                processors - kept,
                "what is left is there for another moment"
            );
        }
    }

    #[test]
    fn steps_that_no_machine_does_in_time_are_refused_beforehand() {
        let asked = |copies, steps, seconds| {
            let request = RolloutRequest { copies, steps, ..RolloutRequest::default() };
            check_steps(&request, seconds).map_err(|error| error.to_string())
        };
        assert_eq!(asked(6_000, 1_000_000, 60), Ok(()));
        assert_eq!(
            asked(65_536, 1_000_000, 60).unwrap_err(),
            "the steps of all copies of a rollout together (ask for fewer copies or steps) would be \
             65536000000, and the limit is 6000000000"
        );
        assert_eq!(asked(65_536, 1_000_000, 86_400), Ok(()), "who may take a day may ask for more");
        assert!(asked(usize::MAX, u64::MAX, u64::MAX).is_ok() && asked(usize::MAX, 2, 0).is_err());
    }

    #[test]
    fn a_permit_comes_back_where_it_was_taken() {
        let permits = ComputePermits::new(2);
        drop(given(&permits, false));
        assert_eq!(given(&permits, true).len(), 1);
        assert_eq!(given(&permits, false).len(), 2);
    }
}

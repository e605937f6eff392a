//! Rollouts: copies of the world, computed on threads that give way to the physics thread, for those who asked as long as they
//! are there.
//!
//! A rollout is computed in slices of some milliseconds, of as many threads as there are processors, and of one less while the
//! world follows the wall clock: two rollouts that are computed at one time share them, and what else these threads are for
//! runs between slices. A slice ends in the midst of copies, which the next one goes on with. Two are of two clients: one client has
//! one rollout computed at a time, so that its long ones do not keep all others waiting.

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

/// Rollouts that are computed at one time.
const ROLLOUTS: usize = 2;
/// Answers of the largest size that are kept until their callers have read them.
const ANSWERS: u64 = 4;
/// Of a permit of memory.
const KIBIBYTE: u64 = 1024;
/// Steps of copies, for each second that a rollout may take, at the most: a thread does a few million of an arm's.
const STEPS_A_SECOND: u64 = 100_000_000;

/// What rollouts share.
#[derive(Debug)]
pub(super) struct RolloutWork {
    permits: FairPermits,
    compute_permits: ComputePermits,
    /// A permit for each KiB of answers.
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

/// Permits to compute: as many at a time as there are processors, and one less while the world follows the wall clock.
///
/// Threads of low priority give way to the physics thread, though not at once under each scheduler. Where a processor is free of
/// rollouts, the physics thread need not wait for that.
#[derive(Debug)]
struct ComputePermits {
    always: Arc<Semaphore>,
    /// None where there is only one processor.
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

    /// A permit, once there is one; `leaves_one` of those that there are is not given.
    async fn next(&self, leaves_one: bool) -> Result<OwnedSemaphorePermit, CallError> {
        let spare = || Arc::clone(&self.spare).try_acquire_owned().ok();
        if let Some(permit) = (!leaves_one).then(spare).flatten() {
            return Ok(permit);
        }
        Arc::clone(&self.always).acquire_owned().await.map_err(|_closed| CallError::ShuttingDown)
    }
}

/// Where copies start.
#[derive(Clone, Debug)]
pub enum RolloutFrom {
    /// The world as it is.
    Present,
    /// A saved state of this name.
    Saved(String),
}

/// The moment at which copies start.
#[derive(Clone, Debug)]
pub enum RolloutStart {
    /// Of this state.
    Published(Arc<Published>),
    /// Of a saved state.
    Saved(Moment),
}

/// A rollout that is computed as long as this is kept.
#[derive(Debug)]
struct Running {
    handle: SimHandle,
    job: Arc<Job>,
}

/// What a rollout gave.
#[derive(Debug)]
pub struct RolloutAnswer {
    /// How many numbers there are.
    pub shape: Shape,
    /// Of the state where the copies started.
    pub fingerprint: u64,
    /// Where the copies started.
    pub start: RolloutStart,
    /// In the order of the copies.
    pub batches: Vec<BatchResult>,
    /// Seconds of processor time that it took.
    pub seconds: f64,
    _room: OwnedSemaphorePermit,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.job.is_cancelled.store(true, Ordering::Relaxed);
    }
}

impl Running {
    /// What each batch came to.
    ///
    /// # Errors
    /// Returns an error if it takes longer than a rollout may, and where the daemon drains.
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

    /// One slice after the other, until there is nothing left to begin.
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

/// Refuses what no machine computes in the seconds that a rollout may take: now, and not when they are over.
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
    /// Whether the world plays, and its steps are due at some time of the wall clock.
    fn follows_wall_clock(&self) -> bool {
        let statistics = self.newest().statistics;
        statistics.state == RunState::Playing && matches!(statistics.pace, Pace::RealTime { .. })
    }

    /// Does a rollout, once its caller has a permit. Dropping the future ends it.
    ///
    /// # Errors
    /// Returns an error if too many wait, where the request names what is not there or asks for too much, where it takes too long, and where
    /// the daemon drains.
    pub async fn rollout(
        &self,
        from: RolloutFrom,
        request: RolloutRequest,
        done: CopiesDone,
    ) -> Result<RolloutAnswer, CallError> {
        check_steps(&request, self.inner.info.limits.rollout_seconds)?;
        let work = &self.inner.rollouts;
        let permit = self.until_drained(work.permits.acquire()).await??;
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
        // The permit is with who computes: it outlasts a caller that leaves.
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

    /// Permits that are given at once.
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

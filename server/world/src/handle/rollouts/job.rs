//! Shared state of a rollout's threads, and the length of their slices.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use simd_core::rollout::{BatchResult, Halt, Rollout, Schedule, Worker};
use tokio_util::sync::CancellationToken;

use crate::fair_permits::Permit;

/// Length of a slice, in which at least one step of some copies is made.
pub(super) const SLICE: Duration = Duration::from_millis(10);
/// Maximum number of consecutive queries without a look at the clock.
const MAX_UNTIMED_QUERIES: u32 = 15;
/// If more time passed since the last look, each query looks; afterwards, looks become rarer.
const BETWEEN_LOOKS: Duration = Duration::from_micros(100);
/// Duration beyond which the next step is interruptible.
const LONG_STEP: Duration = Duration::from_millis(2);

/// Number of completed copies while a rollout is computed.
pub type CopiesDone = Arc<AtomicUsize>;

/// Shared state of a rollout's threads.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) rollout: Rollout,
    next: AtomicUsize,
    pub(super) done: CopiesDone,
    pub(super) results: Mutex<Vec<Option<BatchResult>>>,
    /// Workers of paused slices: each may be within a batch, and a later slice continues it.
    workers: Mutex<Vec<Worker>>,
    /// Whether the last timed step of any slice took long.
    has_long_steps: AtomicBool,
    /// Whether no caller waits for it any more.
    pub(super) is_cancelled: AtomicBool,
    pub(super) draining: CancellationToken,
    /// Processor time, nanoseconds.
    pub(super) spent: AtomicU64,
    most: u64,
    /// Permit, held until the last thread has finished.
    pub(super) permit: Mutex<Option<Permit>>,
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Job {
    pub(super) fn new(
        rollout: Rollout,
        done: CopiesDone,
        draining: CancellationToken,
        (most, permit): (Duration, Option<Permit>),
    ) -> Self {
        let batches = rollout.batches();
        Self {
            rollout,
            next: AtomicUsize::new(0),
            done,
            results: Mutex::new((0..batches).map(|_| None).collect()),
            workers: Mutex::default(),
            has_long_steps: AtomicBool::new(false),
            is_cancelled: AtomicBool::new(false),
            draining,
            spent: AtomicU64::new(0),
            most: nanoseconds(most),
            permit: Mutex::new(permit),
        }
    }

    /// Returns whether it must end before it is done.
    fn is_over(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed) || self.is_too_long() || self.draining.is_cancelled()
    }

    fn is_too_long(&self) -> bool {
        self.spent.load(Ordering::Relaxed) > self.most
    }

    /// Computes for this time. Returns whether there is more to do.
    pub(super) fn slice(&self, length: Duration) -> bool {
        let slice = Slice::begin(self, length);
        let goes_on = self.compute(&slice);
        slice.look();
        goes_on
    }

    fn compute(&self, slice: &Slice<'_>) -> bool {
        let kept = lock(&self.workers).pop();
        let mut worker = kept.unwrap_or_else(|| self.rollout.worker());
        loop {
            match self.rollout.go_on(&mut worker, slice) {
                Ok(None) => {
                    let batch = self.next.fetch_add(1, Ordering::Relaxed);
                    if self.is_over() || batch >= self.rollout.batches() {
                        return false;
                    }
                    self.rollout.begin_batch(&mut worker, batch);
                }
                Ok(Some((batch, result))) => {
                    if let Some(slot) = lock(&self.results).get_mut(batch) {
                        *slot = Some(result);
                    }
                    self.done.fetch_add(self.rollout.copies_of(batch).len(), Ordering::Relaxed);
                    slice.look();
                    if slice.is_spent() {
                        lock(&self.workers).push(worker);
                        return true;
                    }
                }
                Err(Halt::Paused) => {
                    lock(&self.workers).push(worker);
                    return true;
                }
                Err(Halt::Over) => return false,
            }
        }
    }
}

/// Measures how long a thread has computed a rollout since it got its permit. Only one thread uses it.
#[derive(Debug)]
struct Slice<'a> {
    job: &'a Job,
    begun: Instant,
    length: u64,
    /// Last look at the clock, nanoseconds after its begin.
    looked: AtomicU64,
    /// Look that preceded the last step, nanoseconds after its begin.
    stepped: AtomicU64,
    /// Queries until the next look; `between` is their number between the last two.
    left: AtomicU32,
    between: AtomicU32,
    has_stepped: AtomicBool,
    /// Whether the rollout is over, which is final.
    is_over: AtomicBool,
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

impl<'a> Slice<'a> {
    fn begin(job: &'a Job, length: Duration) -> Self {
        Self {
            job,
            begun: Instant::now(),
            length: nanoseconds(length),
            looked: AtomicU64::new(0),
            stepped: AtomicU64::new(0),
            left: AtomicU32::new(0),
            between: AtomicU32::new(0),
            has_stepped: AtomicBool::new(false),
            is_over: AtomicBool::new(false),
        }
    }

    /// Looks at the clock, and checks whether the rollout must end.
    fn look(&self) {
        let now = nanoseconds(self.begun.elapsed());
        let passed = now.saturating_sub(self.looked.load(Ordering::Relaxed));
        self.looked.store(now, Ordering::Relaxed);
        self.job.spent.fetch_add(passed, Ordering::Relaxed);
        let between = match passed > nanoseconds(BETWEEN_LOOKS) {
            true => 0,
            false => (2 * self.between.load(Ordering::Relaxed) + 1).min(MAX_UNTIMED_QUERIES),
        };
        self.between.store(between, Ordering::Relaxed);
        self.left.store(between, Ordering::Relaxed);
        if self.job.is_over() {
            self.is_over.store(true, Ordering::Relaxed);
        }
    }

    /// Looks if it is time for it: at each query if the work in between takes long. Returns whether it
    /// looked.
    fn look_sometimes(&self) -> bool {
        match self.left.load(Ordering::Relaxed) {
            0 => self.look(),
            left => {
                self.left.store(left - 1, Ordering::Relaxed);
                return false;
            }
        }
        true
    }

    /// Returns whether its time was over at the last look.
    fn is_spent(&self) -> bool {
        self.looked.load(Ordering::Relaxed) >= self.length
    }
}

impl Schedule for Slice<'_> {
    fn before_step(&self) -> Result<(), Halt> {
        if self.has_long_steps() {
            self.left.store(0, Ordering::Relaxed);
        }
        let has_stepped = self.has_stepped.load(Ordering::Relaxed);
        if self.look_sometimes() {
            let looked = self.looked.load(Ordering::Relaxed);
            let took = looked.saturating_sub(self.stepped.swap(looked, Ordering::Relaxed));
            // No step precedes the first query.
            if has_stepped {
                self.job.has_long_steps.store(took > nanoseconds(LONG_STEP), Ordering::Relaxed);
            }
        }
        if self.is_over.load(Ordering::Relaxed) {
            return Err(Halt::Over);
        }
        // A slice makes at least one step, however late it begins.
        if has_stepped && self.is_spent() {
            return Err(Halt::Paused);
        }
        if !has_stepped {
            // The first step is timed, so that one that takes the whole slice is noticed.
            self.left.store(0, Ordering::Relaxed);
            self.has_stepped.store(true, Ordering::Relaxed);
        }
        Ok(())
    }

    fn is_over(&self) -> bool {
        if !self.is_over.load(Ordering::Relaxed) {
            self.look_sometimes();
        }
        self.is_over.load(Ordering::Relaxed)
    }

    fn has_long_steps(&self) -> bool {
        self.job.has_long_steps.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use simd_core::rollout::RolloutRequest;
    use simd_core::simulation::WorldLimits;
    use simd_core::{PhysicsSettings, Simulation};

    use super::*;

    /// Returns a job with copies of an empty world.
    fn job(copies: usize, steps: u64) -> Job {
        let world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
        let request = RolloutRequest { copies, steps, ..RolloutRequest::default() };
        let rollout = Rollout::new(world.to_saved(), request, 1 << 20).unwrap();
        Job::new(rollout, CopiesDone::default(), CancellationToken::new(), (Duration::from_secs(3600), None))
    }

    #[test]
    fn a_slice_ends_within_a_batch_and_the_next_one_continues_with_it() {
        let job = job(10, 5);
        let mut slices = 0;
        // Each slice is over at once, and makes one step of a copy.
        while job.slice(Duration::ZERO) {
            slices += 1;
        }
        assert_eq!(slices, 10 * 5);
        assert_eq!(job.done.load(Ordering::Relaxed), 10);
        let results: Option<Vec<BatchResult>> = lock(&job.results).drain(..).collect();
        let steps: Vec<u64> = results.unwrap().into_iter().flat_map(|result| result.steps_done).collect();
        assert_eq!(steps, [5; 10]);
    }

    #[test]
    fn threads_that_compute_slices_in_turn_leave_no_batch_unfinished() {
        let job = job(20, 7);
        // As many as there are threads: each is done once its slice returns false, with any worker.
        let mut going = [true; 3];
        while going.contains(&true) {
            for goes_on in going.iter_mut().filter(|goes_on| **goes_on) {
                *goes_on = job.slice(Duration::ZERO);
            }
        }
        assert!(lock(&job.results).iter().all(Option::is_some));
    }

    #[test]
    fn the_end_is_noticed_after_a_few_checks_and_stays() {
        let job = job(1, 1);
        let slice = Slice::begin(&job, SLICE);
        assert!((0..100).all(|_| !slice.is_over()));
        job.is_cancelled.store(true, Ordering::Relaxed);
        let said: Vec<bool> = (0..100).map(|_| slice.is_over()).collect();
        let first = said.iter().position(|is_over| *is_over).unwrap();
        assert!(
            first <= MAX_UNTIMED_QUERIES as usize && said[first..].iter().all(|is_over| *is_over),
            "{said:?}"
        );
        assert_eq!(slice.before_step(), Err(Halt::Over));
        assert!(!job.slice(SLICE) && lock(&job.results).iter().all(Option::is_none));
    }

    #[test]
    fn each_long_step_is_checked_and_the_next_can_be_interrupted_also_in_the_next_slice() {
        let job = job(1, 1);
        let mut slice = Slice::begin(&job, 2 * LONG_STEP);
        assert_eq!(slice.before_step(), Ok(()));
        // As if the first step had taken longer than the slice.
        slice.begun = slice.begun.checked_sub(3 * LONG_STEP).unwrap();
        assert_eq!(slice.before_step(), Err(Halt::Paused));
        let mut next = Slice::begin(&job, Duration::MAX);
        assert!(next.has_long_steps());
        assert_eq!(next.before_step(), Ok(()));
        assert!(next.has_long_steps(), "no step has been timed yet");
        next.begun = next.begun.checked_sub(2 * LONG_STEP).unwrap();
        assert_eq!(next.before_step(), Ok(()));
        assert!(next.has_long_steps());
        assert_eq!(next.left.load(Ordering::Relaxed), 0, "the next question is one with a look");
    }
}

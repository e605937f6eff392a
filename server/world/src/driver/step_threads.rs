//! Threads that a step may use: the physics thread, and others that the daemon owns and gives to the world.

use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::Thread;

use rayon_core::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder, Yield};
use simd_core::pool::Pool;

use super::realtime::{self, RealTime};

/// Maximum number of threads.
pub const MAX_STEP_THREADS: u64 = 64;

/// Number of failed looks for work after which a thread yields its processor.
const LOOKS: u32 = 16;

/// Number of looks for work after a step before a thread sleeps, about 50 microseconds in all.
const LINGERS: u32 = 50 * LOOKS;

/// Maximum number if the daemon chooses: with more, a step's threads wait for each other.
const MAX_CHOSEN_THREADS: usize = 4;

/// The calling thread and others, which sleep between steps.
///
/// It is a pool of rayon that includes the physics thread. `join` allocates nothing, and the physics thread
/// itself executes work that no other thread has taken by then. The other threads only look for such work,
/// and sleep between steps. On its own, rayon would let them sleep between the phases of a step too. Waking
/// one takes as long as a phase of a hundred robots.
#[derive(Debug)]
pub struct StepThreads {
    pool: ThreadPool,
    others: Arc<Others>,
}

/// The threads in addition to the physics thread.
#[derive(Debug, Default)]
struct Others {
    /// Whether they look for work, and do not sleep.
    are_awake: AtomicBool,
    /// Whether they must end.
    end: AtomicBool,
    /// Threads that have begun.
    threads: Mutex<Vec<Thread>>,
}

impl StepThreads {
    /// Starts a pool of `count` threads, including the calling one, which can belong to no other pool. The
    /// others get the real-time settings of the physics thread. Returns `None` if only the calling thread is
    /// used.
    ///
    /// # Errors
    /// Returns an error if the system refuses the threads, or the calling one belongs to another pool.
    pub fn start(count: usize, real_time: RealTime) -> Result<Option<Arc<Self>>, ThreadPoolBuildError> {
        if count < 2 {
            return Ok(None);
        }
        // Memory is already locked for the whole process.
        let real_time = RealTime { lock_memory: false, ..real_time };
        let pool = ThreadPoolBuilder::new()
            .num_threads(count)
            .use_current_thread()
            .thread_name(|index| format!("simd-step-{index}"))
            .start_handler(move |_index| realtime::ask(real_time))
            .build()?;
        let others = Arc::new(Others::default());
        let own = Arc::clone(&others);
        pool.spawn_broadcast(move |thread| {
            // The first is the physics thread, which has steps to make.
            if thread.index() > 0 {
                own.look_for_work();
            }
        });
        // Executes this thread's own part of the broadcast: otherwise the pool would never end.
        rayon_core::yield_local();
        Ok(Some(Arc::new(Self { pool, others })))
    }

    /// Returns the number of threads.
    pub fn count(&self) -> usize {
        self.pool.current_num_threads()
    }
}

impl Pool for StepThreads {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        if !self.others.are_awake.load(Relaxed) {
            first();
            second();
            return;
        }
        let is_done = AtomicBool::new(false);
        let first = || {
            first();
            // rayon's own wait falls asleep if the second part takes a little longer.
            work_until(&is_done);
        };
        let second = || {
            let _done = SetOnDrop(&is_done, true);
            second();
        };
        self.pool.join(first, second);
    }

    fn keep_awake(&self, work: &mut (dyn FnMut() + Send)) {
        self.others.are_awake.store(true, Release);
        // Resets the flag even if the work panics.
        let _asleep = SetOnDrop(&self.others.are_awake, false);
        self.others.threads().iter().for_each(Thread::unpark);
        work();
    }

    fn thread(&self) -> usize {
        self.pool.current_thread_index().unwrap_or(0)
    }
}

impl Drop for StepThreads {
    fn drop(&mut self) {
        self.others.end.store(true, Release);
        self.others.threads().iter().for_each(Thread::unpark);
    }
}

impl Others {
    fn threads(&self) -> MutexGuard<'_, Vec<Thread>> {
        self.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks for work until the pool ends.
    fn look_for_work(&self) {
        self.threads().push(std::thread::current());
        let (mut in_vain, mut lingered) = (0, 0);
        while !self.end.load(Acquire) {
            if self.are_awake.load(Acquire) {
                lingered = 0;
                in_vain = look(in_vain);
            } else if lingered < LINGERS {
                // The next step may follow at once.
                lingered += 1;
                in_vain = look(in_vain);
            } else {
                std::thread::park();
            }
        }
    }
}

/// Executes work of the pool until `is_done`.
fn work_until(is_done: &AtomicBool) {
    let mut in_vain = 0;
    while !is_done.load(Acquire) {
        in_vain = look(in_vain);
    }
}

/// Executes a piece of the pool's work; returns the new number of consecutive failed looks. Every few looks,
/// it yields to threads of the same priority.
fn look(in_vain: u32) -> u32 {
    if let Some(Yield::Executed) = rayon_core::yield_now() {
        return 0;
    }
    if in_vain % LOOKS == LOOKS - 1 {
        std::thread::yield_now();
    } else {
        std::hint::spin_loop();
    }
    in_vain.wrapping_add(1)
}

/// Sets a flag when it is dropped.
struct SetOnDrop<'a>(&'a AtomicBool, bool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(self.1, Release);
    }
}

/// Returns the number of threads that a step may use, including the physics thread. It is `asked`, or for 0
/// one less than the processors, to leave one for the threads that serve calls. If the physics thread has
/// reserved processors, it is at most their number.
pub(super) fn count(asked: u32, real_time: &RealTime) -> usize {
    let own = real_time.processors.numbers().count();
    let free = match own {
        0 => std::thread::available_parallelism().map_or(1, usize::from).saturating_sub(1),
        _ => own,
    };
    let count = match usize::try_from(asked) {
        Ok(0) | Err(_) => free.min(MAX_CHOSEN_THREADS),
        Ok(asked) if own > 0 => asked.min(own),
        Ok(asked) => asked,
    };
    count.max(1)
}

#[cfg(test)]
mod tests {
    use super::super::Processors;
    use super::*;

    #[test]
    fn both_halves_are_done_on_any_thread_and_however_deep_they_are_divided() {
        fn sum(pool: &dyn Pool, numbers: &[u64]) -> u64 {
            let (first, second) = numbers.split_at(numbers.len() / 2);
            if first.is_empty() {
                return second.iter().sum();
            }
            let (mut a, mut b) = (0, 0);
            pool.join(&mut || a = sum(pool, first), &mut || b = sum(pool, second));
            a + b
        }
        let numbers: Vec<u64> = (0..1_000).collect();
        let of = |count| {
            let numbers = numbers.clone();
            let run = move || {
                let threads = StepThreads::start(count, RealTime::default()).unwrap().unwrap();
                assert_eq!(threads.count(), count);
                let asleep = sum(&*threads, &numbers);
                // Many repetitions, so that the system interrupts each thread at any point.
                for _ in 0..3_000 {
                    let mut awake = 0;
                    threads.keep_awake(&mut || awake = sum(&*threads, &numbers));
                    assert_eq!(awake, asleep);
                }
                asleep
            };
            std::thread::spawn(run).join().unwrap()
        };
        assert_eq!([2, 3, 4, 7].map(of), [499_500; 4]);
    }

    #[test]
    fn threads_that_stay_awake_take_their_halves_and_end_with_the_work_whether_it_returns_or_panics() {
        let run = || {
            let threads = StepThreads::start(3, RealTime::default()).unwrap().unwrap();
            for _ in 0..100 {
                let (mut first, mut second) = (0, 0);
                threads.keep_awake(&mut || threads.join(&mut || first += 1, &mut || second += 1));
                assert_eq!([first, second], [1; 2]);
            }
            let fall = std::panic::AssertUnwindSafe(|| threads.keep_awake(&mut || panic!("the world fell")));
            assert!(std::panic::catch_unwind(fall).is_err());
            assert!(!threads.others.are_awake.load(Relaxed));
            let mut is_done = false;
            threads.keep_awake(&mut || is_done = true);
            assert!(is_done, "the threads live on");
        };
        std::thread::spawn(run).join().unwrap();
    }

    #[test]
    fn a_panic_on_another_thread_is_passed_on() {
        let run = || {
            let threads = StepThreads::start(2, RealTime::default()).unwrap().unwrap();
            let has_begun = AtomicBool::new(false);
            // The first part waits, so that its thread cannot execute the second.
            let mut first = || {
                while !has_begun.load(Acquire) {
                    std::thread::yield_now();
                }
            };
            let mut second = || {
                has_begun.store(true, Release);
                panic!("the world fell");
            };
            threads.keep_awake(&mut || threads.join(&mut first, &mut second));
        };
        assert!(std::thread::spawn(run).join().is_err());
    }

    #[test]
    fn no_more_threads_are_used_than_the_physics_thread_has_processors() {
        let held = RealTime { processors: Processors::of([2, 3]), ..RealTime::default() };
        assert_eq!([0, 1, 2, 8].map(|asked| count(asked, &held)), [2, 1, 2, 2]);
        assert_eq!([1, 2, 8].map(|asked| count(asked, &RealTime::default())), [1, 2, 8]);
        assert!((1..=MAX_CHOSEN_THREADS).contains(&count(0, &RealTime::default())));
        let alone = std::thread::spawn(|| StepThreads::start(1, RealTime::default()).unwrap().is_none());
        assert!(alone.join().unwrap());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn its_threads_are_held_to_the_processors_of_the_physics_thread() {
        let run = || {
            let allowed = || rustix::thread::sched_getaffinity(None).unwrap();
            let first = (0..Processors::COUNT).find(|number| allowed().is_set(*number)).unwrap();
            let real_time = RealTime { processors: Processors::of([first as u64]), ..RealTime::default() };
            let threads = StepThreads::start(2, real_time).unwrap().unwrap();
            let mut other = Vec::new();
            threads.keep_awake(&mut || other = threads.pool.broadcast(|at| (at.index(), allowed().count())));
            assert_eq!(other[1], (1, 1));
        };
        std::thread::spawn(run).join().unwrap();
    }
}

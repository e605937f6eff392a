//! Real-time settings of the physics thread: priority, reserved processors, locked memory.

/// Real-time settings of the physics thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RealTime {
    /// Priority of `SCHED_FIFO`, 1 to 99; 0 keeps normal scheduling.
    pub priority: u32,
    /// Processors reserved for the thread; the daemon's other threads avoid them. An empty set reserves none.
    pub processors: Processors,
    /// Whether the process locks its memory, so that nothing is swapped out.
    pub lock_memory: bool,
}

/// A set of processors, by the system's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Processors([u64; Self::COUNT / 64]);

impl Processors {
    /// Upper bound of the numbers, exclusive.
    pub const COUNT: usize = 1024;

    /// Makes a set of numbers below [`Self::COUNT`]; larger ones are ignored.
    pub fn of(numbers: impl IntoIterator<Item = u64>) -> Self {
        let mut set = Self::default();
        for number in numbers {
            let word = usize::try_from(number / 64).ok().and_then(|index| set.0.get_mut(index));
            if let Some(word) = word {
                *word |= 1 << (number % 64);
            }
        }
        set
    }

    /// Returns the numbers in order.
    pub fn numbers(&self) -> impl Iterator<Item = u64> {
        (0..Self::COUNT as u64).filter(|number| {
            let word = usize::try_from(number / 64).ok().and_then(|index| self.0.get(index));
            word.is_some_and(|word| word >> (number % 64) & 1 == 1)
        })
    }
}

impl RealTime {
    /// Moves all threads of the process off the processors of the physics thread, threads started later too.
    /// The physics thread takes its processors when it starts. Otherwise, a system call of another thread
    /// delays the physics thread: most kernels finish it first, regardless of priorities. If no processor is
    /// left for the other threads, nothing changes.
    pub fn keep_others_off(&self) {
        #[cfg(target_os = "linux")]
        if self.processors != Processors::default() {
            match keep_off(self.processors) {
                Ok(true) => {}
                Ok(false) => tracing::warn!(
                    "no processor is left for the other threads: they share realtime.processors with it"
                ),
                Err(error) => tracing::warn!(
                    "the processors of the physics thread are shared with other threads ({error}): a unit of systemd needs \
                     SystemCallFilter=sched_setaffinity, see realtime.conf"
                ),
            }
        }
    }
}

/// Returns false if no processor would be left for the others.
#[cfg(target_os = "linux")]
fn keep_off(processors: Processors) -> std::io::Result<bool> {
    use rustix::thread::{Pid, sched_getaffinity, sched_setaffinity};

    let mut others = sched_getaffinity(None)?;
    for number in processors.numbers() {
        others.unset(usize::try_from(number).unwrap_or(usize::MAX));
    }
    if others.count() == 0 {
        return Ok(false);
    }
    sched_setaffinity(None, &others)?;
    // Threads that run already, for instance the log's.
    for thread in std::fs::read_dir("/proc/self/task")? {
        let id = thread?.file_name().to_str().and_then(|id| id.parse().ok()).and_then(Pid::from_raw);
        match id.map(|id| sched_setaffinity(Some(id), &others)) {
            // The thread has ended.
            None | Some(Ok(()) | Err(rustix::io::Errno::SRCH)) => {}
            Some(Err(error)) => return Err(error.into()),
        }
    }
    Ok(true)
}

/// Applies the settings to the calling thread. The log reports each one that the system refuses, and the
/// thread continues without it.
#[cfg(target_os = "linux")]
pub(super) fn ask(wanted: RealTime) {
    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::thread::{CpuSet, sched_setaffinity};

    // Pages are locked at first use: the whole stacks of a hundred threads would be 200 MB.
    let pages = MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT;
    if wanted.lock_memory
        && let Err(error) = mlockall(pages)
    {
        tracing::warn!(
            "memory is not locked ({error}): the process needs CAP_IPC_LOCK or a higher LimitMEMLOCK (ulimit -l), \
             which realtime.conf gives a unit of systemd"
        );
    }
    let mut processors = CpuSet::new();
    let mut has_some = false;
    for number in wanted.processors.numbers() {
        // `CpuSet` and `Processors` both have 1024.
        processors.set(usize::try_from(number).unwrap_or(usize::MAX));
        has_some = true;
    }
    if has_some && let Err(error) = sched_setaffinity(None, &processors) {
        let numbers: Vec<u64> = wanted.processors.numbers().collect();
        tracing::warn!(
            "the physics thread is not limited to the processors {numbers:?} ({error}): realtime.processors must name \
             existing processors that the process may use; a unit of systemd needs realtime.conf"
        );
    }
    if wanted.priority > 0
        && let Err(reason) = set_priority(wanted.priority)
    {
        tracing::warn!(
            "the physics thread has no real-time priority ({reason}): the process needs CAP_SYS_NICE, or LimitRTPRIO \
             (ulimit -r) of at least {}; a unit of systemd needs realtime.conf, which gives it that and RestrictRealtime=no",
            wanted.priority
        );
    }
}

/// Requests only the real-time priority, for a helper of the physics thread. A refusal is logged at debug
/// level, since the physics thread is refused too and has reported it.
pub(super) fn ask_for_priority(priority: u32) {
    #[cfg(target_os = "linux")]
    if let Err(reason) = set_priority(priority) {
        tracing::debug!(reason, "a helper of the physics thread has no real-time priority");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = priority;
}

#[cfg(target_os = "linux")]
fn set_priority(priority: u32) -> Result<(), String> {
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy,
    };
    use thread_priority::{ThreadPriority, thread_native_id};

    let priority = u8::try_from(priority).ok().and_then(|value| value.try_into().ok());
    let priority = priority.ok_or("there is no such priority")?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), fifo)
        .map_err(|error| format!("{error:?}"))
}

#[cfg(not(target_os = "linux"))]
pub(super) fn ask(wanted: RealTime) {
    if wanted != RealTime::default() {
        tracing::warn!("[realtime] has no effect: this system is not Linux");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_of_processors_has_the_numbers_that_it_was_made_of() {
        let set = Processors::of([0, 3, 64, 1023, 5000]);
        assert_eq!(set.numbers().collect::<Vec<_>>(), [0, 3, 64, 1023]);
        assert_eq!(Processors::default().numbers().count(), 0);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_thread_that_asks_is_held_to_its_processors_and_no_other() {
        let allowed = || rustix::thread::sched_getaffinity(None).unwrap();
        let before = allowed();
        let first = (0..Processors::COUNT).find(|number| before.is_set(*number)).unwrap();
        let asked = std::thread::spawn(move || {
            ask(RealTime { processors: Processors::of([first as u64]), ..RealTime::default() });
            (allowed().count(), allowed().is_set(first))
        });
        assert_eq!(asked.join().unwrap(), (1, true));
        assert_eq!(allowed().count(), before.count());
        // An absent processor is refused, and nothing changes.
        let asked = std::thread::spawn(move || {
            ask(RealTime { processors: Processors::of([1023]), ..RealTime::default() });
            allowed().count()
        });
        assert_eq!(asked.join().unwrap(), before.count());
    }
}

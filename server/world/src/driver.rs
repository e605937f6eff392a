//! The physics thread, the only owner of the world: it applies commands between steps, keeps the pace, and
//! publishes states.
//!
//! It is an OS thread and not a task. It holds no lock across a step, and it waits only for its mailbox and
//! the clock.

mod announcer;
mod answers;
mod call_budget;
mod callers;
mod event;
mod event_log;
#[cfg(any(test, feature = "testing"))]
pub mod fake_world;
mod long_step;
mod mailbox;
mod main_loop;
mod meter;
mod obstruction_watch;
mod pacer;
mod published;
mod published_state_cell;
mod realtime;
mod record;
mod recorder_queue;
mod relay;
mod sensor_log;
mod step_calls;
mod step_queue;
mod step_threads;
#[cfg(test)]
mod tests;
mod world;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use simd_core::PublishedState;

pub(crate) use event::{Event, ReplyTo};
pub(crate) use event_log::EventLog;
pub use event_log::{
    AuditedCall, BlockedJoint, EventBatch, LockstepChange, LogEvent, LoggedEvent, RecordingEnd,
};
pub(crate) use mailbox::Mailbox;
pub use published::{Done, Pace, PaceChange, Published, Statistics, Stepped};
pub(crate) use published_state_cell::PublishedStateCell;
pub use realtime::{Processors, RealTime};
pub(crate) use recorder_queue::{
    AppliedCommand, Entry, RecorderQueue, RecorderQueueEnd, ReportEntry, Sender, WorldEntry,
};
pub(crate) use sensor_log::{CameraSample, SensorLog};
pub use sensor_log::{ContactReading, LoggedReading, Measured, NamedContactPartner, ReadingBatch};
pub use step_threads::{MAX_STEP_THREADS, StepThreads};
pub(crate) use world::World;

use crate::call_error::panic_message;
use crate::run_state::RunState;
use call_budget::CallBudget;
pub(crate) use callers::Callers;
use callers::Shared;
use long_step::LongSteps;
use mailbox::{Ending, mailbox};
use main_loop::{Driver, period};
use meter::Meter;
use obstruction_watch::ObstructionWatch;
use pacer::Pacer;
use published_state_cell::Publisher;
use relay::Relay;
use step_queue::StepQueue;

/// Maximum `spin_us`, microseconds.
pub const MAX_SPIN_US: u64 = 1_000;

/// Settings of the driver.
#[derive(Clone, Copy, Debug)]
pub struct Config {
    /// Capacity of the mailbox, calls.
    pub mailbox: usize,
    /// Maximum number of calls that wait for their steps.
    pub waiting_steps: usize,
    /// Number of events that are kept.
    pub events: usize,
    /// Real-time settings of the thread.
    pub real_time: RealTime,
    /// Threads that a step may use; 0 lets the daemon choose.
    pub step_threads: u32,
    /// Whether a caller that finds the driver idle executes its call on its own thread: for programs that
    /// have the world in their process. It has no effect if steps may use several threads, since the physics
    /// thread is one of them.
    pub callers_drive: bool,
    /// Microseconds for which the thread polls for a call, and a caller for its answer, before it sleeps; 0
    /// disables polling.
    pub spin_us: u32,
    /// Longest lag behind the wall clock, beyond which lag is dropped.
    pub lag_limit: Duration,
    /// Initial run state.
    pub state: RunState,
    /// Initial pace.
    pub pace: Pace,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            mailbox: 1024,
            waiting_steps: 1024,
            events: 1024,
            real_time: RealTime::default(),
            step_threads: 0,
            callers_drive: false,
            spin_us: 0,
            lag_limit: Duration::from_millis(200),
            state: RunState::Playing,
            pace: Pace::default(),
        }
    }
}

/// The driver's interface for other threads.
#[derive(Clone, Debug)]
pub struct Link {
    /// Mailbox for calls.
    pub(crate) mailbox: Mailbox,
    /// Published states.
    pub(crate) state_cell: Arc<PublishedStateCell>,
    /// Log of events.
    pub(crate) events: Arc<EventLog>,
    /// Log of sensor readings.
    pub(crate) sensors: Arc<SensorLog>,
    /// Interface for callers that drive, if enabled.
    pub(crate) callers: Option<Arc<dyn Callers>>,
    /// Time for which a caller polls for its answer before it sleeps.
    pub(crate) spin: Duration,
}

/// Starts the thread, and tasks that wake readers of states, events and sensors.
///
/// # Errors
/// Returns an error if the system refuses the thread, or outside of a runtime.
pub fn start(world: impl World, config: Config) -> std::io::Result<Link> {
    let runtime = tokio::runtime::Handle::try_current().map_err(std::io::Error::other)?;
    let (mut driver, mut link) = build(world, config);
    let builder = std::thread::Builder::new().name("simd-driver".into());
    let step_threads = step_threads::count(config.step_threads, &config.real_time);
    let callers_drive = config.callers_drive && step_threads < 2;
    if config.real_time.priority > 0 && !callers_drive {
        let Link { state_cell, events, sensors, .. } = link.clone();
        // Maximum number of calls that can wait for an answer at one time.
        let room = config.mailbox.saturating_add(config.waiting_steps);
        driver.relay = Some(Relay::start((config.real_time, room), state_cell, events, sensors)?);
    }
    let thread = if callers_drive {
        let shared = Arc::new(Shared::new(driver));
        link.callers = Some(shared.clone());
        builder.spawn(move || {
            realtime::ask(config.real_time);
            sharpen_timer();
            shared.serve();
        })?
    } else {
        builder.spawn(move || {
            realtime::ask(config.real_time);
            lend_threads(&mut driver.world, config);
            run(driver);
        })?
    };
    if let Some(callers) = &link.callers {
        callers.wakes(thread.thread().clone());
    }
    link.mailbox.wakes(thread.thread().clone());
    let (state_cell, ended) = (link.state_cell.clone(), link.mailbox.ended().clone());
    runtime.spawn(async move { ended.run_until_cancelled(state_cell.announce()).await });
    let (events, ended) = (link.events.clone(), link.mailbox.ended().clone());
    runtime.spawn(async move { ended.run_until_cancelled(events.announce()).await });
    let (sensors, ended) = (link.sensors.clone(), link.mailbox.ended().clone());
    runtime.spawn(async move { ended.run_until_cancelled(sensors.announce()).await });
    Ok(link)
}

/// Warns if prioritized step threads use every processor.
fn warn_of_starvation(threads: usize, real_time: &RealTime) {
    let processors = std::thread::available_parallelism().map_or(usize::MAX, std::num::NonZero::get);
    // Processors reserved for them leave the others free.
    let has_own = real_time.processors.numbers().next().is_some();
    if real_time.priority > 0 && !has_own && threads >= processors {
        tracing::warn!(
            threads,
            processors,
            "steps may use all processors, with a real-time priority: while the world runs as fast as possible (pace max), \
             clients get little time; lower `realtime.threads`"
        );
    }
}

/// Gives the world threads in addition to the calling physics thread.
fn lend_threads(world: &mut impl World, config: Config) {
    let count = step_threads::count(config.step_threads, &config.real_time);
    match StepThreads::start(count, config.real_time) {
        Ok(Some(threads)) => {
            tracing::debug!(
                threads = threads.count(),
                "steps may use threads in addition to the physics thread"
            );
            warn_of_starvation(threads.count(), &config.real_time);
            world.set_pool(threads);
        }
        Ok(None) => {}
        Err(error) => tracing::warn!(%error, "steps use only the physics thread"),
    }
}

/// Builds a driver without starting it.
fn build<W: World>(world: W, config: Config) -> (Driver<W>, Link) {
    let now = Instant::now();
    let (mailbox, mut inbox) = mailbox(config.mailbox);
    let spin = Duration::from_micros(config.spin_us.into());
    inbox.spin_for(spin);
    let mut state = PublishedState::default();
    world.observe(&mut state);
    let settings = world.settings();
    let publisher = Publisher::new(state, settings, Statistics::at_start(config.state, config.pace));
    let events = Arc::new(EventLog::new(config.events));
    let (sensors, sensor_writer) = SensorLog::new(publisher.state_cell().clone());
    let state_cell = publisher.state_cell().clone();
    let link = Link { mailbox, state_cell, events: events.clone(), sensors, callers: None, spin };
    let driver = Driver {
        world,
        inbox,
        publisher,
        events,
        sensors: sensor_writer,
        state: config.state,
        pace: config.pace,
        pacer: Pacer::new(period(config.pace, &settings), config.lag_limit, now),
        meter: Meter::new(now),
        obstructions: ObstructionWatch::default(),
        steps: StepQueue::new(config.waiting_steps),
        has_unpublished: false,
        iterations: 0,
        calls: CallBudget::default(),
        long_steps: LongSteps::default(),
        before_retry: 0,
        recorder_queue: None,
        relay: None,
    };
    (driver, link)
}

/// Runs until the driver is asked to end or fails. A panic ends the world, and its clients must still get an
/// answer, even if the cleanup fails too.
fn run<W: World>(mut driver: Driver<W>) {
    // Must be dropped last.
    let ending = driver.inbox.ending();
    sharpen_timer();
    let outcome = catch_unwind(AssertUnwindSafe(|| driver.run()));
    finish(driver, &ending, outcome);
}

/// Cleans up after the last event, or after a panic.
fn finish<W: World>(mut driver: Driver<W>, ending: &Ending, outcome: std::thread::Result<()>) {
    if outcome.is_ok() {
        driver.end_recorder_queue();
    }
    let Driver { world, inbox, steps, recorder_queue, relay, .. } = driver;
    drop(relay);
    if let Some(recorder_queue) = recorder_queue {
        recorder_queue.end(RecorderQueueEnd::DriverEnded);
    }
    let cleaned = catch_unwind(AssertUnwindSafe(|| drop(world)));
    if let Err(payload) = outcome.and(cleaned) {
        let failure = panic_message(payload.as_ref());
        ending.fail(&failure);
        tracing::error!(%failure, "the physics thread panicked; the daemon ends");
    }
    // Set before waiting callers wake, so that they find the reason.
    ending.end();
    drop((inbox, steps));
}

/// Sets the finest timer slack. Linux lets a sleeping thread sleep up to 50 us longer to save wake-ups, which
/// a step of 0.1 ms cannot afford.
fn sharpen_timer() {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::thread::set_current_timer_slack(std::num::NonZeroU64::new(1)) {
        tracing::debug!(%error, "the timer stays coarse");
    }
}

//! A thread between the physics thread and the runtime, used if the physics thread has a real-time priority.
//!
//! It sends answers to calls, and wakes the tasks that announce states, events and readings.
//!
//! Waking a task takes locks of the runtime. The scheduler may suspend a thread of normal priority for
//! milliseconds while it holds one, and the physics thread would wait for it. Unparking a thread takes no
//! lock.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{JoinHandle, Thread};

use crossbeam_queue::ArrayQueue;
use simd_core::simulation::Saved;
use simd_core::{Command, Moment, PhysicsSettings};

use super::event::ReplyTo;
use super::event_log::EventLog;
use super::published::{Done, Pace, Published, Stepped};
use super::published_state_cell::PublishedStateCell;
use super::realtime::{self, RealTime};
use super::sensor_log::SensorLog;
use crate::call_error::CallError;

/// The physics thread's end; dropping it ends the relay.
#[derive(Debug)]
pub(super) struct Relay {
    shared: Arc<Shared>,
    handle: Option<JoinHandle<()>>,
}

/// An answer and its receiver.
#[derive(Debug)]
pub(super) struct Addressed<T> {
    pub(super) reply: ReplyTo<T>,
    pub(super) answer: Result<T, CallError>,
}

/// An answer to a call.
#[derive(Debug)]
pub(super) enum Answer {
    Done(Addressed<Done>),
    /// Answer with its command, whose memory the physics thread then need not free.
    Applied(Addressed<Done>, Command),
    Stepped(Addressed<Stepped>),
    Physics(Addressed<(Done, PhysicsSettings, Pace)>),
    Moment(Addressed<Moment>),
    WholeState(Addressed<(Saved, Arc<Published>)>),
}

#[derive(Debug)]
struct Shared {
    answers: ArrayQueue<Answer>,
    state_cell: Arc<PublishedStateCell>,
    events: Arc<EventLog>,
    sensors: Arc<SensorLog>,
    thread: OnceLock<Thread>,
    is_over: AtomicBool,
}

impl Relay {
    /// Starts the thread with a priority right below the physics thread's, so that it sends answers promptly.
    /// If more than `room` answers wait, the physics thread sends its answers itself.
    ///
    /// # Errors
    /// Returns an error if the system refuses the thread.
    pub(super) fn start(
        (real_time, room): (RealTime, usize),
        state_cell: Arc<PublishedStateCell>,
        events: Arc<EventLog>,
        sensors: Arc<SensorLog>,
    ) -> std::io::Result<Self> {
        let answers = ArrayQueue::new(room.max(1));
        let (thread, is_over) = Default::default();
        let shared = Arc::new(Shared { answers, state_cell, events, sensors, thread, is_over });
        let served = Arc::clone(&shared);
        let priority = real_time.priority.saturating_sub(1).max(1);
        let handle = std::thread::Builder::new().name("simd-relay".into()).spawn(move || {
            realtime::ask_for_priority(priority);
            served.serve();
        })?;
        let thread = handle.thread();
        let _ = shared.thread.set(thread.clone());
        shared.state_cell.announcer().relay_by(thread.clone());
        shared.events.announcer().relay_by(thread.clone());
        shared.sensors.announcer().relay_by(thread.clone());
        Ok(Self { shared, handle: Some(handle) })
    }

    /// Answers a call.
    pub(super) fn answer(&self, answer: Answer) {
        match self.shared.answers.push(answer) {
            Ok(()) => self.shared.unpark(),
            Err(full) => full.send(),
        }
    }
}

/// All answers are sent before this returns, so that the daemon ends without unsent ones.
impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Release);
        self.shared.unpark();
        self.shared.send_answers();
        // The thread may hold answers that it has not sent yet. Callers look for theirs once the driver has
        // ended, and not later.
        if let Some(handle) = self.handle.take() {
            drop(handle.join());
        }
    }
}

impl Shared {
    fn unpark(&self) {
        if let Some(thread) = self.thread.get() {
            thread.unpark();
        }
    }

    fn send_answers(&self) {
        while let Some(answer) = self.answers.pop() {
            answer.send();
        }
    }

    fn serve(&self) {
        loop {
            // Read before the look: everything handed over before the end is served.
            let is_over = self.is_over.load(Ordering::Acquire);
            self.send_answers();
            self.state_cell.announcer().relay();
            self.events.announcer().relay();
            self.sensors.announcer().relay();
            if is_over {
                return;
            }
            std::thread::park();
        }
    }
}

impl Answer {
    /// A caller that has disconnected does not read its answer, which is not a fault.
    pub(super) fn send(self) {
        match self {
            Self::Done(answer) => answer.send(),
            Self::Applied(answer, _command) => answer.send(),
            Self::Stepped(answer) => answer.send(),
            Self::Physics(answer) => answer.send(),
            Self::Moment(answer) => answer.send(),
            Self::WholeState(answer) => answer.send(),
        }
    }
}

impl<T> Addressed<T> {
    fn send(self) {
        drop(self.reply.send(self.answer));
    }
}

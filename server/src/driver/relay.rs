//! A thread between the physics thread and the runtime, where the physics thread has a real-time priority.
//!
//! It sends answers to commands, and wakes those who announce states, events and readings. Other calls are rarer, and answered by the physics thread.
//!
//! To wake a task takes locks of the runtime. A thread without such a priority that holds one may be taken off its processor
//! for milliseconds, while the physics thread would wait for it. To unpark a thread takes no lock.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;

use crossbeam_queue::ArrayQueue;
use simd_core::Command;

use super::board::Board;
use super::event::ReplyTo;
use super::event_log::EventLog;
use super::published::Done;
use super::realtime::{self, RealTime};
use super::sensor_log::SensorLog;
use crate::call_error::CallError;

/// Answers that may wait; beyond them the physics thread sends its answers itself.
const MOST_ANSWERS: usize = 256;

/// The physics thread's end; the thread ends with it.
#[derive(Debug)]
pub(super) struct Relay(Arc<Shared>);

/// An answer to a command, and the command, whose memory the physics thread need not give back.
#[derive(Debug)]
struct Answer {
    reply: ReplyTo<Done>,
    answer: Result<Done, CallError>,
    _command: Command,
}

#[derive(Debug)]
struct Shared {
    answers: ArrayQueue<Answer>,
    board: Arc<Board>,
    events: Arc<EventLog>,
    sensors: Arc<SensorLog>,
    thread: OnceLock<Thread>,
    is_over: AtomicBool,
}

impl Relay {
    /// Starts the thread, with a priority right below that of the physics thread: what it hands over is not left lying.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(super) fn start(
        real_time: RealTime,
        board: Arc<Board>,
        events: Arc<EventLog>,
        sensors: Arc<SensorLog>,
    ) -> std::io::Result<Self> {
        let answers = ArrayQueue::new(MOST_ANSWERS);
        let (thread, is_over) = Default::default();
        let shared = Arc::new(Shared { answers, board, events, sensors, thread, is_over });
        let served = Arc::clone(&shared);
        let priority = real_time.priority.saturating_sub(1).max(1);
        let handle = std::thread::Builder::new().name("simd-relay".into()).spawn(move || {
            realtime::ask_for_priority(priority);
            served.serve();
        })?;
        let thread = handle.thread();
        let _ = shared.thread.set(thread.clone());
        shared.board.announcer().relay_by(thread.clone());
        shared.events.announcer().relay_by(thread.clone());
        shared.sensors.announcer().relay_by(thread.clone());
        Ok(Self(shared))
    }

    /// Answers a command.
    pub(super) fn answer(&self, reply: ReplyTo<Done>, answer: Result<Done, CallError>, command: Command) {
        match self.0.answers.push(Answer { reply, answer, _command: command }) {
            Ok(()) => self.0.unpark(),
            Err(full) => full.send(),
        }
    }
}

/// All answers are on their way then, so that the daemon ends with none left.
impl Drop for Relay {
    fn drop(&mut self) {
        self.0.is_over.store(true, Ordering::Release);
        self.0.unpark();
        self.0.send_answers();
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
            // Before the look: what was handed over before the end is served.
            let is_over = self.is_over.load(Ordering::Acquire);
            self.send_answers();
            self.board.announcer().relay();
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
    /// A caller that is gone does not read its answer, which is no fault.
    fn send(self) {
        drop(self.reply.send(self.answer));
    }
}

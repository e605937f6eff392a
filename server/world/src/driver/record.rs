//! The driver's output to the log of events, to a recorder, and to copies of the world.

use std::sync::Arc;

use simd_core::Moment;
use simd_core::simulation::Saved;

use super::event_log::{LogEvent, RecordingEnd};
use super::main_loop::Driver;
use super::published::Published;
use super::recorder_queue::{Entry, RecorderQueue, RecorderQueueEnd, WorldEntry};
use super::world::World;

impl<W: World> Driver<W> {
    pub(super) fn log(&mut self, what: LogEvent) {
        let (wall_time, state_sequence) = (std::time::SystemTime::now(), self.publisher.sequence());
        let event = self.events.push(wall_time, state_sequence, what);
        if self.recorder_queue.is_some() {
            self.record(Entry::Event(event));
        }
    }

    /// Passes an entry to the recorder, and ends the recording if it does not keep up.
    pub(super) fn record(&mut self, entry: Entry) {
        let Some(Err(end)) = self.recorder_queue.as_ref().map(|queue| queue.push(entry)) else { return };
        let Some(queue) = self.recorder_queue.take() else { return };
        // The writer may be waiting for the disk, so this thread logs the event. The writer reports all other
        // ends.
        if end == RecorderQueueEnd::Full {
            let recording = queue.name.to_string();
            let message = "its buffer is full: the disk is slower than the world".to_owned();
            tracing::error!(recording, "the recording ends: {message}");
            let (at, cause) = (self.world.now(), RecordingEnd::TooSlow);
            self.log(LogEvent::RecordingEnded { at, recording, cause, message });
        }
    }

    pub(super) fn record_world(&mut self) {
        let world = &self.world;
        let published = self.publisher.state_cell().newest();
        let entry =
            WorldEntry { at: world.now(), state: world.to_saved(), claims: world.claims(), published };
        self.record(Entry::World(Box::new(entry)));
    }

    /// Returns the whole state, and its published part. It costs as much as a save.
    pub(super) fn whole_state(&mut self) -> (Saved, Arc<Published>) {
        if self.has_unpublished {
            self.publish();
        }
        (self.world.to_saved(), self.publisher.state_cell().newest())
    }

    /// Replaces or ends the recorder; the last entry of each recorder is the whole world.
    pub(super) fn set_recorder_queue(&mut self, queue: Option<Arc<RecorderQueue>>) -> Moment {
        // The recorded world and the published one must have the same moment.
        if self.has_unpublished {
            self.publish();
        }
        if self.recorder_queue.is_some() {
            self.record_world();
        }
        if let Some(before) = self.recorder_queue.take() {
            before.end(RecorderQueueEnd::Stopped);
        }
        self.recorder_queue = queue;
        let at = self.world.now();
        if let Some(recording) = self.recorder_queue.as_ref().map(|queue| queue.name.to_string()) {
            self.record_world();
            self.log(LogEvent::RecordingStarted { at, recording });
        }
        at
    }

    /// Passes its last entry to the recorder.
    pub(super) fn end_recorder_queue(&mut self) {
        if self.recorder_queue.is_some() {
            self.record_world();
        }
        if let Some(queue) = self.recorder_queue.take() {
            queue.end(RecorderQueueEnd::DriverEnded);
        }
    }
}

//! The running recording, and the recordings on the disk.

use std::sync::Arc;

use simd_core::Moment;

use super::{CallError, Cancelled, SimHandle};
use crate::driver::{Event, RecorderQueueEnd};
use crate::recording::{RecordingContents, RecordingInfo, RecordingRequest, RecordingSources, Running};

impl SimHandle {
    /// Starts a recording: the whole present world, and everything from then on.
    ///
    /// # Errors
    /// Returns an error if no folder is configured, another recording runs, the name is taken, or the file
    /// cannot be created.
    pub async fn start_recording(
        &self,
        request: RecordingRequest,
    ) -> Result<(RecordingInfo, Moment), CallError> {
        self.check_robots(None)?;
        // A separate task, so that no recording is left without an owner if the caller disconnects.
        tokio::spawn(self.clone().begin_recording(request))
            .await
            .map_err(|error| CallError::Internal { message: error.to_string() })?
    }

    async fn begin_recording(self, request: RecordingRequest) -> Result<(RecordingInfo, Moment), CallError> {
        let sources = RecordingSources {
            daemon: self.inner.info.name.clone(),
            loader: Arc::clone(self.loader()),
            events: Arc::clone(&self.inner.driver.events),
            state_cell: Arc::clone(&self.inner.driver.state_cell),
            sensors: Arc::clone(&self.inner.driver.sensors),
            images: Box::new(self.camera_images()),
        };
        let _guard = self.inner.recording_lock.lock().await;
        let recordings = self.inner.recordings.clone();
        let begin = move || recordings.begin(request, sources);
        let Running { name, queue, done: _ } = self.loader().off_thread(&self.call.account, begin).await??;
        let begun = self.ask(|reply| Event::Record { queue: Some(Arc::clone(&queue)), reply }).await;
        let at = match begun {
            Ok(at) => at,
            Err(error) => {
                queue.end(RecorderQueueEnd::Stopped);
                return Err(error);
            }
        };
        tracing::info!(recording = &*name, "recording");
        Ok((self.recording(name.to_string()).await?, at))
    }

    /// Stops the recording with this name; an empty name means the running one. Returns when its file is
    /// complete.
    ///
    /// # Errors
    /// Returns an error if no recording with that name runs.
    pub async fn stop_recording(&self, name: &str) -> Result<(RecordingInfo, Moment), CallError> {
        self.check_robots(None)?;
        let guard = self.inner.recording_lock.lock().await;
        let running = self.inner.recordings.running();
        let Some(running) = running.filter(|running| name.is_empty() || *running.name == *name) else {
            let which =
                if name.is_empty() { "no recording".to_owned() } else { format!("no recording {name:?}") };
            return Err(CallError::RecordingNotPossible { message: format!("{which} is being made") });
        };
        let at = self.ask(|reply| Event::Record { queue: None, reply }).await?;
        drop(guard);
        running.done.cancelled().await;
        Ok((self.recording(running.name.to_string()).await?, at))
    }

    /// Waits until no recording runs, which the end of the driver ensures.
    pub async fn recording_ended(&self) {
        if let Some(running) = self.inner.recordings.running() {
            running.done.cancelled().await;
        }
    }

    /// Returns all recordings, by name.
    ///
    /// # Errors
    /// Returns an error if no folder is configured, or it cannot be read.
    pub async fn recordings(&self) -> Result<Vec<RecordingInfo>, CallError> {
        let recordings = self.inner.recordings.clone();
        self.loader().off_thread(&self.call.account, move || recordings.list()).await?
    }

    /// Returns a recording by its name.
    ///
    /// # Errors
    /// Returns an error if the recording does not exist.
    pub async fn recording(&self, name: String) -> Result<RecordingInfo, CallError> {
        let recordings = self.inner.recordings.clone();
        self.loader().off_thread(&self.call.account, move || recordings.find(&name)).await?
    }

    /// Returns a recording, and the contents of its files.
    ///
    /// # Errors
    /// Returns an error if the recording does not exist, or cannot be read.
    pub async fn recording_contents(
        &self,
        name: String,
    ) -> Result<(RecordingInfo, RecordingContents), CallError> {
        let recordings = self.inner.recordings.clone();
        let look = move |cancelled: &Cancelled| {
            let info = recordings.find(&name)?;
            let contents = recordings.contents(&info, &|| cancelled.is_set())?;
            Ok((info, contents))
        };
        // It reads whole files: loading robots does not wait for that.
        self.inner.recording_looks.run(&self.call.account, self.loader().threads(), look).await?
    }

    /// Returns a part of a recording's file, of at most `most` bytes, and the size of that file.
    ///
    /// # Errors
    /// Returns an error if the recording or the file does not exist.
    pub async fn read_recording(
        &self,
        name: String,
        file: String,
        offset: u64,
        most: usize,
    ) -> Result<(Vec<u8>, u64), CallError> {
        let recordings = self.inner.recordings.clone();
        self.loader()
            .off_thread(&self.call.account, move || recordings.read(&name, &file, offset, most))
            .await?
    }

    /// Deletes the files of a recording.
    ///
    /// # Errors
    /// Returns an error if the recording does not exist, or runs.
    pub async fn delete_recording(&self, name: String) -> Result<(), CallError> {
        self.check_robots(None)?;
        let recordings = self.inner.recordings.clone();
        self.loader().off_thread(&self.call.account, move || recordings.delete(&name)).await?
    }
}

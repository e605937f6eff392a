//! Recordings of the world: entries of the driver, which a separate thread writes into MCAP files, and their
//! replay.
//!
//! * Here: the running recording. `folder`: the recordings on the disk.
//! * `names`: names of recordings and of their files.
//! * `writer`: the thread. `file`: one file. `commands`: commands to and from bytes.
//! * `ros`: data for other tools. `readings`: readings of sensors; [`sensor_message`]: their ROS 2 messages.
//! * [`images`]: pictures of cameras; [`camera_message`]: their ROS 2 messages.
//! * `reading`: reads untrusted files. [`replay`]: repeats a run and compares it.

pub mod camera_message;
mod commands;
mod file;
mod folder;
pub(crate) mod images;
mod names;
mod reading;
mod readings;
pub mod replay;
mod ros;
pub mod sensor_message;
#[cfg(test)]
mod tests;
mod writer;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use simd_model::LoadReport;
use tokio_util::sync::CancellationToken;

pub use names::is_name;
pub use replay::{Changes, Comparison, Difference, Replayed, Variation, replay, replay_beside};
pub use ros::stamp;

use crate::call_error::CallError;
use crate::driver::{
    EventLog, LoggedEvent, LoggedReading, Published, PublishedStateCell, RecorderQueue, SensorLog,
};
use crate::loading::Loader;

/// Maximum bytes that wait for the disk.
const WAITING_BYTES: usize = 64 << 20;
/// Default limit of all recordings together, bytes.
pub const DEFAULT_MAX_BYTES: u64 = 10 << 30;
/// Default limit of pictures, bytes per second: 640 x 480 pixels in colour, 30 times per second.
const DEFAULT_PICTURE_BYTES: u64 = 32 << 20;

/// Settings of recordings.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Folder; `None` disables recordings.
    pub directory: Option<PathBuf>,
    /// Whether the first recording makes the folder.
    pub is_made: bool,
    /// Maximum bytes of all recordings together.
    pub max_bytes: u64,
    /// Maximum bytes per second of all cameras' pictures, before compression by the file; 0 disables
    /// pictures.
    pub picture_bytes: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            directory: None,
            is_made: false,
            max_bytes: DEFAULT_MAX_BYTES,
            picture_bytes: DEFAULT_PICTURE_BYTES,
        }
    }
}

/// Options of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingRequest {
    /// Name; if empty, the present time.
    pub name: String,
    /// Simulated seconds between recorded joint states and link poses; `None` disables them.
    pub state_period: Option<f64>,
    /// Minimum wall time that is kept; `None` keeps everything.
    pub keep_last: Option<Duration>,
    /// Maximum bytes of its files.
    pub max_bytes: Option<u64>,
    /// Wall time after which it ends.
    pub max_duration: Option<Duration>,
}

/// State of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingState {
    /// It is running.
    Recording,
    /// Its files are complete.
    Complete,
    /// Its last file is incomplete.
    Unfinished,
}

/// A recording on the disk.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingInfo {
    /// Name.
    pub name: String,
    /// State.
    pub state: RecordingState,
    /// Names and sizes of its files, in order.
    pub files: Vec<(String, u64)>,
    /// Time of the last write to the last file.
    pub modified: Option<SystemTime>,
}

/// Contents of the complete files of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordingContents {
    /// Topic, schema and number of messages.
    pub topics: Vec<(String, String, u64)>,
    /// Wall seconds from the first message to the last.
    pub duration: f64,
}

/// Encoders of messages of the schema: wire types are known only in a higher layer.
#[derive(Clone, Copy, Debug)]
pub struct Encoders {
    /// Encoder of `simd.v1.Event`.
    pub event: fn(&LoggedEvent) -> Vec<u8>,
    /// Encoder of `simd.v1.GetContactsResponse`.
    pub contacts: fn(&Published) -> Vec<u8>,
    /// Encoder of `simd.v1.LoadReport`, with its summary in one line.
    pub report: fn(&LoadReport, &str) -> Vec<u8>,
    /// Encoder of `simd.v1.SensorReading`.
    pub reading: fn(&LoggedReading) -> Vec<u8>,
}

/// Recordings of a daemon.
#[derive(Clone, Debug)]
pub struct Recordings {
    settings: Arc<Settings>,
    encoders: Encoders,
    /// The running recording. Locked for a look or a change.
    running: Arc<Mutex<Option<Running>>>,
}

/// A running recording.
#[derive(Clone, Debug)]
pub(crate) struct Running {
    pub(crate) name: Arc<str>,
    pub(crate) queue: Arc<RecorderQueue>,
    /// Cancelled when its last file is complete, or never will be.
    pub(crate) done: CancellationToken,
}

/// Parts of the daemon that a writer uses.
pub(crate) struct RecordingSources {
    pub(crate) daemon: String,
    pub(crate) loader: Arc<Loader>,
    pub(crate) events: Arc<EventLog>,
    pub(crate) state_cell: Arc<PublishedStateCell>,
    pub(crate) sensors: Arc<SensorLog>,
    pub(crate) images: Box<dyn images::ImageSource>,
}

impl Recordings {
    /// Manages the recordings in the folder of the settings.
    pub fn new(settings: Settings, encoders: Encoders) -> Self {
        Self { settings: Arc::new(settings), encoders, running: Arc::default() }
    }

    /// Makes the recordings of a daemon that cannot record.
    #[cfg(any(test, feature = "testing"))]
    pub fn none() -> Self {
        let encoders = Encoders {
            event: |_| Vec::new(),
            contacts: |_| Vec::new(),
            report: |_, _| Vec::new(),
            reading: |_| Vec::new(),
        };
        Self::new(Settings::default(), encoders)
    }

    fn lock(&self) -> MutexGuard<'_, Option<Running>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the running recording.
    pub(crate) fn running(&self) -> Option<Running> {
        self.lock().clone()
    }

    fn directory(&self) -> Result<&Path, CallError> {
        self.settings.directory.as_deref().ok_or_else(|| impossible(
            "the daemon has no folder for recordings, since it has no home; give it --recordings FOLDER, or `directory` in \
             [recording] of its configuration file",
        ))
    }

    /// Opens the first file, and starts the thread that writes it. The caller then connects its queue to the
    /// driver.
    ///
    /// # Errors
    /// Returns an error if no folder is configured, another recording runs, the name is taken, or the file
    /// cannot be created.
    pub(crate) fn begin(
        &self,
        request: RecordingRequest,
        sources: RecordingSources,
    ) -> Result<Running, CallError> {
        let directory = self.directory()?.to_owned();
        let name: Arc<str> = match request.name.as_str() {
            "" => names::of_time(SystemTime::now()).into(),
            name => name.into(),
        };
        let queue = Arc::new(RecorderQueue::new(name.clone(), WAITING_BYTES));
        let running = Running { name: name.clone(), queue, done: CancellationToken::new() };
        {
            let mut present = self.lock();
            if let Some(other) = &*present {
                return Err(impossible(format!("recording {:?} is being made; stop it first", other.name)));
            }
            *present = Some(running.clone());
        }
        let begun = self.start_writer(directory, request, sources, running.clone());
        if begun.is_err() {
            *self.lock() = None;
            // Callers that asked it to end in the meantime wait for this.
            running.done.cancel();
        }
        begun.map(|()| running)
    }

    fn start_writer(
        &self,
        directory: PathBuf,
        request: RecordingRequest,
        sources: RecordingSources,
        running: Running,
    ) -> Result<(), CallError> {
        let made = if self.settings.is_made { fs::create_dir_all(&directory) } else { Ok(()) };
        let there =
            made.and_then(|()| folder::list(&directory)).map_err(|error| unusable(&directory, &error))?;
        if there.iter().any(|other| *other.name == *running.name) {
            return Err(CallError::RecordingExists { name: running.name.to_string() });
        }
        let others: u64 = there.iter().flat_map(|other| &other.files).map(|(_, bytes)| bytes).sum();
        if others >= self.settings.max_bytes {
            return Err(CallError::LimitExceeded {
                what: "the size of all recordings in bytes".into(),
                value: others + 1,
                limit: self.settings.max_bytes,
            });
        }
        let all = self.settings.max_bytes - others;
        let max_bytes = request.max_bytes.map_or(all, |own| own.min(all));
        let plan = writer::Plan {
            directory: directory.clone(),
            name: running.name.clone(),
            state_period: request.state_period,
            keep_last: request.keep_last,
            max_bytes,
            max_duration: request.max_duration,
            picture_bytes: self.settings.picture_bytes,
        };
        let writer = writer::Writer::new(plan, sources, self.encoders, running.queue.clone());
        let writer = writer.map_err(|error| unusable(&directory, &error))?;
        let registry = self.clone();
        let thread = std::thread::Builder::new().name("simd-recorder".into());
        let spawned = thread.spawn(move || {
            crate::blocking_threads::lower_priority();
            writer.run();
            *registry.lock() = None;
            running.done.cancel();
        });
        spawned
            .map(drop)
            .map_err(|error| CallError::Internal { message: format!("there is no thread: {error}") })
    }
}

fn impossible(message: impl Into<String>) -> CallError {
    CallError::RecordingNotPossible { message: message.into() }
}

fn unusable(directory: &Path, error: &std::io::Error) -> CallError {
    impossible(format!("the folder for recordings, {}, cannot be used: {error}", directory.display()))
}

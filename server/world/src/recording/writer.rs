//! The thread that writes a recording: takes entries of the driver at intervals, and writes them. It flushes
//! often enough that a killed daemon loses less than a second.

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use simd_core::simulation::Saved;
use simd_model::robot::Sha256;
use simd_proto::v1;

use super::commands;
use super::file::{RecordingFile, Unwritten, nanos, stamp, topic};
use super::images::{self, Images};
use super::readings::Readings;
use super::ros::{States, topic_part};
use super::{Encoders, RecordingSources, names};
use crate::driver::{
    AppliedCommand, Entry, LogEvent, Published, RecorderQueue, RecorderQueueEnd, RecordingEnd, ReportEntry,
    WorldEntry,
};

/// Time between two looks for entries: the driver keeps memory for this many states at 1 kHz.
const CHECK_INTERVAL: Duration = Duration::from_millis(5);
/// Time between two flushes.
const FLUSH: Duration = Duration::from_millis(500);
/// Time between two records of the whole world.
const WORLD: Duration = Duration::from_secs(10);
/// Number of steps whose fingerprints are written together.
const STEPS: usize = 500;
/// Number of complete files in a ring, beside the one that is being filled.
const RING: u32 = 4;
/// Minimum duration of a file in a ring.
const SHORTEST: Duration = Duration::from_millis(250);

/// Selection of recorded data, and its destination.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) directory: PathBuf,
    pub(super) name: Arc<str>,
    /// Simulated seconds between states.
    pub(super) state_period: Option<f64>,
    pub(super) keep_last: Option<Duration>,
    /// Maximum bytes of all its files.
    pub(super) max_bytes: u64,
    pub(super) max_duration: Option<Duration>,
    /// Maximum bytes of pictures per second.
    pub(super) picture_bytes: u64,
}

/// Writer of a recording: see the module.
pub(super) struct Writer {
    plan: Plan,
    sources: RecordingSources,
    encoders: Encoders,
    queue: Arc<RecorderQueue>,
    file: RecordingFile,
    /// Number of the file, from 1.
    number: u64,
    /// Earlier files, with their sizes and end times, oldest first.
    older: VecDeque<(PathBuf, u64, Instant)>,
    /// Steps since the file began.
    steps: u64,
    /// Fingerprints of the last steps that are not written yet.
    fingerprints: Vec<u64>,
    last_step: Option<v1::Stamp>,
    /// Messages for other tools.
    shown: States,
    /// Readings of sensors; `None` if states are disabled.
    readings: Option<Readings>,
    /// Pictures of cameras; `None` if states or pictures are disabled.
    images: Option<Images>,
    /// Saved states with the hash of their encoding, for as long as the world has them.
    states: Vec<(Saved, Sha256)>,
    began: Instant,
    file_began: Instant,
    flushed: Instant,
    world: Instant,
    /// Whether the next whole world begins another file.
    wants_file: bool,
}

/// Cause of an early end.
struct Ended {
    cause: RecordingEnd,
    message: String,
}

impl From<Unwritten> for Ended {
    fn from(error: Unwritten) -> Self {
        Self { cause: RecordingEnd::WriteFailed, message: format!("it cannot be written: {error}") }
    }
}

impl From<io::Error> for Ended {
    fn from(error: io::Error) -> Self {
        Unwritten::from(error).into()
    }
}

impl Writer {
    /// Makes a writer with its first file.
    pub(super) fn new(
        plan: Plan,
        sources: RecordingSources,
        encoders: Encoders,
        queue: Arc<RecorderQueue>,
    ) -> io::Result<Self> {
        let file = create(&plan, &sources, 1)?;
        let now = Instant::now();
        let shown = States::new(plan.state_period);
        let newest = sources.state_cell.newest();
        let readings = plan.state_period.map(|_| Readings::begin(&sources.sensors, &newest));
        let images = plan.state_period.and_then(|_| Images::begin(plan.picture_bytes, &newest));
        Ok(Self {
            plan,
            sources,
            encoders,
            queue,
            file,
            number: 1,
            older: VecDeque::new(),
            steps: 0,
            fingerprints: Vec::with_capacity(STEPS),
            last_step: None,
            shown,
            readings,
            images,
            states: Vec::new(),
            began: now,
            file_began: now,
            flushed: now,
            world: now,
            wants_file: false,
        })
    }

    /// Writes until the queue ends, or a write fails.
    pub(super) fn run(mut self) {
        let mut entries = Vec::new();
        let end = loop {
            let end = self.queue.take_after(CHECK_INTERVAL, &mut entries);
            let mut written = Ok(());
            for entry in entries.drain(..) {
                // All entries are taken out, even those that are no longer written.
                if written.is_ok() {
                    written = self.entry(entry);
                }
            }
            // Written after the states that they belong to.
            let written = written.and_then(|()| self.readings());
            if let Err(ended) = written.and_then(|()| self.keep_up(Instant::now())) {
                // Later entries are dropped.
                self.queue.end(RecorderQueueEnd::Stopped);
                break ended;
            }
            match end {
                None => {}
                Some(RecorderQueueEnd::Stopped) => {
                    break Ended { cause: RecordingEnd::Stopped, message: "it was stopped".into() };
                }
                Some(RecorderQueueEnd::DriverEnded) => {
                    break Ended { cause: RecordingEnd::DaemonEnded, message: "the daemon ends".into() };
                }
                Some(RecorderQueueEnd::Full) => {
                    break Ended {
                        cause: RecordingEnd::TooSlow,
                        message: "the disk is slower than the world".into(),
                    };
                }
            }
        };
        self.finish(end);
    }

    fn finish(mut self, mut ended: Ended) {
        let is_written = ended.cause != RecordingEnd::WriteFailed;
        let completed = self.steps_done().map_err(Ended::from).and_then(|()| self.images_done());
        let completed = completed.and_then(|()| Ok(self.file.finish()?));
        if let (true, Err(failed)) = (is_written, completed) {
            ended = failed;
        }
        let Ended { cause, message } = ended;
        let recording = self.plan.name.to_string();
        match cause {
            RecordingEnd::Stopped | RecordingEnd::DaemonEnded => {
                tracing::info!(recording, "the recording ends: {message}")
            }
            _ => tracing::error!(recording, "the recording ends: {message}"),
        }
        // The driver, which does not wait for the disk, has already reported that the disk is too slow.
        if cause != RecordingEnd::TooSlow {
            let newest = self.sources.state_cell.newest();
            let what = LogEvent::RecordingEnded { at: newest.state.at, recording, cause, message };
            self.sources.events.push(SystemTime::now(), newest.sequence, what);
        }
    }

    fn entry(&mut self, entry: Entry) -> Result<(), Ended> {
        match entry {
            Entry::World(world) => self.world(*world),
            Entry::Applied(applied) => self.applied(&applied),
            Entry::Step(state) => self.step(&state),
            Entry::Report(report) => {
                self.file.time = nanos(SystemTime::now());
                let ReportEntry { robot, report, summary } = *report;
                let bytes = (self.encoders.report)(&report, &summary);
                let topic = format!("/{}/load_report", topic_part(&robot));
                Ok(self.file.write_encoded(&topic, "LoadReport", &bytes)?)
            }
            Entry::Event(event) => {
                self.file.time = nanos(event.wall_time);
                let bytes = (self.encoders.event)(&event);
                Ok(self.file.write_encoded(topic::EVENTS, "Event", &bytes)?)
            }
        }
    }

    fn world(&mut self, world: WorldEntry) -> Result<(), Ended> {
        self.steps_done()?;
        self.world = Instant::now();
        self.write_world(&world)?;
        if std::mem::take(&mut self.wants_file) {
            self.next_file()?;
            self.write_world(&world)?;
        }
        // The begin of a replay is flushed at once.
        Ok(self.file.flush()?)
    }

    fn write_world(&mut self, world: &WorldEntry) -> Result<(), Ended> {
        let WorldEntry { at, state, claims, published } = world;
        self.file.time = nanos(SystemTime::now());
        let loader = Arc::clone(&self.sources.loader);
        let state_sha256 = commands::keep_state(state, &loader, &mut self.file)?.to_string();
        let mut saved_states = Vec::new();
        let mut states = Vec::new();
        for kept in published.state.saved.iter() {
            let saved = kept.saved();
            let known = self.states.iter().find(|(known, _)| known == saved).map(|(_, sha256)| *sha256);
            // Another file needs it again.
            let sha256 = match known.filter(|sha256| self.file.has(sha256)) {
                Some(sha256) => sha256,
                None => commands::keep_state(saved, &loader, &mut self.file)?,
            };
            states.push((saved.clone(), sha256));
            let name = kept.info().name;
            saved_states.push(v1::RecordedSavedState { name, state_sha256: sha256.to_string() });
        }
        self.states = states;
        let claims =
            claims.iter().map(commands::encode_claim).collect::<Result<_, _>>().map_err(Unwritten::from)?;
        let message = v1::RecordedWorld {
            stamp: Some(stamp(*at, Some(published))),
            steps: self.steps,
            state_sha256,
            fingerprint: state.world_state().fingerprint(),
            saved_states,
            claims,
        };
        Ok(self.file.write_message(topic::WORLDS, "RecordedWorld", &message)?)
    }

    fn applied(&mut self, applied: &AppliedCommand) -> Result<(), Ended> {
        self.file.time = nanos(SystemTime::now());
        let loader = Arc::clone(&self.sources.loader);
        let message = v1::RecordedCommand {
            stamp: Some(stamp(applied.at, None)),
            steps: self.steps,
            ..commands::encode(applied, &loader, &mut self.file)?
        };
        Ok(self.file.write_message(topic::COMMANDS, "RecordedCommand", &message)?)
    }

    fn step(&mut self, state: &Published) -> Result<(), Ended> {
        self.file.time = nanos(state.wall_time);
        self.steps += 1;
        self.fingerprints.push(state.state.fingerprint());
        self.last_step = Some(stamp(state.state.at, Some(state)));
        if let Some(readings) = &mut self.readings {
            readings.step(state);
        }
        if self.shown.is_due(state) {
            let loader = Arc::clone(&self.sources.loader);
            self.shown.write(state, &loader, &mut self.file)?;
            let contacts = (self.encoders.contacts)(state);
            self.file.write_encoded(topic::CONTACTS, "GetContactsResponse", &contacts)?;
        }
        if self.fingerprints.len() >= STEPS { Ok(self.steps_done()?) } else { Ok(()) }
    }

    /// Writes new readings of sensors and pictures of cameras.
    fn readings(&mut self) -> Result<(), Ended> {
        let Some(readings) = &mut self.readings else { return Ok(()) };
        let newest = self.sources.state_cell.newest();
        readings.write(&self.sources.sensors, &newest, &self.encoders, &mut self.file)?;
        match &mut self.images {
            Some(images) => {
                Ok(images.keep_up(&*self.sources.images, &newest, Instant::now(), &mut self.file)?)
            }
            None => Ok(()),
        }
    }

    /// Writes the last pictures, and the summary of cameras into the file.
    fn images_done(&mut self) -> Result<(), Ended> {
        let Some(images) = &mut self.images else { return Ok(()) };
        let newest = self.sources.state_cell.newest();
        images.write(&*self.sources.images, &newest, Instant::now(), &mut self.file)?;
        Ok(self.file.add_summary(images::METADATA, &images.summary())?)
    }

    /// Writes the fingerprints of the last steps.
    fn steps_done(&mut self) -> io::Result<()> {
        if self.fingerprints.is_empty() {
            return Ok(());
        }
        let fingerprints = std::mem::replace(&mut self.fingerprints, Vec::with_capacity(STEPS));
        let steps = self.steps - fingerprints.len() as u64;
        let message = v1::RecordedSteps { steps, fingerprints, stamp: self.last_step };
        self.file.write_message(topic::STEPS, "RecordedSteps", &message)
    }

    /// Flushes, requests the whole world, begins another file and removes old ones when it is time.
    fn keep_up(&mut self, now: Instant) -> Result<(), Ended> {
        if now - self.flushed >= FLUSH {
            self.flushed = now;
            self.steps_done()?;
            self.file.flush()?;
        }
        if now - self.world >= WORLD {
            self.world = now;
            self.queue.ask_for_world();
        }
        let limit = |message| Err(Ended { cause: RecordingEnd::LimitReached, message });
        if let Some(longest) = self.plan.max_duration.filter(|longest| now - self.began >= *longest) {
            return limit(format!("it has been made for {} s, as it was asked to", longest.as_secs_f64()));
        }
        if let Some(keep) = self.plan.keep_last {
            if !self.wants_file && now - self.file_began >= (keep / RING).max(SHORTEST) {
                self.wants_file = true;
                self.queue.ask_for_world();
            }
            // The following file began when this one ended.
            while self.older.front().is_some_and(|(_, _, ended)| now - *ended > keep) {
                self.remove_oldest()?;
            }
        }
        while self.bytes() > self.plan.max_bytes {
            if self.older.is_empty() {
                return limit(format!("it has reached {} bytes, which is the limit", self.plan.max_bytes));
            }
            self.remove_oldest()?;
        }
        Ok(())
    }

    fn bytes(&self) -> u64 {
        self.older.iter().map(|(_, bytes, _)| bytes).sum::<u64>() + self.file.written()
    }

    fn remove_oldest(&mut self) -> io::Result<()> {
        match self.older.pop_front().map(|(path, _, _)| fs::remove_file(path)) {
            Some(Err(error)) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }

    fn next_file(&mut self) -> Result<(), Ended> {
        self.images_done()?;
        let next = create(&self.plan, &self.sources, self.number + 1)?;
        let before = std::mem::replace(&mut self.file, next);
        let (path, now) = (before.path.clone(), Instant::now());
        before.finish()?;
        let bytes = fs::metadata(&path)?.len();
        self.older.push_back((path, bytes, now));
        self.number += 1;
        self.steps = 0;
        self.shown.begin_file();
        if let Some(readings) = &mut self.readings {
            readings.begin_file();
        }
        if let Some(images) = &mut self.images {
            images.begin_file();
        }
        self.file_began = now;
        Ok(())
    }
}

fn create(plan: &Plan, sources: &RecordingSources, number: u64) -> io::Result<RecordingFile> {
    let file = match plan.keep_last {
        Some(_) => names::numbered(&plan.name, number),
        None => names::single(&plan.name),
    };
    RecordingFile::create(&plan.directory.join(file), &sources.daemon, &plan.name, number)
}

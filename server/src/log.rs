//! The log: lines wait in a bounded buffer, and a separate thread writes them to stderr.
//!
//! The reader of a log may be gone, or its disk full. A pipe or a stopped terminal may accept nothing for any
//! time. None of that may block, slow or fail the caller. So a line that finds no room, or that cannot be
//! written, is counted and lost. The count is written as soon as a write succeeds again.
//!
//! If stderr is the journal's stream, each line begins with its priority, as in `sd-daemon(3)`: the journal
//! removes it.

mod foreign;
#[cfg(test)]
mod tests;

use std::backtrace::{Backtrace, BacktraceStatus};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write};
use std::panic::PanicHookInfo;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use simd_proto::text;
use tracing::{Level, Metadata};
use tracing_subscriber::fmt::MakeWriter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime as _, SystemTime};

use self::foreign::{Foreign, Passage, crate_of};

/// Bytes that may wait; as many again are with the thread that writes.
const CAPACITY: usize = 1 << 20;
/// Additional capacity for messages that must not be lost: the reason for the process's end, and panics.
const RESERVE: usize = 64 << 10;
/// Size beyond which an empty buffer is freed, bytes.
const KEPT: usize = 64 << 10;
/// Time until the next attempt of a writer that was not ready.
const RETRY: Duration = Duration::from_millis(20);

/// Format of lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LogFormat {
    /// Text for people.
    #[default]
    Text,
    /// JSON for programs: an object per line, with `timestamp`, `level`, `target` and `fields`.
    Json,
}

/// The log. Clones are cheap, and the same log.
#[derive(Clone, Debug)]
pub struct Log(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// Notifies of new lines, and of an empty buffer.
    changed: Condvar,
    is_json: AtomicBool,
    /// Whether the journal reads it.
    is_journal: bool,
    foreign: Foreign,
}

#[derive(Debug, Default)]
struct State {
    waiting: Vec<u8>,
    is_writing: bool,
    /// Number of lost lines since the start.
    lost: u64,
    /// Number of lost lines that were reported.
    reported: u64,
}

impl Log {
    /// Makes a log that is written to stderr.
    ///
    /// # Errors
    /// Returns an error if the system refuses the thread.
    pub fn to_stderr() -> io::Result<Self> {
        Self::to(io::stderr(), stderr_is_journal())
    }

    /// Makes a log that is written to `out`.
    fn to(out: impl Write + Send + 'static, is_journal: bool) -> io::Result<Self> {
        let log = Self(Arc::new(Shared {
            state: Mutex::default(),
            changed: Condvar::new(),
            is_json: AtomicBool::new(false),
            is_journal,
            foreign: Foreign::default(),
        }));
        let shared = log.0.clone();
        std::thread::Builder::new().name("simd-log".into()).spawn(move || shared.write_to(out))?;
        Ok(log)
    }

    /// Sets the format of lines from now on.
    pub fn set_format(&self, format: LogFormat) {
        self.0.is_json.store(format == LogFormat::Json, Ordering::Relaxed);
    }

    /// Adds one or several lines that must not be lost: they have a reserve of room.
    pub fn say(&self, text: &str) {
        let line = match self.0.is_json.load(Ordering::Relaxed) {
            true => json("ERROR", text),
            false => format!("{text}\n"),
        };
        self.0.push(&self.0.prefixed(Level::ERROR, line.as_bytes().into()), CAPACITY + RESERVE);
    }

    /// Waits until all is written, at most for this time; returns whether it is.
    pub fn flush(&self, within: Duration) -> bool {
        let state = self.0.lock();
        let is_open = |state: &mut State| state.is_writing || !state.waiting.is_empty();
        let waited = self.0.changed.wait_timeout_while(state, within, is_open);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    /// Logs panics from here on. The default hook waits for stderr.
    pub fn take_panics(&self) {
        let log = self.clone();
        std::panic::set_hook(Box::new(move |panic| {
            let stamp = if log.0.is_json.load(Ordering::Relaxed) { String::new() } else { stamp("ERROR") };
            log.say(&(stamp + &sentence(panic)));
        }));
    }
}

/// Returns whether stderr is the stream that systemd made for the journal. `JOURNAL_STREAM` alone is not
/// enough: a program that redirects the stderr of its child leaves the variable unchanged.
#[cfg(unix)]
fn stderr_is_journal() -> bool {
    use std::fs::File;
    use std::os::fd::AsFd as _;
    use std::os::unix::fs::MetadataExt as _;

    let Ok(stream) = std::env::var("JOURNAL_STREAM") else { return false };
    let stderr = io::stderr().as_fd().try_clone_to_owned().and_then(|stderr| File::from(stderr).metadata());
    stderr.is_ok_and(|stderr| stream == format!("{}:{}", stderr.dev(), stderr.ino()))
}

#[cfg(not(unix))]
fn stderr_is_journal() -> bool {
    false
}

/// Returns the priority of a line in syslog's form, which precedes the line.
fn priority(level: Level) -> &'static [u8] {
    match level {
        Level::ERROR => b"<3>",
        Level::WARN => b"<4>",
        Level::INFO => b"<6>",
        _ => b"<7>",
    }
}

/// Returns the message and the location of a panic. A hook that panics aborts the process, so nothing here
/// can: it takes only the buffer's lock, and does not call `tracing`.
fn sentence(panic: &PanicHookInfo<'_>) -> String {
    let thread = std::thread::current();
    let mut text = String::new();
    let what = panic.payload_as_str().unwrap_or("(no message)");
    let _ = write!(text, "thread `{}` panicked", thread.name().unwrap_or("unnamed"));
    if let Some(location) = panic.location() {
        let _ = write!(text, " at {location}");
    }
    let _ = write!(text, ": {what}");
    // If RUST_BACKTRACE requests it.
    let trace = Backtrace::capture();
    if trace.status() == BacktraceStatus::Captured {
        let _ = write!(text, "\n{trace}");
    }
    text
}

/// Returns a line of a log for programs, in the form of the others.
fn json(level: &str, message: &str) -> String {
    let mut timestamp = String::new();
    let _ = SystemTime.format_time(&mut Writer::new(&mut timestamp));
    let fields = serde_json::json!({ "message": message });
    let line = serde_json::json!({
        "timestamp": timestamp, "level": level, "fields": fields, "target": "simd_server::log",
    });
    format!("{line}\n")
}

/// Returns the beginning of a line, in the form of the others.
fn stamp(level: &str) -> String {
    let mut text = String::new();
    let _ = SystemTime.format_time(&mut Writer::new(&mut text));
    let _ = write!(text, " {level:>5} simd_server::log: ");
    text
}

impl Shared {
    /// Locks the state. No code waits under this lock.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds the priority to lines if the journal reads them. A line break within a message begins another
    /// line of the journal, which needs its own priority: so no message can set its priority itself.
    fn prefixed<'t>(&self, level: Level, text: Cow<'t, [u8]>) -> Cow<'t, [u8]> {
        if !self.is_journal {
            return text;
        }
        let prefix = priority(level);
        let mut prefixed = Vec::with_capacity(text.len() + prefix.len());
        for line in text.split_inclusive(|&byte| byte == b'\n') {
            prefixed.extend_from_slice(prefix);
            prefixed.extend_from_slice(line);
        }
        Cow::Owned(prefixed)
    }

    /// Returns a line about lost lines that were not reported.
    fn notice(&self, state: &State) -> Option<Vec<u8>> {
        let lost = state.lost;
        (lost != state.reported).then(|| {
            let sentence = format!("lines of this log that could not be written since the start: {lost}");
            let line = match self.is_json.load(Ordering::Relaxed) {
                true => json("WARN", &sentence),
                false => format!("{}{sentence}\n", stamp("WARN")),
            };
            self.prefixed(Level::WARN, line.into_bytes().into()).into_owned()
        })
    }

    /// Adds a line about lines of a crate that came too fast.
    fn note_left_out(&self, target: &str, count: u64) {
        let sentence =
            format!("lines of {} that were left out, since there were too many: {count}", crate_of(target));
        let line = match self.is_json.load(Ordering::Relaxed) {
            true => json("WARN", &sentence),
            false => format!("{}{sentence}\n", stamp("WARN")),
        };
        self.push(&self.prefixed(Level::WARN, line.into_bytes().into()), CAPACITY);
    }

    fn push(&self, text: &[u8], capacity: usize) {
        let mut state = self.lock();
        let notice = self.notice(&state);
        let length = text.len() + notice.as_ref().map_or(0, Vec::len);
        if state.waiting.len() + length > capacity {
            state.lost += lines(text);
            return;
        }
        if let Some(notice) = notice {
            state.waiting.extend_from_slice(&notice);
            state.reported = state.lost;
        }
        state.waiting.extend_from_slice(text);
        self.changed.notify_all();
    }

    /// Runs the writing thread, for as long as the process lives.
    fn write_to(&self, mut out: impl Write) {
        let mut chunk = Vec::new();
        let (mut is_line_open, mut is_well) = (false, true);
        loop {
            self.next_chunk(&mut chunk, is_well);
            if is_line_open {
                chunk.insert(0, b'\n');
            }
            let left = write_all(&mut out, &chunk);
            let written = &chunk[..chunk.len() - left.len()];
            is_well = left.is_empty();
            is_line_open = written.last().map_or(is_line_open, |&byte| byte != b'\n');
            self.lock().lost += lines(left);
            if chunk.capacity() > KEPT {
                chunk = Vec::new();
            }
        }
    }

    /// Waits for the next bytes. If the previous ones were written, the loss of lines is reported without
    /// waiting for another line.
    fn next_chunk(&self, chunk: &mut Vec<u8>, is_well: bool) {
        chunk.clear();
        let mut state = self.lock();
        if state.waiting.is_empty()
            && is_well
            && let Some(notice) = self.notice(&state)
        {
            state.reported = state.lost;
            state.waiting.extend_from_slice(&notice);
        }
        if state.waiting.is_empty() {
            state.is_writing = false;
            self.changed.notify_all();
            let waited = self.changed.wait_while(state, |state| state.waiting.is_empty());
            state = waited.unwrap_or_else(PoisonError::into_inner);
        }
        state.is_writing = true;
        std::mem::swap(&mut state.waiting, chunk);
    }
}

/// Writes until it is done or fails; returns the unwritten bytes.
fn write_all<'a>(out: &mut impl Write, mut bytes: &'a [u8]) -> &'a [u8] {
    while !bytes.is_empty() {
        match out.write(bytes) {
            Ok(0) => break,
            Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(RETRY),
            Err(_) => break,
        }
    }
    bytes
}

fn lines(text: &[u8]) -> u64 {
    text.iter().filter(|&&byte| byte == b'\n').count() as u64
}

/// Removes characters that a terminal would obey or hide: the log contains untrusted names. Colours begin
/// with an escape, and `tracing-subscriber` removes escapes from messages.
fn shown(line: &[u8]) -> Cow<'_, [u8]> {
    let may_stay = |c: char| matches!(c, '\n' | '\t' | '\x1b') || text::is_printable(c);
    if line.iter().all(|&byte| byte.is_ascii() && may_stay(char::from(byte))) {
        return Cow::Borrowed(line);
    }
    Cow::Owned(text::escaped(&String::from_utf8_lossy(line), may_stay).into_owned().into_bytes())
}

/// One event, as `tracing-subscriber` writes it: complete, and never refused.
#[derive(Debug)]
pub struct Line<'a> {
    shared: &'a Shared,
    level: Level,
    is_left_out: bool,
}

impl Write for Line<'_> {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        if self.is_left_out {
            return Ok(text.len());
        }
        // JSON is for programs, and has its escapes.
        let is_json = self.shared.is_json.load(Ordering::Relaxed);
        let shown = if is_json { Cow::Borrowed(text) } else { shown(text) };
        self.shared.push(&self.shared.prefixed(self.level, shown), CAPACITY);
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for Log {
    type Writer = Line<'a>;

    fn make_writer(&'a self) -> Line<'a> {
        Line { shared: &self.0, level: Level::INFO, is_left_out: false }
    }

    fn make_writer_for(&'a self, event: &Metadata<'_>) -> Line<'a> {
        let passage = self.0.foreign.passage(event, Instant::now());
        if let Passage::Written(left_out @ 1..) = passage {
            self.0.note_left_out(event.target(), left_out);
        }
        Line { shared: &self.0, level: *event.level(), is_left_out: passage == Passage::LeftOut }
    }
}

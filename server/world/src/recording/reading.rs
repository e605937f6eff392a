//! Reads untrusted recordings: records are in order, files are checked against their hashes, and memory is
//! bounded.

use std::collections::BTreeMap;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use simd_assets::files;
use simd_mcap::{Item, ReadLimits, Reader};
use simd_model::robot::Sha256;
use simd_proto::v1;

use super::RecordingContents;
use super::commands::{invalid, message};
use super::file::{FORMAT, METADATA, topic};
use crate::call_error::CallError;
use crate::loading::Files;

/// Maximum bytes of all files of a recording at one time, robots' meshes and worlds.
const MAX_FILE_BYTES: u64 = 1 << 30;
/// Last bytes of an MCAP file.
const END: &[u8; 8] = b"\x89MCAP0\r\n";

/// Cause of an unreadable recording.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unreadable {
    /// The MCAP file is invalid.
    #[error("{0}")]
    Mcap(#[from] simd_mcap::Error),
    /// The recording is invalid.
    #[error("{0}")]
    Recording(#[from] CallError),
    /// The file has another format, or is not a recording.
    #[error("{0}")]
    Foreign(String),
}

/// Next record for the replay.
#[derive(Debug)]
pub(super) enum Record {
    World(v1::RecordedWorld),
    Command(v1::RecordedCommand),
    Steps(v1::RecordedSteps),
}

/// A recording that is being read.
#[derive(Debug)]
pub(super) struct Recording<R> {
    reader: Reader<R>,
    pub(super) metadata: BTreeMap<String, String>,
    /// Complete files.
    pub(super) files: Files,
    partial: BTreeMap<Sha256, Vec<u8>>,
    /// Bytes of both.
    held: u64,
}

impl<R: Read> Recording<R> {
    /// Reads up to the metadata that marks a recording.
    pub(super) fn open(input: R) -> Result<Self, Unreadable> {
        let mut reader = Reader::new(input, ReadLimits::default())?;
        let foreign = || {
            Unreadable::Foreign(format!(
                "it is not a recording of simd: it does not begin with the metadata {METADATA}"
            ))
        };
        let metadata = match reader.next()? {
            Some(Item::Metadata { name, metadata }) if name == METADATA => metadata,
            _ => return Err(foreign()),
        };
        let format: u32 =
            metadata.get("format").and_then(|format| format.parse().ok()).ok_or_else(foreign)?;
        if format != FORMAT {
            let newer =
                if format > FORMAT { "; it was made by a newer release: replay it with that" } else { "" };
            return Err(Unreadable::Foreign(format!(
                "the recording is of format {format}, and this release reads only {FORMAT}{newer}"
            )));
        }
        let (files, partial) = Default::default();
        Ok(Self { reader, metadata, files, partial, held: 0 })
    }

    /// Returns the next record; `None` after the last.
    pub(super) fn next(&mut self) -> Result<Option<Record>, Unreadable> {
        while let Some(item) = self.reader.next()? {
            let Item::Message { channel, time: _, data } = item else { continue };
            match channel.topic.as_str() {
                topic::FILES => {
                    let part: v1::RecordedFile = message(data)?;
                    self.part(part)?;
                }
                topic::WORLDS => return Ok(Some(Record::World(message(data)?))),
                topic::COMMANDS => return Ok(Some(Record::Command(message(data)?))),
                topic::STEPS => return Ok(Some(Record::Steps(message(data)?))),
                _ => {}
            }
        }
        Ok(None)
    }

    fn part(&mut self, part: v1::RecordedFile) -> Result<(), CallError> {
        let v1::RecordedFile { sha256, total_bytes, offset, data } = part;
        let name: String = sha256.chars().take(64).collect();
        let sha256 = Sha256::parse(&sha256).ok_or_else(|| invalid(&format!("{name:?} is not a SHA-256")))?;
        if self.files.contains_key(&sha256) {
            return Ok(());
        }
        self.held = self.held.saturating_add(data.len() as u64);
        if self.held.max(total_bytes) > MAX_FILE_BYTES {
            let what = "the size of all files in the recording in bytes".into();
            let value = self.held.max(total_bytes);
            return Err(CallError::LimitExceeded { what, value, limit: MAX_FILE_BYTES });
        }
        let partial = self.partial.entry(sha256).or_default();
        if partial.len() as u64 != offset || offset + data.len() as u64 > total_bytes {
            return Err(invalid(&format!("the parts of file {name} do not fit")));
        }
        partial.extend(data);
        if partial.len() as u64 == total_bytes {
            let whole = self.partial.remove(&sha256).unwrap_or_default();
            if Sha256::of(&whole) != sha256 {
                return Err(invalid(&format!("file {name} does not have that hash")));
            }
            self.files.insert(sha256, whole.into());
        }
        Ok(())
    }

    /// Drops a file that no later record names.
    pub(super) fn forget(&mut self, sha256: &str) {
        let file = Sha256::parse(sha256).and_then(|sha256| self.files.remove(&sha256));
        self.held -= file.map_or(0, |file| file.len() as u64);
    }
}

/// Returns whether a file is complete, by its last bytes.
pub(super) fn is_complete(folder: &Path, name: &str) -> bool {
    let end = || {
        let mut file = files::open_in(folder, name)?;
        let mut end = [0; END.len()];
        file.seek(SeekFrom::End(-8))?;
        file.read_exact(&mut end)?;
        io::Result::Ok((end, file.metadata()?.len()))
    };
    end().is_ok_and(|(end, bytes)| end == *END && bytes > 16)
}

/// Returns the contents of files in a folder, as far as they are readable.
pub(super) fn contents<'n>(
    folder: &Path,
    names: impl IntoIterator<Item = &'n str>,
    is_cancelled: &dyn Fn() -> bool,
) -> io::Result<RecordingContents> {
    let mut topics: BTreeMap<String, (String, u64)> = BTreeMap::new();
    let mut span: Option<(u64, u64)> = None;
    for name in names {
        let file = BufReader::new(files::open_in(folder, name)?);
        let Ok(mut reader) = Reader::new(file, ReadLimits::default()) else { continue };
        // The rest of an unreadable file is unknown.
        while let Ok(Some(item)) = reader.next() {
            if is_cancelled() {
                return Err(io::Error::other("the call was cancelled"));
            }
            let Item::Message { channel, time, data: _ } = item else { continue };
            let (start, end) = span.get_or_insert((time, time));
            (*start, *end) = ((*start).min(time), (*end).max(time));
            match topics.get_mut(&channel.topic) {
                Some((_, count)) => *count += 1,
                None => {
                    let schema = channel.schema.as_ref().map(|schema| schema.name.clone());
                    topics.insert(channel.topic.clone(), (schema.unwrap_or_default(), 1));
                }
            }
        }
    }
    let duration = span.map_or(0.0, |(start, end)| (end - start) as f64 * 1e-9);
    let topics = topics.into_iter().map(|(topic, (schema, count))| (topic, schema, count));
    Ok(RecordingContents { topics: topics.collect(), duration })
}

//! One file of a recording: its channels, and the files that messages name.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use prost::Message;
use prost_types::{FileDescriptorSet, Timestamp};
use simd_core::Moment;
use simd_mcap::Writer;
use simd_model::robot::Sha256;
use simd_proto::v1;

use super::commands::KeepFile;
use crate::call_error::CallError;
use crate::driver::Published;

/// Name of the metadata that marks a file as a recording.
pub(super) const METADATA: &str = "simd.recording";
/// The format that is written and read.
pub(super) const FORMAT: u32 = 6;
/// Bytes of a part of a file.
const PART: usize = 1 << 20;

/// Topics for the replay.
pub(super) mod topic {
    pub(crate) const FILES: &str = "/simd/files";
    pub(crate) const WORLDS: &str = "/simd/worlds";
    pub(crate) const COMMANDS: &str = "/simd/commands";
    pub(crate) const STEPS: &str = "/simd/steps";
    pub(crate) const EVENTS: &str = "/simd/events";
    pub(crate) const CONTACTS: &str = "/simd/contacts";
}

/// Cause of a failed write.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unwritten {
    /// The disk failed.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The daemon refused.
    #[error("{0}")]
    Call(#[from] CallError),
}

/// A file that is being written.
#[derive(Debug)]
pub(super) struct RecordingFile {
    writer: Writer<BufWriter<File>>,
    pub(super) path: PathBuf,
    /// Time of the next messages, nanoseconds since 1970.
    pub(super) time: u64,
    channels: BTreeMap<String, u16>,
    schemas: BTreeMap<String, u16>,
    /// Files that it contains.
    kept: BTreeSet<Sha256>,
}

impl RecordingFile {
    /// Creates a file.
    pub(super) fn create(path: &Path, daemon: &str, recording: &str, number: u64) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        let release = env!("CARGO_PKG_VERSION");
        let mut writer = Writer::new(BufWriter::new(file), "ros2", &format!("simd {release}"))?;
        let metadata = [
            ("format", FORMAT.to_string()),
            ("release", release.to_owned()),
            ("daemon", daemon.to_owned()),
            ("recording", recording.to_owned()),
            ("file", number.to_string()),
        ];
        let metadata = metadata.map(|(key, value)| (key.to_owned(), value));
        writer.add_metadata(METADATA, &BTreeMap::from(metadata))?;
        writer.flush()?;
        let (channels, schemas, kept) = Default::default();
        Ok(Self { writer, path: path.to_owned(), time: 0, channels, schemas, kept })
    }

    /// Returns whether it contains a file.
    pub(super) fn has(&self, sha256: &Sha256) -> bool {
        self.kept.contains(sha256)
    }

    /// Returns the bytes handed over to the disk.
    pub(super) fn written(&self) -> u64 {
        self.writer.written()
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    /// Adds a summary of its contents, unless the summary is empty.
    pub(super) fn add_summary(&mut self, name: &str, summary: &BTreeMap<String, String>) -> io::Result<()> {
        if summary.is_empty() { Ok(()) } else { self.writer.add_metadata(name, summary) }
    }

    pub(super) fn finish(self) -> io::Result<()> {
        let buffer = self.writer.finish()?;
        let file = buffer.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.sync_data()
    }

    /// Returns the channel of a topic, and creates it at first use.
    pub(super) fn channel(
        &mut self,
        topic: &str,
        encoding: &str,
        metadata: impl FnOnce() -> BTreeMap<String, String>,
        (name, schema_encoding): (&str, &str),
        schema: impl FnOnce() -> Vec<u8>,
    ) -> io::Result<u16> {
        if let Some(channel) = self.channels.get(topic) {
            return Ok(*channel);
        }
        let schema = match self.schemas.get(name) {
            Some(schema) => *schema,
            None => {
                let added = self.writer.add_schema(name, schema_encoding, &schema())?;
                self.schemas.insert(name.to_owned(), added);
                added
            }
        };
        let channel = self.writer.add_channel(schema, topic, encoding, &metadata())?;
        self.channels.insert(topic.to_owned(), channel);
        Ok(channel)
    }

    pub(super) fn write(&mut self, channel: u16, data: &[u8]) -> io::Result<()> {
        self.writer.write(channel, self.time, data)
    }

    /// Writes an encoded message of the schema.
    pub(super) fn write_encoded(&mut self, topic: &str, message: &str, data: &[u8]) -> io::Result<()> {
        let name = format!("simd.v1.{message}");
        let schema = || descriptors(&name);
        let channel = self.channel(topic, "protobuf", BTreeMap::new, (&name, "protobuf"), schema)?;
        self.write(channel, data)
    }

    pub(super) fn write_message(
        &mut self,
        topic: &str,
        name: &str,
        message: &impl Message,
    ) -> io::Result<()> {
        self.write_encoded(topic, name, &message.encode_to_vec())
    }
}

impl KeepFile for RecordingFile {
    type Error = Unwritten;

    fn keep(
        &mut self,
        sha256: Sha256,
        bytes: impl FnOnce() -> Result<Vec<u8>, CallError>,
    ) -> Result<(), Unwritten> {
        if self.kept.contains(&sha256) {
            return Ok(());
        }
        let bytes = bytes()?;
        let mut offset = 0;
        loop {
            let part = bytes.get(offset..bytes.len().min(offset + PART)).unwrap_or_default();
            let message = v1::RecordedFile {
                sha256: sha256.to_string(),
                total_bytes: bytes.len() as u64,
                offset: offset as u64,
                data: part.to_vec(),
            };
            self.write_message(topic::FILES, "RecordedFile", &message)?;
            offset += part.len();
            if offset >= bytes.len() {
                break;
            }
        }
        self.kept.insert(sha256);
        Ok(())
    }
}

/// Returns nanoseconds since 1970.
pub(super) fn nanos(time: SystemTime) -> u64 {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// Returns the stamp of a moment, with the known facts about its publication.
pub(super) fn stamp(at: Moment, published: Option<&Published>) -> v1::Stamp {
    let timestamp = |state: &Published| {
        let nanos = nanos(state.wall_time);
        let (seconds, nanos) = (nanos / 1_000_000_000, nanos % 1_000_000_000);
        Timestamp {
            seconds: i64::try_from(seconds).unwrap_or(i64::MAX),
            nanos: i32::try_from(nanos).unwrap_or(0),
        }
    };
    v1::Stamp {
        epoch: at.epoch,
        step: at.step,
        sim_time: at.sim_time,
        wall_time: published.map(timestamp),
        sequence: published.map_or(0, |state| state.sequence),
    }
}

/// Returns the schema's file with this message, and the files that it imports.
fn descriptors(message: &str) -> Vec<u8> {
    let Ok(all) = FileDescriptorSet::decode(v1::FILE_DESCRIPTOR_SET) else { return Vec::new() };
    let short = message.trim_start_matches("simd.v1.");
    let has = |file: &&prost_types::FileDescriptorProto| {
        file.package() == "simd.v1" && file.message_type.iter().any(|it| it.name() == short)
    };
    let mut wanted: Vec<String> =
        all.file.iter().find(has).map(|file| file.name().to_owned()).into_iter().collect();
    let mut next = 0;
    while let Some(name) = wanted.get(next) {
        let imports = all.file.iter().find(|file| file.name() == name).map(|file| file.dependency.clone());
        for import in imports.unwrap_or_default() {
            if !wanted.contains(&import) {
                wanted.push(import);
            }
        }
        next += 1;
    }
    let mut file = all.file;
    file.retain(|file| wanted.iter().any(|wanted| wanted == file.name()));
    // Comments are most of their size.
    file.iter_mut().for_each(|file| file.source_code_info = None);
    FileDescriptorSet { file }.encode_to_vec()
}

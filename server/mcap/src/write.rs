//! Writes a file from its first byte to its last, without going back.

use std::collections::BTreeMap;
use std::io::{self, Write};

use lz4_flex::frame::FrameEncoder;

use crate::record::{Builder, LZ4, MAGIC, op};

/// Size in bytes at which a chunk ends.
const CHUNK: usize = 1 << 20;
/// Maximum number of chunks in a file: the index at the end has some hundred bytes for each.
const MAX_CHUNKS: usize = 1_000_000;

/// Writer of a file. Flushed data can be read even if the file is never completed.
#[derive(Debug)]
pub struct Writer<W> {
    out: W,
    /// Bytes that were written.
    written: u64,
    /// Records of the current chunk.
    chunk: Vec<u8>,
    /// First and last time of its messages; `None` while it has none.
    times: Option<(u64, u64)>,
    /// Messages of the chunk by channel: their times, and positions in the chunk.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
    /// Records, as in the chunks, for the end.
    schemas: Vec<Vec<u8>>,
    channels: Vec<Vec<u8>>,
    /// Number of messages of each channel.
    messages: Vec<u64>,
    chunks: Vec<ChunkIndex>,
    metadata: Vec<(u64, u64, String)>,
    /// First and last time of all messages.
    span: Option<(u64, u64)>,
}

#[derive(Debug)]
struct ChunkIndex {
    times: (u64, u64),
    start: u64,
    length: u64,
    /// Beginning of the index of each channel's messages.
    indexes: BTreeMap<u16, u64>,
    indexes_length: u64,
    compressed: u64,
    uncompressed: u64,
}

impl<W: Write> Writer<W> {
    /// Begins a file; `profile` is the kind of recording (`ros2`), `library` the writing program.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn new(out: W, profile: &str, library: &str) -> io::Result<Self> {
        let mut writer = Self {
            out,
            written: 0,
            chunk: Vec::new(),
            times: None,
            index: BTreeMap::new(),
            schemas: Vec::new(),
            channels: Vec::new(),
            messages: Vec::new(),
            chunks: Vec::new(),
            metadata: Vec::new(),
            span: None,
        };
        writer.put(MAGIC)?;
        writer.put(&Builder::default().text(profile).text(library).record(op::HEADER))?;
        Ok(writer)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.out.write_all(bytes)?;
        self.written += bytes.len() as u64;
        Ok(())
    }

    /// Returns the bytes that were written so far, without the current chunk.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Returns the number of messages of each channel so far, by its number less 1.
    pub fn messages(&self) -> &[u64] {
        &self.messages
    }

    /// Adds a schema; returns its number. The maximum is 65,535.
    ///
    /// # Errors
    /// Returns an error above the maximum.
    pub fn add_schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> io::Result<u16> {
        let id = next_id(self.schemas.len(), "schemas")?;
        let record = Builder::default().u16(id).text(name).text(encoding).bytes(data).record(op::SCHEMA);
        self.chunk.extend(&record);
        self.schemas.push(record);
        Ok(id)
    }

    /// Adds a channel; returns its number. `schema` 0 means none.
    ///
    /// # Errors
    /// Returns an error above the maximum of 65,535.
    pub fn add_channel(
        &mut self,
        schema: u16,
        topic: &str,
        encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> io::Result<u16> {
        let id = next_id(self.channels.len(), "channels")?;
        let channel = Builder::default().u16(id).u16(schema).text(topic).text(encoding).map(metadata);
        let record = channel.record(op::CHANNEL);
        self.chunk.extend(&record);
        self.channels.push(record);
        self.messages.push(0);
        Ok(id)
    }

    /// Adds a message of a channel; `time` in nanoseconds since 1970.
    ///
    /// # Errors
    /// Returns an error if there is no such channel, or if the chunk that it fills cannot be written.
    pub fn write(&mut self, channel: u16, time: u64, data: &[u8]) -> io::Result<()> {
        let count = channel.checked_sub(1).and_then(|index| self.messages.get_mut(usize::from(index)));
        let Some(count) = count else {
            return Err(io::Error::other(format!("there is no channel {channel}")));
        };
        *count += 1;
        let sequence = u32::try_from(*count & u64::from(u32::MAX)).unwrap_or(0);
        let offset = self.chunk.len() as u64;
        let header = Builder::default().u16(channel).u32(sequence).u64(time).u64(time).0;
        self.chunk.push(op::MESSAGE);
        self.chunk.extend((header.len() as u64 + data.len() as u64).to_le_bytes());
        self.chunk.extend(header);
        self.chunk.extend(data);
        self.index.entry(channel).or_default().push((time, offset));
        widen(&mut self.times, time);
        widen(&mut self.span, time);
        if self.chunk.len() >= CHUNK { self.end_chunk() } else { Ok(()) }
    }

    /// Writes all that was added, so that it can be read even if the file is never completed.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.end_chunk()?;
        self.out.flush()
    }

    fn end_chunk(&mut self) -> io::Result<()> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        if self.chunks.len() >= MAX_CHUNKS {
            return Err(io::Error::other(format!("the file has {MAX_CHUNKS} chunks, which is the limit")));
        }
        let mut encoder = FrameEncoder::new(Vec::with_capacity(self.chunk.len() / 2));
        encoder.write_all(&self.chunk)?;
        let compressed = encoder.finish().map_err(io::Error::other)?;
        let times = self.times.take().unwrap_or_default();
        let (start, uncompressed) = (self.written, self.chunk.len() as u64);
        let head = Builder::default()
            .u64(times.0)
            .u64(times.1)
            .u64(uncompressed)
            .u32(crc32fast::hash(&self.chunk))
            .text(LZ4)
            .u64(compressed.len() as u64);
        let length = head.0.len() as u64 + compressed.len() as u64;
        self.put(&Builder::default().u8(op::CHUNK).u64(length).0)?;
        self.put(&head.0)?;
        self.put(&compressed)?;
        let (end, mut indexes) = (self.written, BTreeMap::new());
        for (channel, messages) in std::mem::take(&mut self.index) {
            indexes.insert(channel, self.written);
            let entries = messages.iter().fold(Builder::default(), |it, (time, at)| it.u64(*time).u64(*at));
            let record = Builder::default().u16(channel).bytes(&entries.0).record(op::MESSAGE_INDEX);
            self.put(&record)?;
        }
        self.chunks.push(ChunkIndex {
            times,
            start,
            length: end - start,
            indexes,
            indexes_length: self.written - end,
            compressed: compressed.len() as u64,
            uncompressed,
        });
        self.chunk.clear();
        Ok(())
    }

    /// Adds metadata of the file.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn add_metadata(&mut self, name: &str, metadata: &BTreeMap<String, String>) -> io::Result<()> {
        let record = Builder::default().text(name).map(metadata).record(op::METADATA);
        self.end_chunk()?;
        self.metadata.push((self.written, record.len() as u64, name.to_owned()));
        self.put(&record)
    }

    /// Completes the file, and returns its output.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        self.put(&Builder::default().u32(0).record(op::DATA_END))?;
        let summary_start = self.written;
        let statistics = self.statistics();
        let mut groups = Vec::new();
        let mut summary = Vec::new();
        for (opcode, records) in [
            (op::SCHEMA, std::mem::take(&mut self.schemas)),
            (op::CHANNEL, std::mem::take(&mut self.channels)),
            (op::STATISTICS, vec![statistics]),
            (op::CHUNK_INDEX, self.chunks.iter().map(ChunkIndex::record).collect()),
            (op::METADATA_INDEX, self.metadata.iter().map(metadata_index).collect()),
        ] {
            let start = summary_start + summary.len() as u64;
            records.iter().for_each(|record| summary.extend(record));
            let length = summary_start + summary.len() as u64 - start;
            if length > 0 {
                groups.push(Builder::default().u8(opcode).u64(start).u64(length).record(op::SUMMARY_OFFSET));
            }
        }
        let offsets_start = summary_start + summary.len() as u64;
        groups.iter().for_each(|record| summary.extend(record));
        // The checksum covers the summary and the footer up to here.
        let footer = Builder::default().u8(op::FOOTER).u64(20).u64(summary_start).u64(offsets_start);
        summary.extend(footer.0);
        let checksum = crc32fast::hash(&summary);
        summary.extend(checksum.to_le_bytes());
        summary.extend(MAGIC);
        self.put(&summary)?;
        self.out.flush()?;
        Ok(self.out)
    }

    fn statistics(&self) -> Vec<u8> {
        let (start, end) = self.span.unwrap_or_default();
        let count = |list: usize| u32::try_from(list).unwrap_or(u32::MAX);
        let by_channel = (1u16..).zip(&self.messages);
        let by_channel =
            by_channel.fold(Builder::default(), |it, (channel, count)| it.u16(channel).u64(*count));
        Builder::default()
            .u64(self.messages.iter().sum())
            .u16(u16::try_from(self.schemas.len()).unwrap_or(u16::MAX))
            .u32(count(self.channels.len()))
            .u32(0)
            .u32(count(self.metadata.len()))
            .u32(count(self.chunks.len()))
            .u64(start)
            .u64(end)
            .bytes(&by_channel.0)
            .record(op::STATISTICS)
    }
}

impl ChunkIndex {
    fn record(&self) -> Vec<u8> {
        let indexes =
            self.indexes.iter().fold(Builder::default(), |it, (channel, at)| it.u16(*channel).u64(*at));
        Builder::default()
            .u64(self.times.0)
            .u64(self.times.1)
            .u64(self.start)
            .u64(self.length)
            .bytes(&indexes.0)
            .u64(self.indexes_length)
            .text(LZ4)
            .u64(self.compressed)
            .u64(self.uncompressed)
            .record(op::CHUNK_INDEX)
    }
}

fn metadata_index((start, length, name): &(u64, u64, String)) -> Vec<u8> {
    Builder::default().u64(*start).u64(*length).text(name).record(op::METADATA_INDEX)
}

fn next_id(there: usize, what: &str) -> io::Result<u16> {
    u16::try_from(there + 1)
        .map_err(|_| io::Error::other(format!("the file has {there} {what}, which is the limit")))
}

fn widen(span: &mut Option<(u64, u64)>, time: u64) {
    let (start, end) = span.get_or_insert((time, time));
    (*start, *end) = ((*start).min(time), (*end).max(time));
}

//! Reads a file from its first byte to its last. Its contents are not trusted: memory is bounded before it is
//! allocated. An incomplete file is read up to its end.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::sync::Arc;

use lz4_flex::frame::FrameDecoder;

use crate::record::{Fields, LZ4, MAGIC, op};

/// Limits of a file.
#[derive(Clone, Copy, Debug)]
pub struct ReadLimits {
    /// Bytes of one record.
    pub record: usize,
    /// Bytes of one chunk once it is decompressed.
    pub chunk: usize,
    /// Bytes of all schemas and channels together.
    pub definitions: usize,
}

impl Default for ReadLimits {
    /// Limits far above what the writer writes.
    fn default() -> Self {
        Self { record: 32 << 20, chunk: 64 << 20, definitions: 16 << 20 }
    }
}

/// Reason why a file cannot be read further.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// It is another kind of file.
    #[error("it does not begin like an MCAP file")]
    NotMcap,
    /// It was not completed, or its end is lost.
    #[error("it ends at byte {at}, before it is complete")]
    EndsEarly {
        /// End of the last whole record.
        at: u64,
    },
    /// Its contents are invalid.
    #[error("it is damaged at byte {at}: {what}")]
    Damaged {
        /// Beginning of the record, or of its chunk.
        at: u64,
        /// For instance "the checksum of a chunk is wrong".
        what: String,
    },
    /// A size is above its limit.
    #[error("at byte {at}, {what} would be {value} bytes, and the limit is {limit}")]
    TooLarge {
        /// Beginning of the record.
        at: u64,
        /// For instance "a chunk".
        what: &'static str,
        /// Size in the file.
        value: u64,
        /// Limit.
        limit: usize,
    },
    /// The system failed to read it.
    #[error("it cannot be read: {0}")]
    Io(io::Error),
}

/// Format of a channel's messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// For instance `sensor_msgs/msg/JointState`.
    pub name: String,
    /// For instance `ros2msg`.
    pub encoding: String,
    /// Contents in that encoding.
    pub data: Vec<u8>,
}

/// A channel of messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Number of the channel.
    pub id: u16,
    /// For instance `/joint_states`.
    pub topic: String,
    /// For instance `cdr`.
    pub encoding: String,
    /// Further metadata.
    pub metadata: BTreeMap<String, String>,
    /// `None` if the file has none.
    pub schema: Option<Arc<Schema>>,
}

/// Next item of a file.
#[derive(Debug)]
pub enum Item<'r> {
    /// A message.
    Message {
        /// Channel of the message.
        channel: &'r Arc<Channel>,
        /// Nanoseconds since 1970.
        time: u64,
        /// In the channel's encoding.
        data: &'r [u8],
    },
    /// Metadata of the file.
    Metadata {
        /// Name of the record.
        name: String,
        /// Its entries.
        metadata: BTreeMap<String, String>,
    },
}

/// Reader of a file.
#[derive(Debug)]
pub struct Reader<R> {
    input: R,
    limits: ReadLimits,
    /// Bytes that were read.
    position: u64,
    /// Beginning of the present record.
    start: u64,
    record: Vec<u8>,
    chunk: Vec<u8>,
    /// Beginning of the next record in the chunk.
    in_chunk: usize,
    schemas: BTreeMap<u16, Arc<Schema>>,
    channels: BTreeMap<u16, Arc<Channel>>,
    /// Bytes of both.
    definitions: usize,
    is_complete: bool,
}

/// A message within a chunk or a record.
struct Found {
    channel: u16,
    time: u64,
    /// Beginning of its data.
    data: usize,
    end: usize,
    is_in_chunk: bool,
}

impl<R: Read> Reader<R> {
    /// Begins with a file's first byte.
    ///
    /// # Errors
    /// Returns an error if it is not an MCAP file.
    pub fn new(input: R, limits: ReadLimits) -> Result<Self, Error> {
        let mut reader = Self {
            input,
            limits,
            position: 0,
            start: 0,
            record: Vec::new(),
            chunk: Vec::new(),
            in_chunk: 0,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            definitions: 0,
            is_complete: false,
        };
        let mut magic = [0; 8];
        match reader.fill(&mut magic) {
            Ok(()) if magic == *MAGIC => Ok(reader),
            Ok(()) | Err(Error::EndsEarly { .. }) => Err(Error::NotMcap),
            Err(error) => Err(error),
        }
    }

    /// Returns the number of bytes that were read.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Returns whether the file was read to its end-of-data record.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Returns the next message or metadata; `None` after the last.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read further; later calls fail too.
    #[expect(clippy::should_implement_trait, reason = "what it gives borrows from it")]
    pub fn next(&mut self) -> Result<Option<Item<'_>>, Error> {
        let found = loop {
            if self.is_complete {
                return Ok(None);
            }
            if self.in_chunk < self.chunk.len() {
                match self.next_in_chunk()? {
                    Some(found) => break found,
                    None => continue,
                }
            }
            let opcode = self.read_record()?;
            match opcode {
                op::DATA_END => self.is_complete = true,
                op::FOOTER => return Err(self.damaged("a footer comes before the end of the data")),
                // Kinds from 0x80 on are for private use.
                0 | 0x10..0x80 => return Err(self.damaged("there is no such kind of record")),
                op::CHUNK => self.open_chunk()?,
                op::METADATA => {
                    let mut fields = Fields(&self.record);
                    let read = fields.text().map(str::to_owned).zip(fields.map());
                    let (name, metadata) = read.ok_or_else(|| self.damaged("metadata that ends early"))?;
                    return Ok(Some(Item::Metadata { name, metadata }));
                }
                op::MESSAGE => break self.message(0, self.record.len(), false)?,
                op::SCHEMA | op::CHANNEL => {
                    let record = std::mem::take(&mut self.record);
                    self.define(opcode, &record)?;
                    self.record = record;
                }
                _ => {}
            }
        };
        let Some(channel) = self.channels.get(&found.channel) else {
            return Err(
                self.damaged(&format!("a message is of channel {}, which is not known", found.channel))
            );
        };
        let bytes = if found.is_in_chunk { &self.chunk } else { &self.record };
        let data = bytes.get(found.data..found.end).unwrap_or_default();
        Ok(Some(Item::Message { channel, time: found.time, data }))
    }

    fn damaged(&self, what: &str) -> Error {
        Error::Damaged { at: self.start, what: what.to_owned() }
    }

    fn fill(&mut self, buffer: &mut [u8]) -> Result<(), Error> {
        self.input.read_exact(buffer).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => Error::EndsEarly { at: self.start },
            _ => Error::Io(error),
        })?;
        self.position += buffer.len() as u64;
        Ok(())
    }

    /// Reads into the record's memory, which grows with the bytes and not with the claimed length.
    fn read_record(&mut self) -> Result<u8, Error> {
        self.start = self.position;
        let mut head = [0; 9];
        self.fill(&mut head)?;
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let limit = self.limits.record;
        if length > limit as u64 {
            return Err(Error::TooLarge { at: self.start, what: "a record", value: length, limit });
        }
        self.record.clear();
        let read = (&mut self.input).take(length).read_to_end(&mut self.record).map_err(Error::Io)?;
        self.position += read as u64;
        if (read as u64) < length {
            return Err(Error::EndsEarly { at: self.start });
        }
        Ok(opcode)
    }

    fn open_chunk(&mut self) -> Result<(), Error> {
        let mut fields = Fields(&self.record);
        let head = (|| {
            let _times = (fields.u64()?, fields.u64()?);
            let (size, checksum) = (fields.u64()?, fields.u32()?);
            let compression = fields.text()?;
            let length = usize::try_from(fields.u64()?).ok()?;
            Some((size, checksum, compression, fields.take(length)?))
        })();
        let (size, checksum, compression, records) =
            head.ok_or_else(|| self.damaged("the head of a chunk ends early"))?;
        let limit = self.limits.chunk;
        if size > limit as u64 {
            return Err(Error::TooLarge { at: self.start, what: "a chunk", value: size, limit });
        }
        self.chunk.clear();
        self.in_chunk = 0;
        let mut chunk = std::mem::take(&mut self.chunk);
        let read = match compression {
            "" => records.take(size + 1).read_to_end(&mut chunk),
            // Reads one byte more than the claimed size, to detect a larger chunk.
            LZ4 => FrameDecoder::new(records).take(size + 1).read_to_end(&mut chunk),
            other => {
                let other: String = other.chars().take(40).collect();
                return Err(
                    self.damaged(&format!("a chunk is compressed with {other:?}, and only lz4 is read"))
                );
            }
        };
        if let Err(error) = read {
            return Err(self.damaged(&format!("a chunk cannot be decompressed: {error}")));
        }
        if chunk.len() as u64 != size {
            return Err(self.damaged("a chunk has another size than it declares"));
        }
        if checksum != 0 && crc32fast::hash(&chunk) != checksum {
            return Err(self.damaged("the checksum of a chunk is wrong"));
        }
        self.chunk = chunk;
        Ok(())
    }

    fn next_in_chunk(&mut self) -> Result<Option<Found>, Error> {
        let ends = || self.damaged("a chunk ends in a record");
        let mut fields = Fields(self.chunk.get(self.in_chunk..).unwrap_or_default());
        let (opcode, length) = fields.u8().zip(fields.u64()).ok_or_else(ends)?;
        let length =
            usize::try_from(length).ok().filter(|length| *length <= fields.0.len()).ok_or_else(ends)?;
        let begin = self.in_chunk + 9;
        self.in_chunk = begin + length;
        match opcode {
            op::MESSAGE => self.message(begin, begin + length, true).map(Some),
            op::SCHEMA | op::CHANNEL => {
                let chunk = std::mem::take(&mut self.chunk);
                self.define(opcode, chunk.get(begin..begin + length).unwrap_or_default())?;
                self.chunk = chunk;
                Ok(None)
            }
            _ => Ok(None),
        }
    }

    fn message(&self, begin: usize, end: usize, is_in_chunk: bool) -> Result<Found, Error> {
        let bytes = if is_in_chunk { &self.chunk } else { &self.record };
        let mut fields = Fields(bytes.get(begin..end).unwrap_or_default());
        let head = (|| {
            let (channel, _sequence) = (fields.u16()?, fields.u32()?);
            let (time, _published) = (fields.u64()?, fields.u64()?);
            Some(Found { channel, time, data: end - fields.0.len(), end, is_in_chunk })
        })();
        head.ok_or_else(|| self.damaged("a message ends early"))
    }

    fn define(&mut self, opcode: u8, record: &[u8]) -> Result<(), Error> {
        // A map takes many times its bytes.
        self.definitions = self.definitions.saturating_add(record.len());
        let limit = self.limits.definitions;
        if self.definitions > limit {
            let value = self.definitions as u64;
            return Err(Error::TooLarge { at: self.start, what: "schemas and channels", value, limit });
        }
        let mut fields = Fields(record);
        let defined = (|| {
            let id = fields.u16()?;
            if opcode == op::SCHEMA {
                let (name, encoding) = (fields.text()?.to_owned(), fields.text()?.to_owned());
                let data = fields.bytes()?.to_vec();
                self.schemas.entry(id).or_insert_with(|| Arc::new(Schema { name, encoding, data }));
            } else {
                let schema = self.schemas.get(&fields.u16()?).cloned();
                let (topic, encoding) = (fields.text()?.to_owned(), fields.text()?.to_owned());
                let channel = Channel { id, topic, encoding, metadata: fields.map()?, schema };
                self.channels.entry(id).or_insert_with(|| Arc::new(channel));
            }
            Some(())
        })();
        defined.ok_or_else(|| self.damaged("a schema or a channel ends early"))
    }
}

#[cfg(test)]
mod tests;

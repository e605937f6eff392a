//! Checks how much memory a message needs before it is decoded.
//!
//! Two bytes on the wire may become hundreds: an empty message in a list is a struct of all its fields. So a
//! request is first walked through by its schema, without allocating, to sum the memory of its lists, maps
//! and texts. Decoding then takes at most [`most`] bytes.

use std::marker::PhantomData;

use bytes::Buf as _;
use prost::Message;
use prost::encoding::{WireType, decode_key, decode_varint};
use tonic::Status;
use tonic::codec::{BufferSettings, Codec, DecodeBuf, Decoder};
use tonic_prost::{ProstDecoder, ProstEncoder};

/// Bytes of memory for each byte of a request.
const FACTOR: usize = 4;
/// Bytes of memory that every request may take: targets for some fifty thousand joints in one call.
const FREE: usize = 32 << 20;
/// Maximum depth of nested messages. The schema needs less.
const MAX_DEPTH: usize = 16;
/// A list doubles, holds at least four and is copied when it grows. At the worst moment it takes at most four
/// times the size of its elements.
const LIST: usize = 4;
/// A map consists of nodes of eleven entries; the first of them may hold one.
const MAP: usize = 12;
/// Overhead of an allocation in addition to the requested size.
const ALLOCATION: usize = 32;

/// A message of the schema with its shape.
pub trait Known: Message + Default {
    /// Name of the message, without its package.
    const NAME: &'static str;
    /// Fields of the message.
    const SHAPE: &'static Shape;
    /// Whether the message is a request: requests are checked, and a daemon's answers are not.
    const IS_REQUEST: bool;
}

/// A request that may carry an id, by which a repetition of it is recognised.
pub trait Identified: Known {
    /// Returns the request's id; empty for none.
    fn request_id(&self) -> &str;

    /// Claim that the request acts for; empty for none.
    fn claim(&self) -> &str {
        ""
    }
}

/// The fields of a message.
#[derive(Debug)]
pub struct Shape {
    /// Sorted by number.
    fields: &'static [Field],
}

#[derive(Debug)]
struct Field {
    number: u32,
    kind: Kind,
    /// Size of one value, or of a key and a value, without the memory that they point to.
    size: usize,
    inside: Inside,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// A single value, stored in its message.
    One,
    List,
    Map,
}

#[derive(Debug)]
enum Inside {
    /// Numbers with this many bytes each, or of variable length.
    Numbers(Option<usize>),
    Bytes,
    Message(&'static Shape),
}

include!("generated/shapes.rs");

/// A request's name and its decoder.
pub type Request = (&'static str, fn(&[u8]) -> Result<(), Refused>);

/// Returns every request of the schema.
pub fn requests() -> &'static [Request] {
    REQUESTS
}

/// Reason why a message is not decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// The bytes are not a message.
    #[error("the bytes are not a message")]
    Malformed,
    /// Decoding it would take more memory than it may.
    #[error("{bytes} bytes would take more than {most} bytes of memory; send fewer elements in one message")]
    TooMuch {
        /// Size of the message.
        bytes: usize,
        /// Maximum memory for a message of this size.
        most: usize,
    },
}

/// Returns the maximum memory that decoding a message of `bytes` may take.
pub fn most(bytes: usize) -> usize {
    bytes.saturating_mul(FACTOR).saturating_add(FREE)
}

/// Checks that a message is well-formed, and that decoding it takes at most [`most`].
///
/// # Errors
/// Returns an error if it is not, or takes more.
pub fn check(shape: &Shape, bytes: &[u8]) -> Result<(), Refused> {
    let most = most(bytes.len());
    let mut scales = Scales { left: most };
    match scales.message(shape, bytes, MAX_DEPTH) {
        Ok(()) => Ok(()),
        Err(Stop::Malformed) => Err(Refused::Malformed),
        Err(Stop::Empty) => Err(Refused::TooMuch { bytes: bytes.len(), most }),
    }
}

/// Decodes an untrusted message.
///
/// # Errors
/// Returns an error if the bytes are not a message, or decoding them could take more than [`most`].
pub fn decode<M: Known>(bytes: &[u8]) -> Result<M, Refused> {
    check(M::SHAPE, bytes)?;
    M::decode(bytes).map_err(|_| Refused::Malformed)
}

/// Memory that remains for a message.
struct Scales {
    left: usize,
}

enum Stop {
    Malformed,
    Empty,
}

impl Scales {
    fn take(&mut self, bytes: usize) -> Result<(), Stop> {
        self.left = self.left.checked_sub(bytes).ok_or(Stop::Empty)?;
        Ok(())
    }

    /// Refuses bytes that are not a message. The decoder cannot do this: it reads the length of a field
    /// before it finds that the field is cut off.
    fn message(&mut self, shape: &Shape, mut rest: &[u8], depth: usize) -> Result<(), Stop> {
        let depth = depth.checked_sub(1).ok_or(Stop::Malformed)?;
        while !rest.is_empty() {
            let (number, wire) = decode_key(&mut rest).map_err(|_| Stop::Malformed)?;
            let found = shape.fields.binary_search_by_key(&number, |field| field.number);
            let field = found.ok().and_then(|index| shape.fields.get(index));
            let length = match wire {
                WireType::Varint => {
                    decode_varint(&mut rest).map_err(|_| Stop::Malformed)?;
                    0
                }
                WireType::SixtyFourBit => 8,
                WireType::ThirtyTwoBit => 4,
                WireType::LengthDelimited => {
                    let length = decode_varint(&mut rest).map_err(|_| Stop::Malformed)?;
                    usize::try_from(length).map_err(|_| Stop::Malformed)?
                }
                // Groups were removed in the third version of the language.
                WireType::StartGroup | WireType::EndGroup => return Err(Stop::Malformed),
            };
            let (value, behind) = rest.split_at_checked(length).ok_or(Stop::Malformed)?;
            rest = behind;
            if let Some(field) = field {
                self.field(field, wire, value, depth)?;
            }
        }
        Ok(())
    }

    fn field(&mut self, field: &Field, wire: WireType, value: &[u8], depth: usize) -> Result<(), Stop> {
        let is_packed = wire == WireType::LengthDelimited;
        let count = match &field.inside {
            Inside::Numbers(Some(size)) if is_packed => value.len() / size,
            // The last byte of a varint is the one without its highest bit.
            Inside::Numbers(None) if is_packed => value.iter().filter(|byte| **byte < 0x80).count(),
            Inside::Numbers(_) | Inside::Bytes | Inside::Message(_) => 1,
        };
        self.take(match field.kind {
            Kind::One => 0,
            Kind::List => LIST.saturating_mul(field.size).saturating_mul(count),
            Kind::Map => MAP.saturating_mul(field.size).saturating_add(ALLOCATION),
        })?;
        match field.inside {
            Inside::Message(shape) => self.message(shape, value, depth),
            Inside::Bytes if !value.is_empty() => self.take(value.len().saturating_add(ALLOCATION)),
            Inside::Bytes | Inside::Numbers(_) => Ok(()),
        }
    }
}

/// Prost's codec, which checks requests before it decodes them.
#[derive(Clone, Debug)]
pub struct CheckedCodec<T, U>(PhantomData<(T, U)>);

impl<T, U> Default for CheckedCodec<T, U> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<T, U> Codec for CheckedCodec<T, U>
where
    T: Message + Send + 'static,
    U: Known + Send + 'static,
{
    type Encode = T;
    type Decode = U;
    type Encoder = ProstEncoder<T>;
    type Decoder = CheckedDecoder<U>;

    fn encoder(&mut self) -> Self::Encoder {
        ProstEncoder::default()
    }

    fn decoder(&mut self) -> Self::Decoder {
        CheckedDecoder(ProstDecoder::default())
    }
}

/// The decoder of [`CheckedCodec`].
#[derive(Clone, Debug)]
pub struct CheckedDecoder<U>(ProstDecoder<U>);

impl<U: Known + Send + 'static> Decoder for CheckedDecoder<U> {
    type Item = U;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<U>, Status> {
        if U::IS_REQUEST {
            let whole = buffer.chunk();
            if whole.len() < buffer.remaining() {
                return Err(Status::internal("the message lies in pieces"));
            }
            check(U::SHAPE, whole).map_err(|refused| match refused {
                Refused::Malformed => Status::internal(refused.to_string()),
                Refused::TooMuch { .. } => Status::resource_exhausted(refused.to_string()),
            })?;
        }
        self.0.decode(buffer)
    }

    fn buffer_settings(&self) -> BufferSettings {
        self.0.buffer_settings()
    }
}

#[cfg(test)]
mod tests;

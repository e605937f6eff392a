//! [MCAP](https://mcap.dev/spec), the container of robot recordings: as much of it as simd writes, and as it takes to read
//! that back from an untrusted file.
//!
//! * [`Writer`]: chunks compressed with LZ4, each whole in the file once it is flushed; indexes and statistics at the end.
//! * [`Reader`]: from the first byte to the last, within [`ReadLimits`], also where the file ends early.
//!
//! Not here: attachments, compression with zstd, and reading by an index.

mod read;
mod record;
mod write;

pub use read::{Channel, Error, Item, ReadLimits, Reader, Schema};
pub use write::Writer;

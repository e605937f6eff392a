//! [MCAP](https://mcap.dev/spec), the container format of robot recordings: the parts that simd writes, and a
//! reader of these for untrusted files.
//!
//! * [`Writer`]: chunks compressed with LZ4, each complete in the file once it is flushed; indexes and
//!   statistics at the end.
//! * [`Reader`]: reads from the first byte to the last, within [`ReadLimits`], including files that end
//!   early.
//!
//! Not supported: attachments, compression with zstd, and reading by an index.

mod read;
mod record;
mod write;

pub use read::{Channel, Error, Item, ReadLimits, Reader, Schema};
pub use write::Writer;

//! ROS 2 messages as bytes and as text, and the names that `rmw_zenoh` uses to carry them. Does no IO: the
//! caller has the network or the file.
//!
//! * [`message`]: traits of messages, services and fields, and the macro that declares them.
//! * [`messages`]: the types, one module per ROS package.
//! * [`cdr`]: encoding and decoding of values, as in `rmw` implementations.
//! * [`definition`]: the text of a type, as in MCAP's `ros2msg` schemas.
//! * [`type_hash`][]: RIHS01.
//! * `latin`: transliteration of names.
//! * [`wire`]: keys, liveliness tokens, quality of service and attachments of `rmw_zenoh`.

pub mod cdr;
pub mod definition;
mod latin;
pub mod message;
pub mod messages;
pub mod type_hash;
pub mod wire;

pub use cdr::Malformed;
pub use message::{Message, Service};

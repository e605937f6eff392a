//! ROS 2 messages as bytes and as text, and the names that `rmw_zenoh` gives to what carries them. Does no IO of any
//! kind: the caller has the network or the file.
//!
//! * [`message`]: what a message, a service and a field are, and the macro that makes them.
//! * [`messages`]: the types themselves, a module a ROS package.
//! * [`cdr`]: how values become bytes and come back, as `rmw` implementations write them.
//! * [`definition`]: the text of a type, as MCAP's `ros2msg` schemas have it.
//! * [`type_hash`][]: RIHS01.
//! * [`wire`]: keys, liveliness tokens, quality of service and attachments of `rmw_zenoh`.

pub mod cdr;
pub mod definition;
pub mod message;
pub mod messages;
pub mod type_hash;
pub mod wire;

pub use cdr::Malformed;
pub use message::{Message, Service};

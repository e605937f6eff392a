//! Identifiers.

use crate::message::messages;

messages! {
    /// A unique identifier.
    #[derive(Copy, Eq, PartialOrd, Ord)]
    UUID = "unique_identifier_msgs/msg/UUID" {
        uuid: [u8; 16],
    }
}

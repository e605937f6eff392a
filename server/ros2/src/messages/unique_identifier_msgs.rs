//! Identifiers.

use crate::message::messages;

messages! {
    /// An identifier that no other chose.
    #[derive(Copy, Eq, PartialOrd, Ord)]
    UUID = "unique_identifier_msgs/msg/UUID" {
        uuid: [u8; 16],
    }
}

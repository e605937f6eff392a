//! Identifiers.

use crate::message::messages;

messages! {
    /// An identifier that nobody else has chosen.
    #[derive(Copy, Eq, PartialOrd, Ord)]
    UUID = "unique_identifier_msgs/msg/UUID" {
        uuid: [u8; 16],
    }
}

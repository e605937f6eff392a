//! Introspection of calls: a part of every service's type.

use super::builtin_interfaces::Time;
use crate::message::{Char, messages};

messages! {
    /// Id and stage of a call.
    ServiceEventInfo = "service_msgs/msg/ServiceEventInfo" consts {
        REQUEST_SENT: u8 = 0;
        REQUEST_RECEIVED: u8 = 1;
        RESPONSE_SENT: u8 = 2;
        RESPONSE_RECEIVED: u8 = 3;
    } {
        event_type: u8,
        stamp: Time,
        client_gid: [Char; 16],
        sequence_number: i64,
    }
}

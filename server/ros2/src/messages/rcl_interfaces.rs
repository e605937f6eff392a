//! Log lines.

use super::builtin_interfaces::Time;
use crate::message::messages;

messages! {
    /// A line of a log, of `/rosout`.
    Log = "rcl_interfaces/msg/Log" consts {
        DEBUG: u8 = 10;
        INFO: u8 = 20;
        WARN: u8 = 30;
        ERROR: u8 = 40;
        FATAL: u8 = 50;
    } {
        stamp: Time,
        level: u8,
        name: String,
        msg: String,
        file: String,
        function: String,
        line: u32,
    }
}

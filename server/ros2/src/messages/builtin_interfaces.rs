//! Times and durations.

use crate::message::messages;

const NANOSECONDS: u64 = 1_000_000_000;

messages! {
    /// A time since the start of the clock.
    Time = "builtin_interfaces/msg/Time" {
        sec: i32,
        nanosec: u32,
    }

    /// A duration, possibly negative: `nanosec` always counts forwards from `sec`.
    Duration = "builtin_interfaces/msg/Duration" {
        sec: i32,
        nanosec: u32,
    }
}

impl Time {
    /// Makes a time from nanoseconds since the start; the last valid time if it does not fit.
    pub fn from_nanoseconds(nanoseconds: u64) -> Self {
        match i32::try_from(nanoseconds / NANOSECONDS) {
            Ok(sec) => Self { sec, nanosec: u32::try_from(nanoseconds % NANOSECONDS).unwrap_or_default() },
            Err(_) => Self { sec: i32::MAX, nanosec: 999_999_999 },
        }
    }

    /// Returns the nanoseconds since the start.
    pub fn nanoseconds(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

impl Duration {
    /// Returns the duration in seconds.
    pub fn seconds(&self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

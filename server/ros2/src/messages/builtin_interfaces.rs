//! Times and durations.

use crate::message::messages;

const NANOSECONDS: i128 = 1_000_000_000;

messages! {
    /// A moment, since the clock's own start.
    Time = "builtin_interfaces/msg/Time" {
        sec: i32,
        nanosec: u32,
    }

    /// A length of time, also backwards: `nanosec` always counts forwards from `sec`.
    Duration = "builtin_interfaces/msg/Duration" {
        sec: i32,
        nanosec: u32,
    }
}

/// Seconds rounded down and the nanoseconds from there, at the ends of what fits where it does not.
fn parts(nanoseconds: i128) -> (i32, u32) {
    let sec = nanoseconds.div_euclid(NANOSECONDS);
    match i32::try_from(sec) {
        Ok(sec) => (sec, u32::try_from(nanoseconds.rem_euclid(NANOSECONDS)).unwrap_or_default()),
        Err(_) if sec < 0 => (i32::MIN, 0),
        Err(_) => (i32::MAX, 999_999_999),
    }
}

impl Time {
    /// That many nanoseconds from the start: the last moment that fits where it does not.
    pub fn from_nanoseconds(nanoseconds: u64) -> Self {
        let (sec, nanosec) = parts(nanoseconds.into());
        Self { sec, nanosec }
    }

    /// Nanoseconds from the start.
    pub fn nanoseconds(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

impl Duration {
    /// The nearest to a number of seconds.
    pub fn from_seconds(seconds: f64) -> Self {
        // Numbers beyond the range become its ends, and not-a-number 0.
        #[allow(clippy::cast_possible_truncation, reason = "a cast from a float saturates")]
        let (sec, nanosec) = parts((seconds * 1e9).round() as i128);
        Self { sec, nanosec }
    }

    /// In seconds.
    pub fn seconds(&self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

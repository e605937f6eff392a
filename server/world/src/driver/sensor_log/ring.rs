//! The last readings of one sensor.

use std::collections::VecDeque;

use super::reading::LoggedReading;

/// Maximum number of kept readings.
pub(super) const MAX_READINGS: usize = 4_096;

/// Readings of a sensor, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadingBatch {
    /// Readings, in order.
    pub readings: Vec<LoggedReading>,
    /// Number of readings up to the last of these that are lost, also between them.
    pub missed: u64,
    /// Number after which new readings begin.
    pub after: u64,
}

impl ReadingBatch {
    /// Returns whether there is anything new.
    pub fn is_news(&self) -> bool {
        !self.readings.is_empty()
    }
}

/// The last readings of one sensor. The newest is always kept.
#[derive(Debug)]
pub(super) struct Ring {
    readings: VecDeque<LoggedReading>,
    /// Bytes of all kept readings.
    bytes: usize,
    /// Number before the sensor's first reading.
    base: u64,
    /// Number of the newest reading.
    last: u64,
}

impl Ring {
    /// Makes a ring for a sensor whose numbers begin after `base`.
    pub(super) fn new(base: u64) -> Self {
        Self { readings: VecDeque::new(), bytes: 0, base, last: base }
    }

    /// Keeps a reading. `count` counts the sensor's readings from 1, lost ones included; all kept readings
    /// take at most `share` bytes.
    pub(super) fn push(&mut self, mut reading: LoggedReading, count: u64, share: usize) {
        self.last = (self.base + count).max(self.last + 1);
        reading.sequence = self.last;
        self.bytes += reading.bytes();
        self.readings.push_back(reading);
        self.trim(share);
    }

    /// Drops the oldest readings until the rest takes at most `share` bytes.
    pub(super) fn trim(&mut self, share: usize) {
        while self.readings.len() > MAX_READINGS || (self.bytes > share && self.readings.len() > 1) {
            self.bytes -= self.readings.pop_front().map_or(0, |gone| gone.bytes());
        }
    }

    /// Returns the number of the newest reading; before the first one, the number preceding it.
    pub(super) fn last(&self) -> u64 {
        self.last
    }

    /// Returns the newest reading.
    pub(super) fn newest(&self) -> ReadingBatch {
        let readings = self.readings.back().cloned().into_iter().collect();
        ReadingBatch { readings, missed: 0, after: self.last }
    }

    /// Returns the sequence of the newest reading's state.
    pub(super) fn newest_state(&self) -> Option<u64> {
        self.readings.back().map(|reading| reading.state_sequence)
    }

    /// Returns the readings after a number, of about `bytes` bytes, but at least one if there is one. A
    /// larger number than the newest comes from before a restart of the daemon, and returns all kept
    /// readings.
    pub(super) fn after(&self, after: u64, bytes: usize) -> ReadingBatch {
        let after = if after > self.last { self.base } else { after.max(self.base) };
        let begin = self.readings.partition_point(|reading| reading.sequence <= after);
        let mut room = bytes;
        let mut readings = Vec::new();
        let mut end = after;
        for reading in self.readings.range(begin..) {
            let left = room.checked_sub(reading.bytes());
            if left.is_none() && !readings.is_empty() {
                break;
            }
            room = left.unwrap_or(0);
            end = reading.sequence;
            readings.push(reading.clone());
        }
        let missed = end - after - readings.len() as u64;
        ReadingBatch { readings, missed, after: end }
    }
}

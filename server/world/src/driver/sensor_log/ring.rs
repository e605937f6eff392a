//! The last readings of one sensor.

use std::collections::VecDeque;

use super::reading::LoggedReading;

/// How many are kept.
pub(super) const MOST_READINGS: usize = 4_096;

/// Readings of a sensor, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadingBatch {
    /// In order.
    pub readings: Vec<LoggedReading>,
    /// Readings before the last of these that are gone, also between them.
    pub missed: u64,
    /// The number after which what is new begins.
    pub after: u64,
}

impl ReadingBatch {
    /// Whether there is anything new.
    pub fn is_news(&self) -> bool {
        !self.readings.is_empty()
    }
}

/// The last readings of one sensor. The newest is always kept.
#[derive(Debug)]
pub(super) struct Ring {
    readings: VecDeque<LoggedReading>,
    /// Of all of them.
    bytes: usize,
    /// The number before that of its first reading.
    base: u64,
    /// The number of the newest reading.
    last: u64,
}

impl Ring {
    /// Of a sensor whose numbers begin after this one.
    pub(super) fn new(base: u64) -> Self {
        Self { readings: VecDeque::new(), bytes: 0, base, last: base }
    }

    /// Keeps the reading of which this is the count, from 1, of all that were to come, lost ones too; in so many bytes with those
    /// before.
    pub(super) fn push(&mut self, mut reading: LoggedReading, count: u64, share: usize) {
        self.last = (self.base + count).max(self.last + 1);
        reading.sequence = self.last;
        self.bytes += reading.bytes();
        self.readings.push_back(reading);
        self.trim(share);
    }

    /// Drops the oldest, so that what is left takes so many bytes.
    pub(super) fn trim(&mut self, share: usize) {
        while self.readings.len() > MOST_READINGS || (self.bytes > share && self.readings.len() > 1) {
            self.bytes -= self.readings.pop_front().map_or(0, |gone| gone.bytes());
        }
    }

    /// The number of the newest reading; that before its first where there is none.
    pub(super) fn last(&self) -> u64 {
        self.last
    }

    /// The newest reading.
    pub(super) fn newest(&self) -> ReadingBatch {
        let readings = self.readings.back().cloned().into_iter().collect();
        ReadingBatch { readings, missed: 0, after: self.last }
    }

    /// The state of which the newest reading is.
    pub(super) fn newest_state(&self) -> Option<u64> {
        self.readings.back().map(|reading| reading.state_sequence)
    }

    /// The readings after a number, of about so many bytes, but at least one where there is one. A number that lies ahead
    /// is of another life of the daemon, and reads all that is kept.
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

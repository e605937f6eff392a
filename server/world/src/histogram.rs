//! Counts of durations by length, to which many threads add without a lock.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Upper bounds, seconds; longer durations are counted beyond the last.
const BOUNDS: [f64; 20] = [
    2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0,
    2.0, 5.0,
];
/// Preferred numbers R10 (ISO 3): a percentile read from these is within a fifth of the true one.
const FINE: [f64; 10] = [1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0];
/// Powers of ten of the fine bounds: from 1 us up to 8 s.
const DECADES: [f64; 7] = [1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0];

/// Number of durations of each length.
#[derive(Debug)]
pub(crate) struct Histogram {
    bounds: Vec<f64>,
    /// Counts, one more than there are bounds.
    counts: Vec<AtomicU64>,
    nanoseconds: AtomicU64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self::of(BOUNDS.to_vec())
    }
}

/// A histogram at a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Counts {
    /// Sum of all values, seconds.
    pub sum: f64,
    /// Number of values.
    pub count: u64,
    /// Upper bounds, seconds, each with the number of values between it and the previous one; the last bound
    /// is infinite.
    pub buckets: Vec<(f64, u64)>,
}

impl Histogram {
    /// Makes a histogram for percentiles.
    pub(crate) fn fine() -> Self {
        let bounds = DECADES.iter().flat_map(|decade| FINE.map(|number| number * decade));
        Self::of(bounds.collect())
    }

    fn of(bounds: Vec<f64>) -> Self {
        let counts = (0..=bounds.len()).map(|_| AtomicU64::default()).collect();
        Self { bounds, counts, nanoseconds: AtomicU64::default() }
    }

    /// Adds a duration.
    pub(crate) fn observe(&self, duration: Duration) {
        let seconds = duration.as_secs_f64();
        let bucket = self.bounds.partition_point(|&bound| bound < seconds);
        self.counts[bucket].fetch_add(1, Ordering::Relaxed);
        let nanoseconds = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        self.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
    }

    pub(crate) fn counts(&self) -> Counts {
        let bounds = self.bounds.iter().copied().chain([f64::INFINITY]);
        let buckets: Vec<(f64, u64)> =
            bounds.zip(self.counts.iter().map(|count| count.load(Ordering::Relaxed))).collect();
        let count = buckets.iter().map(|(_, count)| count).sum();
        Counts {
            sum: Duration::from_nanos(self.nanoseconds.load(Ordering::Relaxed)).as_secs_f64(),
            count,
            buckets,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_is_counted_once_below_the_first_bound_that_is_not_less() {
        let histogram = Histogram::default();
        for seconds in [6e-6, 1e-5, 1.1e-5, 1.0, 60.0] {
            histogram.observe(Duration::from_secs_f64(seconds));
        }
        let counts = histogram.counts();
        let filled: Vec<_> = counts.buckets.iter().filter(|(_, count)| *count > 0).copied().collect();
        assert_eq!(filled, [(1e-5, 2), (2e-5, 1), (1.0, 1), (f64::INFINITY, 1)]);
        assert_eq!(counts.count, 5);
        let fine = Histogram::fine();
        fine.observe(Duration::from_micros(11));
        fine.observe(Duration::from_secs(100));
        let filled =
            fine.counts().buckets.into_iter().filter(|(_, count)| *count > 0).map(|(bound, _)| bound);
        let filled: Vec<f64> = filled.collect();
        assert!((filled[0] - 12.5e-6).abs() < 1e-12 && filled[1].is_infinite(), "{filled:?}");
        assert!((counts.sum - 61.000_027).abs() < 1e-9, "{}", counts.sum);
    }
}

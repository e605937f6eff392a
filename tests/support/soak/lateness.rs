//! How late steps were within a phase: percentiles of the daemon's own histogram, between two looks at it.

use simd_client::proto::DurationHistogram;
use simd_client::{Client, Error};

/// Durations of a phase, by length.
#[derive(Clone, Debug, Default)]
pub struct Spread {
    /// Seconds; the last is infinite.
    upper_bounds: Vec<f64>,
    counts: Vec<u64>,
}

/// Times of the steps of a phase.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    /// Delay of their start.
    pub lateness: Spread,
    /// Their duration.
    pub duration: Spread,
}

impl Steps {
    /// Since the daemon's start.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn so_far(client: &Client) -> Result<Self, Error> {
        let (_, daemon) = client.daemon_statistics().await?;
        let daemon = daemon.unwrap_or_default();
        let spread = |of: Option<DurationHistogram>| {
            let DurationHistogram { upper_bounds, counts, .. } = of.unwrap_or_default();
            Spread { upper_bounds, counts }
        };
        Ok(Self { lateness: spread(daemon.step_lateness), duration: spread(daemon.step_duration) })
    }

    /// Returns the steps after `before`.
    pub fn since(&self, before: &Self) -> Self {
        Self {
            lateness: self.lateness.since(&before.lateness),
            duration: self.duration.since(&before.duration),
        }
    }
}

impl Spread {
    pub(super) fn since(&self, before: &Self) -> Self {
        let earlier = before.counts.iter().chain(std::iter::repeat(&0));
        let counts = self.counts.iter().zip(earlier).map(|(now, then)| now.saturating_sub(*then)).collect();
        Self { upper_bounds: self.upper_bounds.clone(), counts }
    }

    /// Adds those of another part of the phase.
    pub(super) fn add(&mut self, other: &Self) {
        self.upper_bounds.clone_from(&other.upper_bounds);
        self.counts.resize(other.counts.len(), 0);
        self.counts.iter_mut().zip(&other.counts).for_each(|(count, more)| *count += more);
    }

    /// Returns an empty one with the same bounds.
    pub(super) fn empty(&self) -> Self {
        Self { upper_bounds: self.upper_bounds.clone(), counts: vec![0; self.upper_bounds.len()] }
    }

    /// Counts one more, seconds.
    pub(super) fn observe(&mut self, duration: f64) {
        let bucket = self.upper_bounds.partition_point(|bound| *bound < duration);
        if let Some(count) = self.counts.get_mut(bucket) {
            *count += 1;
        }
    }

    /// Returns their number.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the seconds below which this part of all is, by linear interpolation within its bucket; NaN if
    /// there are none.
    pub fn percentile(&self, part: f64) -> f64 {
        let wanted = part * self.count() as f64;
        let (mut below, mut lower) = (0.0, 0.0);
        for (&upper, &count) in self.upper_bounds.iter().zip(&self.counts) {
            let count = count as f64;
            if count > 0.0 && below + count >= wanted {
                // Beyond the last bound nothing more is known.
                let upper = if upper.is_finite() { upper } else { lower };
                return lower + (upper - lower) * (wanted - below) / count;
            }
            below += count;
            lower = upper;
        }
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_what_came_between() {
        let spread =
            |counts: [u64; 3]| Spread { upper_bounds: vec![1.0, 2.0, f64::INFINITY], counts: counts.into() };
        let phase = spread([110, 20, 0]).since(&spread([10, 20, 0]));
        assert_eq!((phase.count(), phase.percentile(0.5)), (100, 0.5));
        let phase = spread([90, 10, 0]);
        assert!((phase.percentile(0.95) - 1.5).abs() < 1e-12);
        assert_eq!(spread([0, 0, 4]).percentile(0.5), 2.0);
        assert!(spread([0, 0, 0]).percentile(0.5).is_nan());
        let mut both = Spread::default();
        [[1, 0, 2], [3, 4, 0]].into_iter().for_each(|part| both.add(&spread(part)));
        assert_eq!(both.counts, [4, 4, 2]);
        let mut one_by_one = both.empty();
        [0.5, 1.0, 1.5, 9.0].into_iter().for_each(|duration| one_by_one.observe(duration));
        assert_eq!(one_by_one.counts, [2, 1, 1]);
    }
}

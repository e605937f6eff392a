//! Decides when the next step is due. It owns no clock: the caller passes the time, so that an hour of pacing
//! is a millisecond of test.

use std::time::{Duration, Instant};

/// Minimum time between two reports of lag.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);

/// Keeps steps on a wall clock.
///
/// The deadline of step `n` is `anchor + n * period`. It does not depend on the times of earlier steps, so
/// errors of single wake-ups do not add up. After a delay, due steps run without waiting. Delays come from
/// long steps, or from a period below the resolution of the system's timer. Lag beyond a limit is dropped,
/// counted, and never repaid.
#[derive(Debug)]
pub(crate) struct Pacer {
    /// Wall time of a step; `None` for no pace.
    period: Option<Duration>,
    /// Exact period: a `Duration` rounds to nanoseconds, which would cause drift.
    period_seconds: f64,
    /// Origin of the deadlines.
    anchor: Instant,
    /// Steps since the anchor.
    steps: u64,
    /// Maximum lag that is caught up.
    lag_limit: Duration,
    overruns: u64,
    dropped_lag: Duration,
    /// Lag dropped since the last report.
    unreported: Duration,
    reported_at: Option<Instant>,
}

/// Time of the next step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Due {
    /// It is due or late.
    Now,
    /// It is not due before this time.
    At(Instant),
}

impl Pacer {
    /// Makes a pacer whose first step is due one period after `now`.
    pub(crate) fn new(period_seconds: Option<f64>, lag_limit: Duration, now: Instant) -> Self {
        let mut pacer = Self {
            period: None,
            period_seconds: 0.0,
            anchor: now,
            steps: 0,
            lag_limit,
            overruns: 0,
            dropped_lag: Duration::ZERO,
            unreported: Duration::ZERO,
            reported_at: None,
        };
        pacer.set_period(period_seconds, now);
        pacer
    }

    /// Restarts the deadlines, as when the world starts to play.
    pub(crate) fn restart(&mut self, now: Instant) {
        self.anchor = now;
        self.steps = 0;
    }

    /// Changes the wall seconds of a step from the next one on; `None` disables the pace. When a pace begins,
    /// its deadlines count from `now`.
    pub(crate) fn set_period(&mut self, seconds: Option<f64>, now: Instant) {
        let period = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        if period == self.period && (period.is_none() || seconds == Some(self.period_seconds)) {
            return;
        }
        self.anchor = if self.period.is_some() { self.deadline(self.steps) } else { now };
        self.steps = 0;
        self.period = period;
        self.period_seconds = seconds.unwrap_or(0.0);
    }

    /// Returns when the next step is due, and drops lag beyond the limit.
    pub(crate) fn next(&mut self, now: Instant) -> Due {
        if self.period.is_none() {
            return Due::Now;
        }
        let deadline = self.deadline(self.steps + 1);
        if now < deadline {
            return Due::At(deadline);
        }
        let lag = now - deadline;
        if lag > self.lag_limit {
            self.anchor += lag;
            self.overruns += 1;
            self.dropped_lag += lag;
            self.unreported += lag;
        }
        Due::Now
    }

    /// Returns how late the next step is at `now`; `None` without a pace.
    pub(crate) fn lateness(&self, now: Instant) -> Option<Duration> {
        self.period.map(|_| now.saturating_duration_since(self.deadline(self.steps + 1)))
    }

    /// Counts a completed step.
    pub(crate) fn stepped(&mut self) {
        self.steps += 1;
    }

    /// Returns how often lag was dropped.
    pub(crate) fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Returns the total dropped lag, wall seconds.
    pub(crate) fn dropped_lag(&self) -> f64 {
        self.dropped_lag.as_secs_f64()
    }

    /// Returns the lag dropped since the last report, wall seconds, if a report is due.
    pub(crate) fn report(&mut self, now: Instant) -> Option<f64> {
        let too_soon = self.reported_at.is_some_and(|at| now.saturating_duration_since(at) < REPORT_INTERVAL);
        if self.unreported.is_zero() || too_soon {
            return None;
        }
        self.reported_at = Some(now);
        Some(std::mem::take(&mut self.unreported).as_secs_f64())
    }

    /// Returns the deadline of the n-th step since the anchor. A period is at most 100 s, so only a sum above
    /// the age of the universe would not fit.
    fn deadline(&self, steps: u64) -> Instant {
        let offset = Duration::try_from_secs_f64(self.period_seconds * steps as f64).unwrap_or(Duration::MAX);
        self.anchor.checked_add(offset).unwrap_or(self.anchor)
    }
}

#[cfg(test)]
mod tests;

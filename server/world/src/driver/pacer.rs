//! When the next step is due. Owns no clock: it is given the time, so that an
//! hour of pacing is a millisecond of test.

use std::time::{Duration, Instant};

/// At most one report of lag in this time.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);

/// Keeps steps to a wall clock.
///
/// The deadline of step `n` is `anchor + n * period`: it does not depend on when
/// the steps before it were done, so errors of single wake-ups do not add up.
/// After a delay, the steps that are due are done without waiting, be it because a
/// step took long or because the period is shorter than the system's timer can
/// tell. Lag beyond a limit is dropped, counted, and never repaid.
#[derive(Debug)]
pub(crate) struct Pacer {
    /// Wall time of a step; `None` waits for nothing.
    period: Option<Duration>,
    /// The period again, exact: a `Duration` rounds to nanoseconds, which would be drift.
    period_seconds: f64,
    /// What deadlines are counted from.
    anchor: Instant,
    /// Steps since the anchor.
    steps: u64,
    /// Lag up to this is made good.
    lag_limit: Duration,
    overruns: u64,
    dropped_lag: Duration,
    /// Dropped since the last report.
    unreported: Duration,
    reported_at: Option<Instant>,
}

/// When a step is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Due {
    /// It is time, or past it.
    Now,
    /// Not before.
    At(Instant),
}

impl Pacer {
    /// A pacer whose first step is due a period after `now`.
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

    /// Begins anew, as when the world starts to play.
    pub(crate) fn restart(&mut self, now: Instant) {
        self.anchor = now;
        self.steps = 0;
    }

    /// Changes the wall seconds of a step from the next one on; `None` waits for nothing.
    /// Coming from no pace at all, deadlines begin at `now`.
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

    /// When the next step is due. Drops the lag there is where it is beyond the limit.
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

    /// How long after its time the next step is at `now`; `None` where steps have no time.
    pub(crate) fn lateness(&self, now: Instant) -> Option<Duration> {
        self.period.map(|_| now.saturating_duration_since(self.deadline(self.steps + 1)))
    }

    /// Counts a step that was done.
    pub(crate) fn stepped(&mut self) {
        self.steps += 1;
    }

    /// How often lag was dropped.
    pub(crate) fn overruns(&self) -> u64 {
        self.overruns
    }

    /// All lag that was dropped, wall seconds.
    pub(crate) fn dropped_lag(&self) -> f64 {
        self.dropped_lag.as_secs_f64()
    }

    /// Wall seconds of lag dropped since the last report, where one is to be made now.
    pub(crate) fn report(&mut self, now: Instant) -> Option<f64> {
        let too_soon = self.reported_at.is_some_and(|at| now.saturating_duration_since(at) < REPORT_INTERVAL);
        if self.unreported.is_zero() || too_soon {
            return None;
        }
        self.reported_at = Some(now);
        Some(std::mem::take(&mut self.unreported).as_secs_f64())
    }

    /// Of the n-th step since the anchor. A period is at most 100 s, so only a
    /// sum of more than the age of the universe would not fit.
    fn deadline(&self, steps: u64) -> Instant {
        let offset = Duration::try_from_secs_f64(self.period_seconds * steps as f64).unwrap_or(Duration::MAX);
        self.anchor.checked_add(offset).unwrap_or(self.anchor)
    }
}

#[cfg(test)]
mod tests;

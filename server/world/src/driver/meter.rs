//! Measures the world's actual speed over about the last second. It owns no clock: the caller passes the
//! time.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Averaging window.
const WINDOW: Duration = Duration::from_secs(1);
/// Time between marks: the window slides by a tenth of its length, at the same cost for every time step.
const MARK_INTERVAL: Duration = Duration::from_millis(100);

/// Measures the real-time factor and the cost of a step.
#[derive(Debug)]
pub(crate) struct Meter {
    /// Sums at times of the last second, oldest first; never empty.
    marks: VecDeque<Sums>,
    /// Sums until now.
    sums: Sums,
}

/// Sums since the meter began.
#[derive(Clone, Copy, Debug)]
struct Sums {
    at: Instant,
    /// Simulated seconds.
    sim_time: f64,
    /// Wall time spent in steps.
    busy: Duration,
    steps: u64,
}

impl Meter {
    /// Makes a meter without steps.
    pub(crate) fn new(now: Instant) -> Self {
        let sums = Sums { at: now, sim_time: 0.0, busy: Duration::ZERO, steps: 0 };
        Self { marks: VecDeque::from([sums]), sums }
    }

    /// Forgets earlier steps, as when the world starts to play.
    pub(crate) fn restart(&mut self, now: Instant) {
        self.sums.at = now;
        self.marks.clear();
        self.marks.push_back(self.sums);
    }

    /// Counts a step that ended `now`.
    pub(crate) fn record(&mut self, now: Instant, sim_time: f64, busy: Duration) {
        self.sums.at = now;
        self.sums.sim_time += sim_time;
        self.sums.busy += busy;
        self.sums.steps += 1;
        if self.marks.back().is_none_or(|last| now.saturating_duration_since(last.at) >= MARK_INTERVAL) {
            while self.marks.get(1).is_some_and(|second| now.saturating_duration_since(second.at) >= WINDOW) {
                self.marks.pop_front();
            }
            self.marks.push_back(self.sums);
        }
    }

    /// Returns simulated seconds per wall second, measured between ends of steps, so that long steps cause no
    /// sawtooth.
    pub(crate) fn real_time_factor(&self) -> f64 {
        let oldest = self.oldest();
        let wall = self.sums.at.saturating_duration_since(oldest.at).as_secs_f64();
        if wall > 0.0 { (self.sums.sim_time - oldest.sim_time) / wall } else { 0.0 }
    }

    /// Returns the mean wall seconds of a step.
    pub(crate) fn step_duration(&self) -> f64 {
        let oldest = self.oldest();
        match self.sums.steps - oldest.steps {
            0 => 0.0,
            steps => (self.sums.busy - oldest.busy).as_secs_f64() / steps as f64,
        }
    }

    fn oldest(&self) -> &Sums {
        self.marks.front().unwrap_or(&self.sums)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_that_of_the_last_second() {
        let start = Instant::now();
        let mut meter = Meter::new(start);
        assert_eq!((meter.real_time_factor(), meter.step_duration()), (0.0, 0.0));
        let mut now = start;
        let mut run = |meter: &mut Meter, steps: u32, wall: Duration| {
            for _ in 0..steps {
                now += wall;
                meter.record(now, 1e-3, Duration::from_micros(20));
            }
        };
        run(&mut meter, 5_000, Duration::from_millis(1));
        assert!((meter.real_time_factor() - 1.0).abs() < 1e-6);
        run(&mut meter, 5_000, Duration::from_micros(500));
        assert!((meter.real_time_factor() - 2.0).abs() < 1e-6);
        assert!((meter.step_duration() - 20e-6).abs() < 1e-12);
        assert!(meter.marks.len() < 20);
    }

    #[test]
    fn steps_longer_than_the_window_are_measured_too() {
        let start = Instant::now();
        let mut meter = Meter::new(start);
        for n in 1..=5 {
            meter.record(start + Duration::from_secs(10 * n), 0.1, Duration::from_millis(1));
        }
        assert!((meter.real_time_factor() - 0.01).abs() < 1e-9);
    }

    #[test]
    fn time_before_a_restart_does_not_count() {
        let start = Instant::now();
        let mut meter = Meter::new(start);
        meter.record(start + Duration::from_millis(1), 1e-3, Duration::ZERO);
        let again = start + Duration::from_secs(100);
        meter.restart(again);
        meter.record(again + Duration::from_millis(2), 1e-3, Duration::ZERO);
        assert!((meter.real_time_factor() - 0.5).abs() < 1e-9);
    }
}

//! Limits the time for calls while a step is due. It limits time and not their number, since one call may
//! take as long as a thousand others. It owns no clock: the caller passes the time.

use std::time::{Duration, Instant};

/// Maximum part of a step's period that calls take from a step that is due.
const PART: f64 = 0.1;
/// Maximum time that they take, since a period may be minutes long.
const LONGEST: Duration = Duration::from_millis(20);

/// Measures time since a step became due. Many calls do not stop the world. A world that is always late does
/// not stop the calls: at least one is served before each step.
#[derive(Debug, Default)]
pub(super) struct CallBudget {
    /// Time at which the step became due.
    due: Option<Instant>,
    /// Calls served since then.
    served: u64,
}

impl CallBudget {
    /// Returns whether another call may be served before a step that is due `now`, with steps every `period`
    /// seconds.
    pub(super) fn may_serve(&mut self, now: Instant, period: f64) -> bool {
        let due = *self.due.get_or_insert(now);
        let most = Duration::try_from_secs_f64(period * PART).map_or(LONGEST, |most| most.min(LONGEST));
        self.served == 0 || now.saturating_duration_since(due) < most
    }

    /// Counts a call.
    pub(super) fn served(&mut self) {
        if self.due.is_some() {
            self.served += 1;
        }
    }

    /// Resets the budget, since the step begins.
    pub(super) fn step(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_have_a_tenth_of_a_period_and_at_least_one_of_them_is_served() {
        let due = Instant::now();
        let at = |micros: u64| due + Duration::from_micros(micros);
        let mut budget = CallBudget::default();
        budget.served();
        for micros in [0, 50, 99] {
            assert!(budget.may_serve(at(micros), 1e-3));
            budget.served();
        }
        assert!(!budget.may_serve(at(100), 1e-3));
        budget.step();
        // After a call of four tenths of a second, the next one waits for the step.
        assert!(budget.may_serve(at(1_000), 1e-3));
        budget.served();
        assert!(!budget.may_serve(at(401_000), 1e-3));
        budget.step();
        assert!(budget.may_serve(at(402_000), 0.0), "one, however short the period");
        budget.served();
        assert!(!budget.may_serve(at(402_000), 0.0));
    }

    #[test]
    fn a_long_period_is_not_an_excuse() {
        let due = Instant::now();
        let mut budget = CallBudget::default();
        assert!(budget.may_serve(due, 100.0));
        budget.served();
        assert!(budget.may_serve(due + Duration::from_millis(19), 100.0));
        assert!(!budget.may_serve(due + Duration::from_millis(20), 100.0));
    }
}

//! Public data of the driver: states of the world, timing statistics, and confirmations of commands.

use std::sync::Arc;
use std::time::SystemTime;

use simd_core::simulation::command::Clamped;
use simd_core::{Applied, PhysicsSettings, PublishedState};

use crate::call_error::CallError;
use crate::run_state::RunState;

/// A state of the world as the daemon published it.
#[derive(Clone, Debug)]
pub struct Published {
    /// Sequence, larger than in every earlier state.
    pub sequence: u64,
    /// Wall time of publication.
    pub wall_time: SystemTime,
    /// State of the world.
    pub state: PublishedState,
    /// Gravity, time step, substeps and integrator in force.
    pub physics: PhysicsSettings,
    /// Timing statistics.
    pub statistics: Statistics,
}

/// Relation of steps to the wall clock while playing. The factor is kept while it is unused, so that a return
/// to real time needs no number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// Sim time follows wall time.
    RealTime {
        /// Simulated seconds per wall second, 0.001 to 1,000.
        factor: f64,
    },
    /// Steps follow each other without waiting.
    AsFastAsPossible {
        /// Factor for a later return to real time.
        factor: f64,
    },
}

impl Pace {
    /// Returns the factor in force or kept for later, simulated seconds per wall second.
    pub fn factor(self) -> f64 {
        match self {
            Self::RealTime { factor } | Self::AsFastAsPossible { factor } => factor,
        }
    }

    /// Checks the factor.
    ///
    /// # Errors
    /// Returns an error if the factor is not between 0.001 and 1,000.
    pub fn check(self) -> Result<(), CallError> {
        if (0.001..=1000.0).contains(&self.factor()) {
            return Ok(());
        }
        Err(CallError::InvalidValue {
            element: "real_time_factor".into(),
            value: self.factor().to_string(),
            expected: "it must be between 0.001 and 1000".into(),
        })
    }
}

/// A change of the pace; absent values keep their value at the time of the change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PaceChange {
    /// Whether steps ignore the wall clock.
    pub as_fast_as_possible: Option<bool>,
    /// Simulated seconds per wall second, 0.001 to 1,000.
    pub factor: Option<f64>,
}

impl PaceChange {
    /// Returns the new pace.
    pub fn of(self, present: Pace) -> Pace {
        let factor = self.factor.unwrap_or(present.factor());
        let is_free = matches!(present, Pace::AsFastAsPossible { .. });
        if self.as_fast_as_possible.unwrap_or(is_free) {
            Pace::AsFastAsPossible { factor }
        } else {
            Pace::RealTime { factor }
        }
    }
}

impl From<Pace> for PaceChange {
    fn from(pace: Pace) -> Self {
        let is_free = matches!(pace, Pace::AsFastAsPossible { .. });
        Self { as_fast_as_possible: Some(is_free), factor: Some(pace.factor()) }
    }
}

impl Default for Pace {
    fn default() -> Self {
        Self::RealTime { factor: 1.0 }
    }
}

/// Timing statistics of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Run state.
    pub state: RunState,
    /// Requested pace.
    pub pace: Pace,
    /// Simulated seconds per wall second over about the last second of playing; 0 when not playing.
    pub real_time_factor: f64,
    /// Number of times that lag was dropped.
    pub overruns: u64,
    /// Total dropped lag, wall seconds.
    pub dropped_lag: f64,
    /// Steps since the daemon started.
    pub iterations: u64,
    /// Mean wall seconds of a step's computation over about the last second, or the elapsed time of the
    /// present step, whichever is longer.
    pub step_duration: f64,
    /// Number of requests that found the mailbox full.
    pub mailbox_refusals: u64,
}

impl Statistics {
    /// Returns the statistics of a world without steps.
    pub fn at_start(state: RunState, pace: Pace) -> Self {
        Self {
            state,
            pace,
            real_time_factor: 0.0,
            overruns: 0,
            dropped_lag: 0.0,
            iterations: 0,
            step_duration: 0.0,
            mailbox_refusals: 0,
        }
    }
}

/// Confirmation of a command, with the newest published state.
#[derive(Clone, Debug)]
pub struct Done {
    /// Result of the command; `applied.at` is the moment from which it holds.
    pub applied: Applied,
    /// Sequence of the newest published state when the reply was made.
    pub sequence: u64,
    /// Wall time at which that state was published.
    pub wall_time: SystemTime,
}

/// Confirmation of steps.
#[derive(Clone, Debug)]
pub struct Stepped {
    /// Moment after the last step.
    pub done: Done,
    /// State after the last step.
    pub state: Arc<Published>,
    /// Clamped targets of the request.
    pub clamped: Vec<Clamped>,
}

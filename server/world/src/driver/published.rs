//! What the driver makes known to everybody: states of the world, how well it
//! keeps time, and that a command was done.

use std::sync::Arc;
use std::time::SystemTime;

use simd_core::simulation::command::Clamped;
use simd_core::{Applied, PhysicsSettings, PublishedState};

use crate::call_error::CallError;
use crate::run_state::RunState;

/// A state of the world as the daemon published it.
#[derive(Clone, Debug)]
pub struct Published {
    /// Larger than that of every state published before.
    pub sequence: u64,
    /// When it was published.
    pub wall_time: SystemTime,
    /// What the world looked like.
    pub state: PublishedState,
    /// Gravity, time step, substeps and integrator that were in force.
    pub physics: PhysicsSettings,
    /// How well it kept time.
    pub statistics: Statistics,
}

/// How steps follow the wall clock while playing. The factor is kept while it
/// is not used, so that going back to real time needs no number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// Sim time follows wall time.
    RealTime {
        /// Simulated seconds to a wall second, 0.001 to 1,000.
        factor: f64,
    },
    /// Steps follow each other at once.
    AsFastAsPossible {
        /// For a later return to real time.
        factor: f64,
    },
}

impl Pace {
    /// Simulated seconds to a wall second, in force or kept for later.
    pub fn factor(self) -> f64 {
        match self {
            Self::RealTime { factor } | Self::AsFastAsPossible { factor } => factor,
        }
    }

    /// # Errors
    /// Returns an error if the factor is not within 0.001 and 1,000.
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

/// A change of the pace; what is not given stays as it is when the change is made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PaceChange {
    /// Steps follow each other at once, or the wall clock.
    pub as_fast_as_possible: Option<bool>,
    /// Simulated seconds to a wall second, 0.001 to 1,000.
    pub factor: Option<f64>,
}

impl PaceChange {
    /// What a pace becomes.
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

/// How well the world keeps time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Whether the world runs.
    pub state: RunState,
    /// What was asked for.
    pub pace: Pace,
    /// Simulated seconds to a wall second over about the last second of playing; 0 when not playing.
    pub real_time_factor: f64,
    /// How often lag was dropped.
    pub overruns: u64,
    /// Wall seconds of lag dropped in all.
    pub dropped_lag: f64,
    /// Steps since the daemon started.
    pub iterations: u64,
    /// Mean wall seconds of a step's computation over about the last second, or how long the present step has
    /// been going on, whichever is longer.
    pub step_duration: f64,
    /// Requests that found the mailbox full.
    pub mailbox_refusals: u64,
}

impl Statistics {
    /// Of a world that has not stepped yet.
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

/// A command that was done, and the state that the daemon had published by then.
#[derive(Clone, Debug)]
pub struct Done {
    /// `applied.at` is the moment from which the command holds.
    pub applied: Applied,
    /// Of the newest published state when the reply was made.
    pub sequence: u64,
    /// When that state was published.
    pub wall_time: SystemTime,
}

/// Steps that were done.
#[derive(Clone, Debug)]
pub struct Stepped {
    /// The moment after the last of them.
    pub done: Done,
    /// The state after the last of them.
    pub state: Arc<Published>,
    /// Of the targets that came with them.
    pub clamped: Vec<Clamped>,
}

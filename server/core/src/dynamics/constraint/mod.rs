//! Constraints as rows on the new velocities: position limits, dry friction, mimic, tendons, contact, and
//! constraints between links.
//!
//! A row requires that J qd is at least or equal to -bias, or is pulled towards it by a bounded impulse. Rows
//! are solved together by projected Gauss-Seidel, warm-started with the impulses of the previous step, soft
//! in the position error.

pub mod contact;
pub(in crate::dynamics) mod contact_law;
pub mod link_constraint;
pub mod link_rows;
pub mod momentum;
mod multi_rhs;
mod response;
mod rows;
pub mod side;
mod solve;
pub(in crate::dynamics) mod sums;
pub mod three_rows;
pub mod turning;

pub use multi_rhs::{MultiRhsSolve, respond_to_joints, respond_to_unit_forces};
pub use response::{PlacedBody, Turning, project, project_onto, respond, respond_to_force, single_body_rows};
pub use rows::{Impulses, collect};
pub(in crate::dynamics) use rows::{LIMIT_MARGIN, limit_bias};
pub use solve::{prepare, solve, sweep};
pub use sums::{OfTendons, Sums, collect_tendons};

/// Part of a position error that is corrected in a step.
pub const ERROR_REDUCTION: f64 = 0.2;

/// Part of the last impulses that a step starts from. It is all of them, since rows of joints return each
/// step with the same Jacobian. Sweeps would have to restore a missing part, or it would show as creep.
pub const WARM_START: f64 = 1.0;

/// Maximum change of a limit's velocity by its initial impulse, as a multiple of the largest error of its
/// robot's rows.
pub const MAX_LIMIT_START: f64 = 10.0;

/// Maximum number of sweeps.
pub const MAX_SWEEPS: usize = 100;

/// Largest change of a row's velocity by its own impulse at which sweeping ends, rad/s or m/s.
pub const SETTLED: f64 = 1e-11;

/// A constraint on one or two velocities.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// Key of its warm-start impulse.
    pub key: RowKey,
    /// J: indices of velocities and their factors; the second may have factor 0.
    pub entries: [(usize, f64); 2],
    /// Bodies of these velocities.
    pub bodies: [usize; 2],
    /// Bias: the impulse acts against J qd + bias.
    pub bias: f64,
    /// Minimum impulse, N m s or N s.
    pub least: f64,
    /// Maximum impulse, N m s or N s.
    pub most: f64,
    /// Impulse so far, N m s or N s.
    pub impulse: f64,
    /// J M^-1 J'.
    pub effect: f64,
    /// Index in [`Sums`] of a row on a sum of joints; it has no entries.
    pub sum: Option<u32>,
}

impl Row {
    /// Returns J qd.
    pub fn velocity(&self, sums: &Sums, velocities: &[f64]) -> f64 {
        if let Some(sum) = self.sum {
            return sums.velocity(sum, velocities);
        }
        let [a, b] = self.entries;
        a.1 * velocities[a.0] + b.1 * velocities[b.0]
    }
}

/// Purpose of a row, by velocity index. The order is the order of solving.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowKey {
    /// Dry friction of an axis.
    Friction(usize),
    /// A pair of joints, by its index in the tree's list.
    Mimic(usize),
    /// A lower limit.
    Lower(usize),
    /// An upper limit.
    Upper(usize),
    /// A force of a tendon, by its index in the tree's list: its own forces first, then those of its actuator.
    Tendon(usize, bool),
}

impl Default for RowKey {
    fn default() -> Self {
        Self::Friction(0)
    }
}

/// Rows of one robot and the data to solve them: scratch of a step.
#[derive(Clone, Debug, Default)]
pub struct Constraints {
    /// Rows in the order of their keys.
    pub rows: Vec<Row>,
    /// M^-1 J' of each row, concatenated, each as long as the velocities.
    pub responses: Vec<f64>,
    /// J of the rows on sums of joints.
    pub sums: Sums,
}

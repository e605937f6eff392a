//! Constraints as rows on the new velocities: position limits, dry friction, mimic, contact, and those between links.
//!
//! A row says of J qd that it is at least, equal to, or pulled towards -bias by
//! a bounded impulse. Rows are solved together by projected Gauss-Seidel,
//! warm-started with the impulses of the step before, soft in the position error.

pub mod contact;
pub(in crate::dynamics) mod contact_law;
pub mod direct;
pub mod link_constraint;
pub mod link_rows;
pub mod momentum;
mod multi_rhs;
mod response;
mod rows;
pub mod side;
mod solve;
pub mod three_rows;
pub mod turning;

pub use multi_rhs::{MultiRhsSolve, respond_to_joints, respond_to_unit_forces};
pub use response::{PlacedBody, Turning, project, project_onto, respond, respond_to_force, single_body_rows};
pub use rows::{Impulses, collect};
pub(in crate::dynamics) use rows::{NEAR, limit_bias};
pub use solve::{prepare, solve, sweep};

/// The velocity at which a violated position is put right, as a part of it a step.
pub const ERROR_REDUCTION: f64 = 0.2;

/// The part of the last impulses that a step starts from. All of it: rows of joints come
/// back each step with the same Jacobian, and what is left out here would be made up by
/// sweeps, or seen as creep.
pub const WARM_START: f64 = 1.0;

/// What a limit starts from changes its velocity by no more than so many times what any row of its robot is off by.
pub const MOST_START: f64 = 10.0;

/// Sweeps at the most.
pub const MAX_SWEEPS: usize = 100;

/// Sweeping ends when no impulse changes its own velocity by more than this, rad/s or m/s.
pub const SETTLED: f64 = 1e-11;

/// A constraint on one or two velocities.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// What it keeps its warm-start impulse under.
    pub key: RowKey,
    /// J: indices of velocities and their factors; the second may have factor 0.
    pub entries: [(usize, f64); 2],
    /// Which bodies these are of.
    pub bodies: [usize; 2],
    /// J qd + bias is what the impulse works against.
    pub bias: f64,
    /// The least impulse, N m s or N s.
    pub least: f64,
    /// The largest.
    pub most: f64,
    /// The impulse so far.
    pub impulse: f64,
    /// J M^-1 J'.
    pub effect: f64,
}

impl Row {
    /// J qd.
    pub fn velocity(&self, velocities: &[f64]) -> f64 {
        let [a, b] = self.entries;
        a.1 * velocities[a.0] + b.1 * velocities[b.0]
    }
}

/// What a row is about, by velocity index. The order is that of solving.
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
}

impl Default for RowKey {
    fn default() -> Self {
        Self::Friction(0)
    }
}

/// Rows of one robot and what solving them needs: scratch of a step.
#[derive(Clone, Debug, Default)]
pub struct Constraints {
    /// In the order of their keys.
    pub rows: Vec<Row>,
    /// M^-1 J' of each row, one after the other, each as long as the velocities.
    pub responses: Vec<f64>,
}

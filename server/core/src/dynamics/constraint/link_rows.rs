//! Rows of a constraint between links: up to three forces, or three torques, as one block.
//!
//! A row is J v + R p = target, with a small permanent R: redundant constraints then each have a definite
//! force. The norm of the block's impulse is bounded, so that the bound does not depend on the axes of the
//! frames.
//!
//! The target has two parts:
//!
//! * Errors. The deflection by R is corrected, and no more. A velocity that closed an error would be a motor,
//!   which adds energy if the error does not close. The rest of an error is corrected in [positions
//!   alone](crate::dynamics::island). If a client drags at the constraint, it moves the links that it holds.
//!   Each step then corrects a part [`ERROR_REDUCTION`] of the error (Baumgarte's method; as PyBullet's `erp`
//!   and MuJoCo's `solref` of 2.2 steps).
//! * Curvature. Positions move along curves, and rows are tangents. Let q + h v be off the curve by
//!   `h^2/2 v' H v`. The velocity that stays on the curve then has `J v = -h/2 v' H v` (SHAKE: Ryckaert,
//!   Ciccotti and Berendsen (1977)). A first estimate is the last step's difference between the predicted and
//!   the found error. It leaves an error of third order in h. If rows are solved directly, it is then
//!   computed [from the positions that the velocities lead to](crate::dynamics::island). Motion on a curve
//!   therefore neither gains nor loses energy.

mod impulses;

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use super::ERROR_REDUCTION;
use super::contact::ContactRows;
use super::three_rows::{eigen, weigh};

/// R as a part of the mean J M^-1 J' of the block.
const COMPLIANCE: f64 = 1e-5;

/// Largest errors that a load causes, m and rad. A constraint deflects that far in a step of 1 ms under two
/// million times the weight that hangs on it.
pub const FAR: [f64; 2] = [1e-3, 3e-3];

/// R of a dragged block with an error beyond [`FAR`]. Some links can hardly move towards their goal, as in a
/// nearly straight chain. Without this R their joints would turn ever faster (damped least squares: Wampler
/// (1986)).
const FAR_COMPLIANCE: f64 = 0.05;

/// Velocity up to which velocities correct errors under small loads, m/s or rad/s: an energy of 5e-11 J/kg.
const GENTLE: f64 = 1e-5;

/// Velocity up to which velocities correct errors, as a multiple of R p.
const GIVEN_WAY: f64 = 2.0;

/// Time in which the brake of contradictory constraints removes their relative motion, s.
const BRAKE: f64 = 0.05;

/// Maximum velocity of error correction, m/s, and for angles rad/s: fast enough for objects that scripts
/// drag.
pub const MAX_CORRECTION: [f64; 2] = [10.0, 30.0];

/// Largest departure from the tangent in one step, m or rad. A larger one means that something was
/// teleported.
const MAX_DEPARTURE: f64 = 1e-2;

/// Threshold of J below which no joint can move a row, metres, and for torques 1.
const IMMOVABLE: [f64; 2] = [1e-10, 1e-4];

/// Threshold of J M^-1 J', as a part of its largest eigenvalue, below which a direction has no row. Otherwise
/// the links of a planar linkage that its description places a micrometre out of the plane would press
/// against each other like steel.
const SINGULAR: f64 = 1e-8;

/// Identity: nn, nt, nu, tt, tu, uu.
const ALL_DIRECTIONS: [f64; 6] = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0];

/// Largest difference of a velocity before the step from the rows' target that is not a jump, m/s or rad/s.
const AT_REST: f64 = 1e-6;

/// Divisor of steadiness: the correction is predicted from the last step, and dropped if it has changed by
/// more than 1 / this of itself.
const UNSTEADY: f64 = 2.0;

/// State of a block between steps, which predicts how far its motion leaves a tangent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Predicted errors, as far as they are linear, m or rad.
    pub predicted: [f64; 3],
    /// Departure from the tangent in the previous step, m or rad.
    pub bent: [f64; 3],
}

/// Axes of rows, world, and errors along them; a missing row has a zero axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aim {
    /// Axes of unit length, or zero.
    pub axes: [DVec3; 3],
    /// Errors, m or rad.
    pub errors: [f64; 3],
}

/// Active rows of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkState {
    /// A slack rope.
    Open,
    /// The rows are equations.
    #[default]
    Holds,
    /// The impulse is at its maximum.
    Saturated,
}

/// Two joints of one axis each, as a row.
#[derive(Clone, Copy, Debug)]
pub struct GearRow {
    /// Member of the island, body, index of its velocity, and factor, for each joint.
    pub joints: [(usize, usize, usize, f64); 2],
}

/// Rows of one constraint, force or torque.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinkRows {
    /// J, M^-1 J', axes and impulses; `contact` is the index of the constraint. Its targets and friction are
    /// unused.
    pub rows: ContactRows,
    /// Members of the island and bodies of the ends; no body if it cannot move.
    pub ends: [(usize, Option<usize>); 2],
    /// Point at which forces act, world.
    pub point: DVec3,
    /// Whether it is a block of torques.
    pub turns: bool,
    /// Joints of a gear.
    pub gear: Option<GearRow>,
    /// Errors before the step, m or rad.
    pub errors: [f64; 3],
    /// Predicted errors after the step with the last velocities, m or rad.
    pub errors_after: [f64; 3],
    /// Departure of the last step from its tangent, m or rad.
    pub bent: [f64; 3],
    /// The step, s.
    pub h: f64,
    /// Target velocities, m/s or rad/s.
    pub targets: [f64; 3],
    /// Target velocities without the curvature correction, m/s or rad/s.
    pub aimed: [f64; 3],
    /// Assumed departure of this step from its tangent, m or rad, which is corrected in advance.
    pub ahead: [f64; 3],
    /// `ahead` as predicted from the previous step, m or rad.
    pub first_ahead: [f64; 3],
    /// Departure from the tangent with the present velocities, m or rad.
    pub bending: [f64; 3],
    /// Whether it only brakes.
    pub is_brake: bool,
    /// Whether a client drags at it.
    pub is_dragged: bool,
    /// Whether velocities correct its errors.
    pub is_pulled: bool,
    /// Largest error that is left to velocities, m or rad.
    pub within: f64,
    /// Stored `errors_after`, to restore, m or rad.
    pub errors_kept: [f64; 3],
    /// Residual of split velocities: their difference from those that correct the errors, m/s or rad/s.
    /// `None` if positions were not to be corrected.
    pub split_residual: Option<[f64; 3]>,
    /// Projection of targets that removes directions without rows: nn, nt, nu, tt, tu, uu.
    pub directions: [f64; 6],
    /// Maximum norm of the impulse, N s or N m s.
    pub most: f64,
    /// Whether its only row pulls and does not push.
    pub is_one_sided: bool,
    /// R.
    pub compliance: f64,
    /// (J M^-1 J' + R)^-1: nn, nt, nu, tt, tu, uu.
    pub inverse: [f64; 6],
    /// Active rows of the last solution.
    pub state: LinkState,
    /// Weights in the matrix of the direct solver: nn, nt, nu, tt, tu, uu.
    pub weights: [f64; 6],
    /// Velocities of the rows in the direct solver.
    pub speeds: [f64; 3],
    /// Changes of `speeds` by the direct solver's solution.
    pub ways: [f64; 3],
    /// Impulse at the start of the direct solver's round.
    pub used: [f64; 3],
    /// Residuals of the equations in the direct solver.
    pub residuals: [f64; 3],
}

impl Aim {
    /// Returns the size of the error, m or rad.
    pub fn error(&self) -> f64 {
        DVec3::from_array(self.errors).length()
    }
}

impl LinkRows {
    /// Predicts from the last step how far this one leaves its tangent.
    pub fn predict_drift(&mut self, last: Option<Motion>) {
        (self.bent, self.ahead) = ([0.0; 3], [0.0; 3]);
        if let Some(Motion { predicted, bent: before }) = last.filter(|_| !self.is_slack()) {
            let bent = DVec3::from_array(self.errors) - DVec3::from_array(predicted);
            let (size, change) = (bent.length(), bent.distance(DVec3::from_array(before)));
            // A quantity that changes this fast from step to step is not predictable: using it would damp the
            // motion across the constraint.
            if size > 0.0 && size < MAX_DEPARTURE && !self.is_far() {
                self.ahead = (bent * (1.0 - UNSTEADY * change / size).max(0.0)).to_array();
            }
            self.bent = bent.to_array();
        }
        self.first_ahead = self.ahead;
    }

    /// Computes the targets.
    fn set_targets(&mut self) {
        let correction = DVec3::from_array(self.errors) * (-ERROR_REDUCTION / self.h);
        self.aimed = if self.is_slack() {
            // It may move until it is tight.
            [-self.errors[0] / self.h, 0.0, 0.0]
        } else if self.is_pulled {
            correction.clamp_length_max(MAX_CORRECTION[usize::from(self.turns)]).to_array()
        } else if correction.length() <= self.gentle() {
            correction.to_array()
        } else {
            [0.0; 3]
        };
        self.set_drift_targets(self.ahead);
    }

    /// Recomputes the targets for an assumed departure of a step from its tangent, m or rad.
    pub fn set_drift_targets(&mut self, ahead: [f64; 3]) {
        self.ahead = ahead;
        self.targets = weigh(self.directions, [0, 1, 2].map(|k| self.aimed[k] - ahead[k] / self.h));
    }

    /// Returns the largest velocity that corrects errors of a block that no client drags, m/s or rad/s.
    fn gentle(&self) -> f64 {
        let impulse = DVec3::from_array(self.rows.impulse).length();
        GENTLE.max(GIVEN_WAY * self.compliance * impulse)
    }

    /// Returns the largest error that is left to velocities, m or rad.
    pub fn near(&self) -> f64 {
        self.gentle() * self.h / ERROR_REDUCTION
    }

    /// Returns whether errors are within these limits, m and rad.
    pub fn is_within(&self, most: [f64; 2]) -> bool {
        DVec3::from_array(self.errors).length() <= most[usize::from(self.turns)]
    }

    /// Returns whether this impulse is at its maximum.
    pub fn is_at_most(&self, impulse: [f64; 3]) -> bool {
        DVec3::from_array(impulse).length() >= self.most * (1.0 - 1e-9)
    }

    /// Returns whether it is a slack rope.
    pub fn is_slack(&self) -> bool {
        self.is_one_sided && self.errors[0] > 0.0
    }

    /// Returns whether its error is larger than loads cause.
    pub fn is_far(&self) -> bool {
        !self.is_slack() && DVec3::from_array(self.errors).length() > FAR[usize::from(self.turns)]
    }

    /// Returns whether velocities correct the whole error.
    pub fn is_near(&self) -> bool {
        DVec3::from_array(self.errors).length() <= self.near()
    }

    /// Returns whether it has a large error that velocities do not correct.
    pub fn is_put_far(&self) -> bool {
        !self.is_brake && !self.is_pulled && self.is_far()
    }

    /// Returns the size of its errors after the step, m or rad.
    pub fn error_after(&self) -> f64 {
        let [n, t, u] = weigh(self.directions, self.errors_after);
        if self.is_one_sided && n > 0.0 { 0.0 } else { DVec3::new(n, t, u).length() }
    }

    /// Stops correcting errors by velocities, and holds the present position.
    pub fn stop_pulling(&mut self) {
        self.is_pulled = false;
        (self.ahead, self.first_ahead) = ([0.0; 3], [0.0; 3]);
        self.soften(COMPLIANCE);
        self.set_targets();
    }

    /// Computes J M^-1 J' from the blocks. A direction in which no joint can move, such as out of the plane
    /// of a planar linkage, has no row: its J is rounding.
    pub fn measure(&mut self, blocks: &mut [f64]) {
        for side in self.rows.sides.iter().filter(|side| side.len > 0) {
            side.drop_small_rows(IMMOVABLE[usize::from(self.turns)], blocks);
        }
        self.rows.measure(blocks);
        self.directions = ALL_DIRECTIONS;
        self.drop_singular(blocks);
        self.soften(if self.is_brake {
            (BRAKE / self.h - 1.0).max(COMPLIANCE)
        } else if self.is_pulled && self.is_far() {
            FAR_COMPLIANCE
        } else {
            COMPLIANCE
        });
        self.set_targets();
    }

    /// Returns the mean J M^-1 J' of its rows.
    pub fn mean_effect(&self) -> f64 {
        let [nn, _, _, tt, _, uu] = self.rows.effect;
        let count = [nn, tt, uu].into_iter().filter(|effect| *effect > 0.0).count().max(1);
        (nn + tt + uu) / count as f64
    }

    /// Sets R to this part of the mean J M^-1 J'.
    pub fn soften(&mut self, part: f64) {
        let [nn, nt, nu, tt, tu, uu] = self.rows.effect;
        let r = part * self.mean_effect();
        self.compliance = r;
        let (nn, tt, uu) = (nn + r, tt + r, uu + r);
        let (a, b, c) = (tt * uu - tu * tu, nu * tu - nt * uu, nt * tu - nu * tt);
        let determinant = nn * a + nt * b + nu * c;
        self.inverse = [a, b, c, nn * uu - nu * nu, nt * nu - nn * tu, nn * tt - nt * nt]
            .map(|entry| entry / determinant);
    }

    /// Removes directions from the block in which hardly anything can move.
    fn drop_singular(&mut self, blocks: &mut [f64]) {
        let [nn, nt, nu, tt, tu, uu] = self.rows.effect;
        let trace = nn + tt + uu;
        let determinant = nn * (tt * uu - tu * tu) - nt * (nt * uu - tu * nu) + nu * (nt * tu - tt * nu);
        if determinant > SINGULAR * trace * trace * trace {
            return;
        }
        let (values, vectors) = eigen(self.rows.effect);
        let largest = values.into_iter().fold(0.0, f64::max);
        // I - v v' for each of them.
        let mut kept = ALL_DIRECTIONS;
        for (value, [n, t, u]) in values.into_iter().zip(vectors) {
            if value <= SINGULAR * largest {
                let square = [n * n, n * t, n * u, t * t, t * u, u * u];
                kept.iter_mut().zip(square).for_each(|(kept, square)| *kept -= square);
            }
        }
        for side in self.rows.sides.iter().filter(|side| side.len > 0) {
            side.combine_rows(|rows| weigh(kept, rows), blocks);
        }
        self.directions = kept;
        self.rows.impulse = weigh(kept, self.rows.impulse);
        self.rows.measure(blocks);
    }

    /// Returns whether it can move anything.
    pub fn acts(&self) -> bool {
        self.compliance > 0.0 && self.inverse.iter().all(|entry| entry.is_finite())
    }

    /// Returns whether the velocities before the step differ from the target. Then they were set by a client,
    /// and a whole kick brings them there.
    pub fn meets_jump(&self, blocks: &[f64], before: &[f64]) -> bool {
        let before = self.rows.velocities(blocks, before);
        let is_off =
            before.into_iter().zip(self.targets).any(|(before, target)| (before - target).abs() > AT_REST);
        is_off && !(self.is_one_sided && before[0] >= self.targets[0])
    }
}

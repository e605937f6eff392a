//! The rows of a constraint between links: up to three forces, or three torques, as one block.
//!
//! A row is J v + R p = target, with a small R that stays: of constraints that say the same twice each then has a force of a definite
//! size. The block's impulse is at most of a given size, by its norm, so that it does not
//! depend on the axes of the frames.
//!
//! The target has two parts. What R gives way by is put right, and no more: a velocity that closed an error would be a motor, which puts
//! energy in wherever the error does not close. What is left of an error is put right in
//! [positions alone](crate::dynamics::island), unless a client drags at the constraint, which is then to move what it holds: a part
//! [`ERROR_REDUCTION`] of the error in each step (Baumgarte's method; as PyBullet's `erp` and MuJoCo's `solref` of 2.2 steps). And what
//! the velocities of the last step bent away from is put right beforehand: positions
//! move along curves, and rows are tangents. Where q + h v is off the curve by h^2/2 v' H v, the velocity that stays on it has
//! J v = -h/2 v' H v (SHAKE: Ryckaert, Ciccotti and Berendsen (1977)). That is first taken from the last step, as the
//! difference between the error that it foresaw and the error that is found, which leaves an error of third order in h; and then, where
//! rows are solved directly, [from the positions that the velocities lead to](crate::dynamics::island). So no energy goes
//! into or out of what moves on a curve.

mod impulses;

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use super::ERROR_REDUCTION;
use super::contact::ContactRows;
use super::three_rows::{eigen, weigh};

/// R as a part of the mean J M^-1 J' of the block.
const COMPLIANCE: f64 = 1e-5;

/// Errors of more than this are not those of a load, m and rad: under two million times the weight of what hangs on it a constraint gives
/// by that much in a step of 1 ms.
pub const FAR: [f64; 2] = [1e-3, 3e-3];

/// R of what is dragged and as far off as that: where links can hardly move towards where they are to be, as a chain that is nearly
/// straight, its joints would turn ever faster (damped least squares: Wampler (1986)).
const FAR_COMPLIANCE: f64 = 0.05;

/// Velocities put errors right at this, m/s or rad/s, where loads ask for less: an energy of 5e-11 J/kg.
const GENTLE: f64 = 1e-5;

/// The same as a part of R p.
const GIVEN_WAY: f64 = 2.0;

/// What brakes contradictions takes their relative motion away within this, s.
const BRAKE: f64 = 0.05;

/// Errors are put right no faster than this, m/s, and of angles rad/s: fast enough for what scripts drag along.
pub const MAX_CORRECTION: [f64; 2] = [10.0, 30.0];

/// A larger departure from the tangent in one step means that something was teleported, m or rad.
const MOST_BENT: f64 = 1e-2;

/// J of what no joint can move is below this, metres, and of torques 1.
const IMMOVABLE: [f64; 2] = [1e-10, 1e-4];

/// Along directions in which J M^-1 J' is less than this part of its largest, a block has no row: links of a plane linkage that its
/// description places a micrometre out of the plane would press against each other as steel does.
const SINGULAR: f64 = 1e-8;

/// The identity: nn, nt, nu, tt, tu, uu.
const ALL_DIRECTIONS: [f64; 6] = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0];

/// A velocity before the step that is not yet what the rows ask for, m/s or rad/s.
const AT_REST: f64 = 1e-6;

/// The correction is predicted from the last step. It is dropped where it changed by more than 1 / this of itself since then.
const UNSTEADY: f64 = 2.0;

/// What a step leaves of a block for the next one to foresee how far its motion leaves a tangent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// The errors that its velocities lead to, as far as they are linear, m or rad.
    pub foreseen: [f64; 3],
    /// By how much the step before left its tangent.
    pub bent: [f64; 3],
}

/// Axes of rows, world, and errors along them; what has no row has no axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aim {
    /// Of unit length, or zero.
    pub axes: [DVec3; 3],
    /// m or rad.
    pub errors: [f64; 3],
}

/// Which of a block's rows are equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkState {
    /// A rope is slack.
    Open,
    /// They are.
    #[default]
    Holds,
    /// It does what it may do at the most.
    Saturated,
}

/// Two joints of one axis each, as a row.
#[derive(Clone, Copy, Debug)]
pub struct GearRow {
    /// Of each joint: member of the island, body, index of its velocity, factor.
    pub joints: [(usize, usize, usize, f64); 2],
}

/// A block.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinkRows {
    /// J, M^-1 J', axes and impulses; `contact` is the index of the constraint. What it says of targets and friction is
    /// not used.
    pub rows: ContactRows,
    /// Members of the island and bodies of the ends; no body where it cannot move.
    pub ends: [(usize, Option<usize>); 2],
    /// Where forces act.
    pub point: DVec3,
    /// It is one of torques.
    pub turns: bool,
    /// It is a gear.
    pub gear: Option<GearRow>,
    /// m or rad.
    pub errors: [f64; 3],
    /// The same after the step, with velocities that were looked at last.
    pub errors_after: [f64; 3],
    /// By how much the last step left its tangent, m or rad.
    pub bent: [f64; 3],
    /// The step, s.
    pub h: f64,
    /// m/s or rad/s.
    pub targets: [f64; 3],
    /// The targets without what is put right beforehand.
    pub aimed: [f64; 3],
    /// By how much this step is taken to leave its tangent, m or rad: what is put right beforehand.
    pub ahead: [f64; 3],
    /// The same as it was taken from the step before.
    pub first_ahead: [f64; 3],
    /// By how much the velocities found now would leave it.
    pub bending: [f64; 3],
    /// It only brakes.
    pub is_brake: bool,
    /// A client drags at it.
    pub is_dragged: bool,
    /// Velocities put its errors right.
    pub is_pulled: bool,
    /// Errors up to this are left to velocities, m or rad.
    pub within: f64,
    /// Errors after the step that are gone back to.
    pub errors_kept: [f64; 3],
    /// The residual of split velocities: how far they are from what puts errors right, m/s or rad/s, where positions were to be put right.
    pub split_residual: Option<[f64; 3]>,
    /// What takes directions without rows out of targets: nn, nt, nu, tt, tu, uu.
    pub directions: [f64; 6],
    /// The impulse's norm at the most, N s or N m s.
    pub most: f64,
    /// Its only row pulls and does not push.
    pub is_one_sided: bool,
    /// R.
    pub compliance: f64,
    /// (J M^-1 J' + R)^-1: nn, nt, nu, tt, tu, uu.
    pub inverse: [f64; 6],
    /// Of the last solution.
    pub state: LinkState,
    /// Of the direct solver: weights in its matrix, nn, nt, nu, tt, tu, uu.
    pub weights: [f64; 6],
    /// The same: velocities of the rows, and what its solution changes them by.
    pub speeds: [f64; 3],
    /// The same.
    pub ways: [f64; 3],
    /// The same: the impulse that a round began with.
    pub used: [f64; 3],
    /// The same: what is left of its equations.
    pub residuals: [f64; 3],
}

impl Aim {
    /// The size of the error, m or rad.
    pub fn error(&self) -> f64 {
        DVec3::from_array(self.errors).length()
    }
}

impl LinkRows {
    /// Foresees from the last step how far this one leaves its tangent.
    pub fn foresee(&mut self, last: Option<Motion>) {
        (self.bent, self.ahead) = ([0.0; 3], [0.0; 3]);
        if let Some(Motion { foreseen, bent: before }) = last.filter(|_| !self.is_slack()) {
            let bent = DVec3::from_array(self.errors) - DVec3::from_array(foreseen);
            let (size, change) = (bent.length(), bent.distance(DVec3::from_array(before)));
            // What changes from step to step as fast as this is no guide: without it the motion across the constraint is damped.
            if size > 0.0 && size < MOST_BENT && !self.is_far() {
                self.ahead = (bent * (1.0 - UNSTEADY * change / size).max(0.0)).to_array();
            }
            self.bent = bent.to_array();
        }
        self.first_ahead = self.ahead;
    }

    /// What it aims at.
    fn aim(&mut self) {
        let correction = DVec3::from_array(self.errors) * (-ERROR_REDUCTION / self.h);
        self.aimed = if self.is_slack() {
            // It may go on to where it is tight.
            [-self.errors[0] / self.h, 0.0, 0.0]
        } else if self.is_pulled {
            correction.clamp_length_max(MAX_CORRECTION[usize::from(self.turns)]).to_array()
        } else if correction.length() <= self.gentle() {
            correction.to_array()
        } else {
            [0.0; 3]
        };
        self.aim_ahead(self.ahead);
    }

    /// Aims anew, with what a step is taken to leave its tangent by, m or rad.
    pub fn aim_ahead(&mut self, ahead: [f64; 3]) {
        self.ahead = ahead;
        self.targets = weigh(self.directions, [0, 1, 2].map(|k| self.aimed[k] - ahead[k] / self.h));
    }

    /// The velocity at which errors are put right that nothing drags at, m/s or rad/s.
    fn gentle(&self) -> f64 {
        let impulse = DVec3::from_array(self.rows.impulse).length();
        GENTLE.max(GIVEN_WAY * self.compliance * impulse)
    }

    /// Errors up to this are left to velocities, m or rad.
    pub fn near(&self) -> f64 {
        self.gentle() * self.h / ERROR_REDUCTION
    }

    /// Whether errors are no larger than this, m and rad.
    pub fn is_within(&self, most: [f64; 2]) -> bool {
        DVec3::from_array(self.errors).length() <= most[usize::from(self.turns)]
    }

    /// Whether this impulse is all that it may do.
    pub fn is_at_most(&self, impulse: [f64; 3]) -> bool {
        DVec3::from_array(impulse).length() >= self.most * (1.0 - 1e-9)
    }

    /// It is a rope that is slack.
    pub fn is_slack(&self) -> bool {
        self.is_one_sided && self.errors[0] > 0.0
    }

    /// Whether it is farther from what it asks for than loads would take it.
    pub fn is_far(&self) -> bool {
        !self.is_slack() && DVec3::from_array(self.errors).length() > FAR[usize::from(self.turns)]
    }

    /// Whether velocities put right all of the error that there is.
    pub fn is_near(&self) -> bool {
        DVec3::from_array(self.errors).length() <= self.near()
    }

    /// Whether it is put to a place that is far away, without velocities.
    pub fn is_put_far(&self) -> bool {
        !self.is_brake && !self.is_pulled && self.is_far()
    }

    /// The size of its errors after the step, m or rad.
    pub fn error_after(&self) -> f64 {
        let [n, t, u] = weigh(self.directions, self.errors_after);
        if self.is_one_sided && n > 0.0 { 0.0 } else { DVec3::new(n, t, u).length() }
    }

    /// Holds where it is, instead of putting errors right by velocities.
    pub fn stop_pulling(&mut self) {
        self.is_pulled = false;
        (self.ahead, self.first_ahead) = ([0.0; 3], [0.0; 3]);
        self.soften(COMPLIANCE);
        self.aim();
    }

    /// Takes J M^-1 J' from the blocks. What no joint can move, as what leads out of the plane of a plane linkage, has no row:
    /// its J is rounding.
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
        self.aim();
    }

    /// The mean J M^-1 J' of its rows.
    pub fn mean_effect(&self) -> f64 {
        let [nn, _, _, tt, _, uu] = self.rows.effect;
        let count = [nn, tt, uu].into_iter().filter(|effect| *effect > 0.0).count().max(1);
        (nn + tt + uu) / count as f64
    }

    /// Makes R this part of the mean J M^-1 J'.
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

    /// Takes directions out of the block in which hardly anything can move.
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

    /// Whether it can move anything.
    pub fn acts(&self) -> bool {
        self.compliance > 0.0 && self.inverse.iter().all(|entry| entry.is_finite())
    }

    /// Whether the velocities before the step are beside what is asked for: then they were given, and a whole kick
    /// brings them there.
    pub fn meets_jump(&self, blocks: &[f64], before: &[f64]) -> bool {
        let before = self.rows.velocities(blocks, before);
        let is_off =
            before.into_iter().zip(self.targets).any(|(before, target)| (before - target).abs() > AT_REST);
        is_off && !(self.is_one_sided && before[0] >= self.targets[0])
    }
}

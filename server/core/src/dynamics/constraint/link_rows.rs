//! The rows of a constraint between links: up to three forces, or three torques, as one block.
//!
//! A row is J v + R p = target, with a small R that stays: constraints that contradict each other then settle where the sum of R p^2 is the
//! least, and each has a force of a definite size. The block's impulse is at most of a given size, by its norm, so that it does not
//! depend on the axes of the frames.
//!
//! The target has two parts. A part [`ERROR_REDUCTION`] of the error is put right in each step (Baumgarte's method; as PyBullet's `erp`
//! and MuJoCo's `solref` of 2.2 steps). And what the velocities of the last step bent away from is put right beforehand: positions
//! move along curves, and rows are tangents. Where q + h v is off the curve by h^2/2 v' H v, the velocity that stays on it has
//! J v = -h/2 v' H v (SHAKE: Ryckaert, Ciccotti and Berendsen (1977)). That is first taken from the last step, as the
//! difference between the error that it foresaw and the error that is found, which leaves an error of third order in h; and then, where
//! rows are solved directly, [from the positions that the velocities lead to](crate::dynamics::island). So no energy goes
//! into or out of what moves on a curve.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use super::ERROR_REDUCTION;
use super::contact::ContactRows;

/// R as a part of the mean J M^-1 J' of the block.
const COMPLIANCE: f64 = 1e-5;

/// Errors of more than this are not those of a load, m and rad: under two million times the weight of what hangs on it a constraint gives
/// by that much in a step of 1 ms.
pub const FAR: [f64; 2] = [1e-3, 3e-3];

/// R of what is as far off as that: where links can hardly move towards where they are to be, as a chain that is nearly straight, its
/// joints would turn ever faster (damped least squares: Wampler (1986)).
const FAR_COMPLIANCE: f64 = 0.05;

/// Errors are put right no faster than this, m/s, and of angles rad/s: fast enough for what scripts drag along.
pub const MAX_CORRECTION: [f64; 2] = [10.0, 30.0];

/// A curve that leads farther away from its tangent in a step is none: something has been put elsewhere. m or rad.
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

/// What leaves its tangent otherwise than in the step before by a part 1 / this of that is not foreseen at all.
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
    /// By how much the last step left its tangent, m or rad.
    pub bent: [f64; 3],
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
    /// In the last step it was far from the fastest target that there is.
    pub was_unreached: bool,
    /// Of what contradicts other constraints, how far its velocities are from what it aimed at, m/s or rad/s.
    pub unreached: Option<[f64; 3]>,
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

impl LinkRows {
    /// What it aims at in a step of `h`, from errors found now and what the last step left.
    pub fn aim(&mut self, last: Option<Motion>, h: f64) {
        (self.bent, self.ahead, self.first_ahead) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        if self.is_one_sided && self.errors[0] > 0.0 {
            // Slack: it may go on to where it is tight.
            self.aimed = [-self.errors[0] / h, 0.0, 0.0];
            self.targets = self.aimed;
            return;
        }
        // Where constraints contradict each other, what they have in common follows from whole errors, and is slowed down afterwards.
        let most = if self.is_far() && self.most.is_infinite() && self.was_unreached {
            f64::INFINITY
        } else {
            MAX_CORRECTION[usize::from(self.turns)]
        };
        let correction = DVec3::from_array(self.errors) * (-ERROR_REDUCTION / h);
        let mut ahead = DVec3::ZERO;
        if let Some(Motion { foreseen, bent: before }) = last {
            let bent = DVec3::from_array(self.errors) - DVec3::from_array(foreseen);
            let (size, change) = (bent.length(), bent.distance(DVec3::from_array(before)));
            // What changes from step to step as fast as this is no guide: without it the motion across the constraint is damped.
            if size > 0.0 && size < MOST_BENT {
                ahead = bent * (1.0 - UNSTEADY * change / size).max(0.0);
            }
            self.bent = bent.to_array();
        }
        self.aimed = correction.clamp_length_max(most).to_array();
        (self.ahead, self.first_ahead) = (ahead.to_array(), ahead.to_array());
        self.targets = (DVec3::from_array(self.aimed) - ahead / h).to_array();
    }

    /// Aims anew, with what a step of `h` is taken to leave its tangent by, m or rad.
    pub fn aim_ahead(&mut self, ahead: [f64; 3], h: f64) {
        self.ahead = ahead;
        self.targets = weigh(self.directions, [0, 1, 2].map(|k| self.aimed[k] - ahead[k] / h));
    }

    /// Whether it is farther from what it asks for than loads would take it.
    pub fn is_far(&self) -> bool {
        let is_slack = self.is_one_sided && self.errors[0] > 0.0;
        !is_slack && DVec3::from_array(self.errors).length() > FAR[usize::from(self.turns)]
    }

    /// Aims at these velocities instead, m/s or rad/s: what it aimed at is farther off by `unreached`.
    pub fn go_on_at(&mut self, speeds: [f64; 3], unreached: [f64; 3]) {
        (self.ahead, self.first_ahead) = ([0.0; 3], [0.0; 3]);
        (self.aimed, self.targets) = (speeds, speeds);
        self.unreached = Some(unreached);
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
        let [nn, nt, nu, tt, tu, uu] = self.rows.effect;
        let count = [nn, tt, uu].into_iter().filter(|effect| *effect > 0.0).count().max(1);
        let part = if self.is_far() { FAR_COMPLIANCE } else { COMPLIANCE };
        let r = part * (nn + tt + uu) / count as f64;
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
        self.targets = weigh(kept, self.targets);
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

    /// An impulse as far as it may go.
    pub fn bounded(&self, [n, t, u]: [f64; 3]) -> ([f64; 3], LinkState) {
        if self.is_one_sided && n <= 0.0 {
            return ([0.0; 3], LinkState::Open);
        }
        let size = DVec3::new(n, t, u).length();
        if size <= self.most {
            return ([n, t, u], LinkState::Holds);
        }
        let part = self.most / size;
        ([n * part, t * part, u * part], LinkState::Saturated)
    }

    /// target - J v - R p, at these velocities of the rows.
    pub fn residual(&self, velocities: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.targets[k] - velocities[k] - self.compliance * self.rows.impulse[k])
    }

    /// The impulse of the soft block at these velocities, and the weights of its derivative.
    pub fn soft(&self, velocities: [f64; 3]) -> ([f64; 3], [f64; 6], LinkState) {
        let hardness = 1.0 / self.compliance;
        let raw = [0, 1, 2].map(|k| (self.targets[k] - velocities[k]) * hardness);
        let (impulse, state) = self.bounded(raw);
        let weights = match state {
            LinkState::Open => [0.0; 6],
            LinkState::Holds => [hardness, 0.0, 0.0, hardness, 0.0, hardness],
            LinkState::Saturated => {
                let size = DVec3::from_array(raw).length();
                let (w, [n, t, u]) = (hardness * self.most / size, raw.map(|raw| raw / size));
                let [nt, nu, tu] = [-w * n * t, -w * n * u, -w * t * u];
                [w * (1.0 - n * n), nt, nu, w * (1.0 - t * t), tu, w * (1.0 - u * u)]
            }
        };
        (impulse, weights, state)
    }

    /// The same where it is known whether they are equations; what is saturated has the impulse that it had.
    pub fn given(&self, velocities: [f64; 3]) -> ([f64; 3], [f64; 6]) {
        let hardness = 1.0 / self.compliance;
        match self.state {
            LinkState::Open => ([0.0; 3], [0.0; 6]),
            LinkState::Saturated => (self.rows.impulse, [0.0; 6]),
            LinkState::Holds => (
                [0, 1, 2].map(|k| (self.targets[k] - velocities[k]) * hardness),
                [hardness, 0.0, 0.0, hardness, 0.0, hardness],
            ),
        }
    }

    /// Weights times changes of velocities.
    pub fn weighted(&self, [n, t, u]: [f64; 3]) -> [f64; 3] {
        weigh(self.weights, [n, t, u])
    }

    /// Gives the block the impulse that makes its rows hold, as far as it may go. The largest change of a row's velocity.
    pub fn solve(&mut self, blocks: &[f64], velocities: &mut [f64]) -> f64 {
        let residual = self.residual(self.rows.velocities(blocks, velocities));
        let step = weigh(self.inverse, residual);
        let before = self.rows.impulse;
        let (mut impulse, mut state) = self.bounded([0, 1, 2].map(|k| before[k] + step[k]));
        let [nn, _, _, tt, _, uu] = self.rows.effect;
        if state == LinkState::Saturated && !self.is_one_sided {
            // As for the friction of what slips: a step against the motion.
            let length = 1.0 / (nn + tt + uu + self.compliance);
            (impulse, state) = self.bounded([0, 1, 2].map(|k| before[k] + length * residual[k]));
        }
        self.state = state;
        let change = [0, 1, 2].map(|k| impulse[k] - before[k]);
        if change == [0.0; 3] {
            return 0.0;
        }
        self.rows.impulse = impulse;
        self.rows.apply_impulse(blocks, change, velocities);
        (change[0] * nn).abs().max((change[1] * tt).abs()).max((change[2] * uu).abs())
    }
}

/// Eigenvalues and eigenvectors of a symmetric matrix, nn, nt, nu, tt, tu, uu, by Jacobi's rotations.
pub fn eigen([nn, nt, nu, tt, tu, uu]: [f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
    /// Each makes what is beside the diagonal quadratically smaller.
    const ROUNDS: usize = 8;
    let mut matrix = [[nn, nt, nu], [nt, tt, tu], [nu, tu, uu]];
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(3 * ROUNDS) {
        if matrix[p][q] == 0.0 {
            continue;
        }
        let theta = 0.5 * (matrix[q][q] - matrix[p][p]) / matrix[p][q];
        let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
        let cosine = 1.0 / tangent.hypot(1.0);
        let sine = tangent * cosine;
        for row in &mut matrix {
            (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
        }
        let (a, b) = (matrix[p], matrix[q]);
        for k in 0..3 {
            (matrix[p][k], matrix[q][k]) = (cosine * a[k] - sine * b[k], sine * a[k] + cosine * b[k]);
        }
        let (a, b) = (vectors[p], vectors[q]);
        for k in 0..3 {
            (vectors[p][k], vectors[q][k]) = (cosine * a[k] - sine * b[k], sine * a[k] + cosine * b[k]);
        }
    }
    ([matrix[0][0], matrix[1][1], matrix[2][2]], vectors)
}

/// A symmetric matrix, nn, nt, nu, tt, tu, uu, times a vector.
pub fn weigh([nn, nt, nu, tt, tu, uu]: [f64; 6], [n, t, u]: [f64; 3]) -> [f64; 3] {
    [nn * n + nt * t + nu * u, nt * n + tt * t + tu * u, nu * n + tu * t + uu * u]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_make_a_matrix_again() {
        for matrix in
            [[2.0, 0.3, -0.4, 1.0, 0.2, 3.0], [1.0, 1.0, 1.0, 1.0, 1.0, 1.0], [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]]
        {
            let (values, vectors) = eigen(matrix);
            let mut again = [0.0; 6];
            for (value, [n, t, u]) in values.into_iter().zip(vectors) {
                let square = [n * n, n * t, n * u, t * t, t * u, u * u];
                again.iter_mut().zip(square).for_each(|(sum, square)| *sum += value * square);
            }
            for (again, given) in again.into_iter().zip(matrix) {
                assert!((again - given).abs() < 1e-14, "{again} {given}");
            }
        }
    }
}

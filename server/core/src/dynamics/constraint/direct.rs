//! All rows of an island at once: exact where sweeps would go on for long, and with the least impulses. Rows of constraints between links
//! keep their R, and so do normals of contacts whose surfaces are springs.
//!
//! A row is active where it is an equation: a contact that presses, friction that holds, a joint at its limit. For
//! a set of active rows the impulses are those of
//!
//! M (v - v0) = J' p,  J v + R p = target,  R -> 0,
//!
//! and so the least among those that give the same motion, by the sum of R p^2. R is the same for all contacts of
//! two robots, and so for them by the sum of the squares of impulses. It is solved with an R of [`SOFTNESS`] for the
//! velocities, whose matrix M + J' R^-1 J has the sparsity of who touches whom: Castro, Permenter and Han, "An
//! unconstrained convex formulation of compliant contact" (2022). From zero, the steps of refinement take the
//! softness out again and keep to the least impulses: what they add is R^-1 times velocities of bodies as well.
//!
//! Which rows are active is found by Newton's method. With the bounds of friction given, the soft problem is the minimum of a convex
//! function of the velocities, and a step of Newton goes only as far as that function falls: so rows do not change to and
//! fro, as they may where each round takes the whole step (Alart and Curnier, "A mixed formulation for frictional contact
//! problems prone to Newton like solution methods" (1991)). The bounds of what slips are those of the normal impulses, a
//! fixed point, which is accelerated by Anderson's method.

pub(in crate::dynamics) mod anderson;
mod equations;
mod newton;

use super::contact::ContactRows;
use super::link_rows::LinkRows;
use super::{Constraints, Row};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::block_cholesky::{BlockCholesky, MOST_NODES, factorisation_cost};
use crate::dynamics::inertia::Rigid;
use crate::dynamics::island::Member;
use anderson::Anderson;
pub(in crate::dynamics) use equations::{EXACT, REFINEMENTS};
use newton::Progress;
pub(in crate::dynamics) use newton::{FLAT, HALVINGS};

/// R as a part of the mean J M^-1 J' of the rows it belongs to.
pub(in crate::dynamics) const SOFTNESS: f64 = 1e-7;

/// A row is violated beyond this part of its impulse, or this velocity, m/s or rad/s.
pub(in crate::dynamics) const TOLERANCE: f64 = 1e-9;

/// The friction of what slips has settled when it changes by less than this part of the normal impulse.
pub(in crate::dynamics) const SLIP_TOLERANCE: f64 = 1e-7;

/// Multiplications that a factorisation may take for each that a sweep takes, and those that it always may.
const COST: (usize, usize) = (20, 100_000);

/// The latter where there are constraints between links: sweeps close no long loop.
const LINKED_COST: usize = 1_000_000;

/// Multiplications that the matrix and its factorisation may each take beside sweeps of so many.
fn most_cost(sweep: usize, has_links: bool) -> usize {
    COST.0 * sweep + if has_links { LINKED_COST } else { COST.1 }
}

/// Those of a contact of robots with so many velocities in a sweep.
fn sweep_cost(len: usize) -> usize {
    7 * len
}

/// The same in the matrix.
fn matrix_cost([a, b]: [usize; 2]) -> usize {
    4 * (a * a + b * b + a * b)
}

/// Whether a robot of so many velocities that has so many contacts, with what cannot move, can be solved here.
pub(in crate::dynamics) fn is_worth_it(len: usize, contacts: usize) -> bool {
    let most = most_cost(contacts * sweep_cost(len), false);
    contacts * matrix_cost([len, 0]) <= most && factorisation_cost(len, 0) <= most
}

/// What became of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All rows hold.
    Solved,
    /// It was not found in time which rows are active: velocities and impulses are as they were.
    Unsolved,
    /// As the caller wanted.
    Interrupted,
}

/// Which of a contact's rows are equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// It does not press, or nothing can move.
    #[default]
    Open,
    /// It presses and slips.
    Slips,
    /// It presses and friction holds.
    Sticks,
}

impl State {
    fn of(presses: bool, sticks: bool) -> Self {
        match (presses, sticks) {
            (false, _) => Self::Open,
            (true, false) => Self::Slips,
            (true, true) => Self::Sticks,
        }
    }
}

/// The memory that it takes, kept from step to step.
#[derive(Debug, Default)]
pub struct Direct {
    matrix: BlockCholesky,
    /// M of each member, one after the other.
    inertias: Vec<f64>,
    composite: Vec<Rigid>,
    /// M (v - v0), by all impulses so far.
    momentum: Vec<f64>,
    /// The right side of a system, and then what its solution changes `momentum` by.
    force: Vec<f64>,
    /// The solution of a system.
    change: Vec<f64>,
    states: Vec<State>,
    /// Velocities of each contact's rows, and what the solution changes them by.
    speeds: Vec<[f64; 3]>,
    ways: Vec<[f64; 3]>,
    /// The most that friction of each contact can do, N s.
    bounds: Vec<f64>,
    /// What normal impulses make of these, less them.
    bound_residuals: Vec<f64>,
    /// Those of contacts that slip, else 0.
    slip_bounds: Vec<f64>,
    anderson: Anderson<f64>,
    /// Which contacts slipped in the last round.
    slipped: Vec<bool>,
    /// The impulses that the last step of each contact began with.
    used: Vec<[f64; 3]>,
    /// Weights of each contact's rows in the matrix: of the normal, and tt, tu, uu of the tangents.
    weights: Vec<[f64; 4]>,
    /// 1 / R of each contact: of the normal's row, and of the tangents'.
    hardness: Vec<[f64; 2]>,
    /// Of each contact, what is left of its equations.
    residuals: Vec<[f64; 3]>,
    joints: Vec<Joint>,
    /// Velocities and impulses to go back to.
    kept_velocities: Vec<f64>,
    kept_impulses: Vec<[f64; 3]>,
    kept_links: Vec<[f64; 3]>,
    /// The matrix has the factors of the last solution.
    is_solved: bool,
    /// What it costs is not looked at: for measurements.
    pub is_unbounded: bool,
}

/// A row of a joint.
#[derive(Clone, Copy, Debug)]
struct Joint {
    member: usize,
    /// Its index among those of its robot.
    row: usize,
    /// Velocities of the island and factors, as in [`Row`].
    entries: [(usize, f64); 2],
    bias: f64,
    least: f64,
    most: f64,
    impulse: f64,
    /// 1 / R.
    hardness: f64,
    residual: f64,
    is_active: bool,
    /// J qd + bias, and what the solution changes it by.
    speed: f64,
    way: f64,
}

/// An island, as it is being solved.
pub struct System<'a, R> {
    /// Those of the island.
    pub robots: &'a mut [R],
    /// The same: where their velocities are.
    pub members: &'a [Member],
    /// Contacts.
    pub rows: &'a mut [ContactRows],
    /// Constraints between links.
    pub links: &'a mut [LinkRows],
    /// Their J and M^-1 J'.
    pub blocks: &'a [f64],
    /// Velocities of all members without impulses.
    pub free: &'a [f64],
    /// Those with the impulses.
    pub velocities: &'a mut [f64],
}

impl Direct {
    /// Forgets the last island.
    pub fn begin(&mut self) {
        self.hardness.clear();
        self.is_solved = false;
    }

    /// Takes in an island whose contacts are measured. Whether it can be solved here: the matrix and its factorisation must
    /// each cost little beside the sweeps that they save, which they do for chains, stacks and single robots, and not for
    /// heaps, nor for a robot of many joints with many contacts.
    pub fn plan<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        members: &[Member],
        rows: &[ContactRows],
        links: &[LinkRows],
    ) -> bool {
        self.is_solved = false;
        if members.len() > MOST_NODES {
            return false;
        }
        self.matrix.begin(members.iter().map(|member| member.len));
        for (node, member) in members.iter().enumerate() {
            let robot = robots[node].as_mut();
            let couples = |row: &Row| row.entries[1].1 != 0.0;
            if member.len > 6 && !robot.constraints_mut().rows.iter().any(couples) {
                self.matrix.set_tree(node, robot.tree().velocity_parents());
            }
        }
        let (mut sweep, mut matrix) = (0usize, 0usize);
        for rows in rows.iter().chain(links.iter().map(|link| &link.rows)) {
            let [a, b] = &rows.sides;
            sweep += sweep_cost(a.len + b.len);
            matrix = matrix.saturating_add(matrix_cost([a.len, b.len]));
            if b.len > 0 {
                self.matrix.join(a.member, b.member);
            }
            if a.is_pair {
                self.matrix.join_branches(a.member);
            }
        }
        let most = if self.is_unbounded { usize::MAX } else { most_cost(sweep, !links.is_empty()) };
        if matrix > most || self.matrix.plan(most).is_none() {
            return false;
        }
        self.inertias.resize(members.iter().map(|member| member.len * member.len).sum(), 0.0);
        let mut rest = &mut self.inertias[..];
        members.iter().zip(robots).all(|(member, robot)| {
            let (own, after) = std::mem::take(&mut rest).split_at_mut(member.len * member.len);
            rest = after;
            robot.as_mut().write_implicit_inertia(&mut self.composite, own)
        })
    }

    /// Solves all rows in at most so many rounds; begins with what presses and slips now.
    pub fn solve<R: AsMut<Articulation>>(
        &mut self,
        mut system: System<'_, R>,
        rounds: usize,
        interrupt: &dyn Fn() -> bool,
    ) -> Outcome {
        self.keep(&mut system);
        self.begin_rounds(&system);
        for round in 0..rounds {
            if interrupt() {
                return Outcome::Interrupted;
            }
            match self.advance(&mut system, round == 0) {
                Some(Progress::Goes) => {}
                Some(Progress::Settled) if self.refine(&mut system) && self.holds(&system) => {
                    self.finish(&mut system);
                    self.is_solved = true;
                    return Outcome::Solved;
                }
                Some(Progress::Settled) | None => break,
            }
        }
        self.go_back(&mut system);
        Outcome::Unsolved
    }

    /// Solves once more, with the factors of the last solution, where only what constraints between links aim at has changed
    /// since. False where there are none, or other rows are equations now: then velocities and impulses are as they were.
    pub fn solve_again<R: AsMut<Articulation>>(&mut self, mut system: System<'_, R>) -> bool {
        if !self.is_solved {
            return false;
        }
        self.keep_impulses(&system);
        self.is_solved = self.refine(&mut system) && self.holds(&system);
        if self.is_solved {
            self.finish(&mut system);
        } else {
            self.go_back(&mut system);
        }
        self.is_solved
    }

    fn keep<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) {
        self.keep_impulses(system);
        self.joints.clear();
        for (index, member) in system.members.iter().enumerate() {
            let robot = system.robots[index].as_mut();
            for (row_index, row) in robot.constraints_mut().rows.iter().enumerate() {
                let Row { entries, bias, least, most, impulse, effect, .. } = *row;
                if effect > 0.0 {
                    self.joints.push(Joint {
                        member: index,
                        row: row_index,
                        entries: entries.map(|(velocity, factor)| (member.first + velocity, factor)),
                        bias,
                        least,
                        most,
                        impulse,
                        hardness: 1.0 / (SOFTNESS * effect),
                        residual: 0.0,
                        is_active: true,
                        speed: 0.0,
                        way: 0.0,
                    });
                }
            }
        }
        self.residuals.clear();
        self.residuals.resize(system.rows.len(), [0.0; 3]);
    }

    fn keep_impulses<R>(&mut self, system: &System<'_, R>) {
        self.kept_velocities.clear();
        self.kept_velocities.extend_from_slice(system.velocities);
        self.kept_impulses.clear();
        self.kept_impulses.extend(system.rows.iter().map(|rows| rows.impulse));
        self.kept_links.clear();
        self.kept_links.extend(system.links.iter().map(|link| link.rows.impulse));
    }

    fn go_back<R>(&mut self, system: &mut System<'_, R>) {
        system.velocities.copy_from_slice(&self.kept_velocities);
        for (rows, impulse) in system.rows.iter_mut().zip(&self.kept_impulses) {
            rows.impulse = *impulse;
        }
        for (link, impulse) in system.links.iter_mut().zip(&self.kept_links) {
            (link.rows.impulse, link.state) = link.bounded(*impulse);
        }
    }

    fn finish<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) {
        for joint in &self.joints {
            system.robots[joint.member].as_mut().constraints_mut().rows[joint.row].impulse = joint.impulse;
        }
    }
}

impl Joint {
    /// J qd + bias.
    fn velocity(&self, velocities: &[f64]) -> f64 {
        let [a, b] = self.entries;
        a.1 * velocities[a.0] + b.1 * velocities[b.0] + self.bias
    }

    /// The impulse of the soft row at this J qd + bias.
    fn soft(&self, speed: f64) -> f64 {
        (-speed * self.hardness).clamp(self.least, self.most)
    }

    /// Adds what an impulse does to the velocities of its robot.
    fn apply(&self, constraints: &Constraints, impulse: f64, velocities: &mut [f64]) {
        let n = velocities.len();
        let response = &constraints.responses[self.row * n..(self.row + 1) * n];
        velocities.iter_mut().zip(response).for_each(|(velocity, response)| *velocity += impulse * response);
    }
}

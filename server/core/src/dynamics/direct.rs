//! Direct solver of all rows of an island: exact where sweeps would converge slowly, and with the least
//! impulses. Rows of constraints between links keep their R, and so do normals of contacts whose surfaces are
//! springs.
//!
//! A row is active if it is an equation: a contact that presses, friction that holds, a joint at its limit.
//! For a set of active rows the impulses are the solution of
//!
//! M (v - v0) = J' p,  J v + R p = target,  R -> 0,
//!
//! and therefore have the least sum of R p^2 among those that give the same motion. R is equal for all
//! contacts of two robots, so for these the sum of the squared impulses is the least. The system is solved
//! for the velocities with an R of [`SOFTNESS`]. Its matrix M + J' R^-1 J has the sparsity of the contact
//! graph: Castro, Permenter and Han, "An unconstrained convex formulation of compliant contact" (2022). Steps
//! of refinement from zero then remove the softness and keep the least impulses, since they also add R^-1
//! times velocities of bodies.
//!
//! Newton's method finds the active rows. For given friction bounds, the soft problem is the minimum of a
//! convex function of the velocities. A Newton step goes only as far as that function falls. Rows therefore
//! do not alternate, as they may if each round takes the whole step. See Alart and Curnier, "A mixed
//! formulation for frictional contact problems prone to Newton like solution methods" (1991). The bounds of
//! slipping contacts follow from the normal impulses. This fixed point is accelerated by Anderson's method.

pub(in crate::dynamics) mod anderson;
mod equations;
mod newton;

use crate::dynamics::articulation::Articulation;
use crate::dynamics::block_cholesky::{BlockCholesky, MAX_NODES, factorisation_cost};
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::link_rows::LinkRows;
use crate::dynamics::constraint::{Constraints, Row};
use crate::dynamics::inertia::Rigid;
use crate::dynamics::member::Member;
use anderson::Anderson;
pub(in crate::dynamics) use equations::{EXACT, REFINEMENTS};
use newton::Progress;
pub(in crate::dynamics) use newton::{FLAT, HALVINGS};

/// R as a part of the mean J M^-1 J' of its rows.
pub(in crate::dynamics) const SOFTNESS: f64 = 1e-7;

/// Allowed multiplications of a factorisation: for each multiplication of a sweep, and always.
const COST: (usize, usize) = (20, 100_000);

/// The second number of [`COST`] with constraints between links: sweeps close no long loop.
const LINKED_COST: usize = 1_000_000;

/// Returns the number of multiplications that the matrix and its factorisation may each take, for sweeps of
/// `sweep`.
fn most_cost(sweep: usize, has_links: bool) -> usize {
    COST.0 * sweep + if has_links { LINKED_COST } else { COST.1 }
}

/// Returns the multiplications of a contact in a sweep, for robots with `len` velocities.
fn sweep_cost(len: usize) -> usize {
    7 * len
}

/// Returns the multiplications of a contact in the matrix.
fn matrix_cost([a, b]: [usize; 2]) -> usize {
    4 * (a * a + b * b + a * b)
}

/// Returns whether a robot with `len` velocities and this number of contacts with immovable robots can be
/// solved here.
pub(in crate::dynamics) fn is_worth_it(len: usize, contacts: usize) -> bool {
    let most = most_cost(contacts * sweep_cost(len), false);
    contacts * matrix_cost([len, 0]) <= most && factorisation_cost(len, 0) <= most
}

/// Result of the direct solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All rows hold.
    Solved,
    /// The active rows were not found in time; velocities and impulses are unchanged.
    Unsolved,
    /// The caller interrupted the solution.
    Interrupted,
}

/// Active rows of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// It does not press, or nothing can move.
    #[default]
    Open,
    /// It presses and slips.
    Slips,
    /// It presses, and friction holds.
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

/// Memory of the solver, reused from step to step.
#[derive(Debug, Default)]
pub struct Direct {
    matrix: BlockCholesky,
    /// M of each member, concatenated.
    inertias: Vec<f64>,
    composite: Vec<Rigid>,
    /// M (v - v0), from all impulses so far.
    momentum: Vec<f64>,
    /// Right side of a system, and then its solution's change of `momentum`.
    force: Vec<f64>,
    /// Solution of a system.
    change: Vec<f64>,
    states: Vec<State>,
    /// Velocities of each contact's rows, and their changes by the solution.
    speeds: Vec<[f64; 3]>,
    ways: Vec<[f64; 3]>,
    /// Friction bound of each contact, N s.
    bounds: Vec<f64>,
    /// Residual of `bounds`: the bounds by the normal impulses, less the current ones, N s.
    bound_residuals: Vec<f64>,
    /// Bounds of slipping contacts, else 0.
    slip_bounds: Vec<f64>,
    anderson: Anderson<f64>,
    /// Whether each contact slipped in the last round.
    slipped: Vec<bool>,
    /// Impulses of each contact at the start of the last step.
    used: Vec<[f64; 3]>,
    /// Weights of each contact's rows in the matrix: normal, and tangents tt, tu, uu.
    weights: Vec<[f64; 4]>,
    /// 1 / R of each contact: normal, and tangents.
    hardness: Vec<[f64; 2]>,
    /// Residuals of each contact's equations.
    residuals: Vec<[f64; 3]>,
    joints: Vec<Joint>,
    /// Velocities of the island and factors, of the joints of rows on sums.
    terms: Vec<(usize, f64)>,
    /// Velocities and impulses to restore if the solver fails.
    kept_velocities: Vec<f64>,
    kept_impulses: Vec<[f64; 3]>,
    kept_links: Vec<[f64; 3]>,
    /// Whether the matrix has the factors of the last solution.
    is_solved: bool,
    /// Whether the cost limit is disabled, for measurements.
    pub is_unbounded: bool,
}

/// Row of a joint.
#[derive(Clone, Copy, Debug)]
struct Joint {
    member: usize,
    /// Index among the rows of its robot.
    row: usize,
    /// Velocities of the island and factors, as in [`Row`].
    entries: [(usize, f64); 2],
    /// First and last of its `terms`, if it is on a sum of joints.
    terms: [usize; 2],
    /// R if the row is soft, else 0.
    compliance: f64,
    bias: f64,
    least: f64,
    most: f64,
    impulse: f64,
    /// 1 / R.
    hardness: f64,
    residual: f64,
    /// Change of J qd + bias that removes a residual of one.
    scale: f64,
    is_active: bool,
    /// J qd + bias, and its change by the solution.
    speed: f64,
    way: f64,
}

/// An island during its solution.
pub struct System<'a, R> {
    /// Robots of the island.
    pub robots: &'a mut [R],
    /// Locations of the robots' velocities.
    pub members: &'a [Member],
    /// Rows of contacts.
    pub rows: &'a mut [ContactRows],
    /// Rows of constraints between links.
    pub links: &'a mut [LinkRows],
    /// J and M^-1 J' of all rows.
    pub blocks: &'a [f64],
    /// Velocities of all members without impulses.
    pub free: &'a [f64],
    /// Velocities of all members with the impulses.
    pub velocities: &'a mut [f64],
}

impl Direct {
    /// Discards the last island.
    pub fn begin(&mut self) {
        self.hardness.clear();
        self.is_solved = false;
    }

    /// Prepares an island whose contacts are measured. Returns whether it can be solved here: the matrix and
    /// its factorisation must each be cheap compared to the sweeps that they save. They are for chains,
    /// stacks and single robots, but not for heaps, nor for a robot of many joints with many contacts.
    pub fn plan<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        members: &[Member],
        rows: &[ContactRows],
        links: &[LinkRows],
    ) -> bool {
        self.is_solved = false;
        if members.len() > MAX_NODES {
            return false;
        }
        self.matrix.begin(members.iter().map(|member| member.len));
        for (node, member) in members.iter().enumerate() {
            let robot = robots[node].as_mut();
            let couples = |row: &Row| row.entries[1].1 != 0.0 || row.sum.is_some();
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

    /// Solves all rows in at most `rounds` rounds, starting with the rows that press and slip now.
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

    /// Solves again with the factors of the last solution, if only the targets of constraints between links
    /// have changed since. Returns false, with unchanged velocities and impulses, if there are no factors or
    /// other rows are active now.
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
        self.terms.clear();
        for (index, member) in system.members.iter().enumerate() {
            let Constraints { rows, sums, .. } = system.robots[index].as_mut().constraints_mut();
            for (row_index, row) in rows.iter().enumerate() {
                let Row { entries, bias, least, most, impulse, effect, sum, .. } = *row;
                if effect > 0.0 {
                    let first = self.terms.len();
                    let compliance = sum.map_or(0.0, |sum| sums.compliance(sum));
                    if let Some(sum) = sum {
                        let terms = sums.terms(sum).iter();
                        self.terms.extend(terms.map(|term| (member.first + term.velocity, term.factor)));
                    }
                    let softness = if compliance > 0.0 { compliance } else { SOFTNESS * effect };
                    self.joints.push(Joint {
                        member: index,
                        row: row_index,
                        entries: entries.map(|(velocity, factor)| (member.first + velocity, factor)),
                        terms: [first, self.terms.len()],
                        compliance,
                        bias,
                        least,
                        most,
                        impulse,
                        hardness: 1.0 / softness,
                        scale: if compliance > 0.0 { effect / (effect + compliance) } else { 1.0 },
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
    /// Returns J qd + bias.
    fn velocity(&self, terms: &[(usize, f64)], velocities: &[f64]) -> f64 {
        if let Some(terms) = self.sum(terms) {
            return terms.iter().map(|&(at, factor)| factor * velocities[at]).sum::<f64>() + self.bias;
        }
        let [a, b] = self.entries;
        a.1 * velocities[a.0] + b.1 * velocities[b.0] + self.bias
    }

    /// Returns its joints, if it is on a sum.
    fn sum<'t>(&self, terms: &'t [(usize, f64)]) -> Option<&'t [(usize, f64)]> {
        let [first, last] = self.terms;
        (first < last).then(|| &terms[first..last])
    }

    /// Returns its velocities and factors.
    fn joints<'t>(&'t self, terms: &'t [(usize, f64)]) -> &'t [(usize, f64)] {
        self.sum(terms).unwrap_or(&self.entries)
    }

    /// Returns the impulse of the soft row at this J qd + bias.
    fn soft(&self, speed: f64) -> f64 {
        (-speed * self.hardness).clamp(self.least, self.most)
    }

    /// Adds the effect of an impulse to the velocities of its robot.
    fn apply(&self, constraints: &Constraints, impulse: f64, velocities: &mut [f64]) {
        let n = velocities.len();
        let response = &constraints.responses[self.row * n..(self.row + 1) * n];
        velocities.iter_mut().zip(response).for_each(|(velocity, response)| *velocity += impulse * response);
    }
}

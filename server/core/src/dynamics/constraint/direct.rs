//! All rows of an island at once: exact where sweeps would go on for long, and with the least impulses.
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
//! Which rows are active is found as by Newton's method on the projections (Alart and Curnier, "A mixed
//! formulation for frictional contact problems prone to Newton like solution methods" (1991)), with the friction
//! of what slips taken from the normal impulse of the round before.

use super::contact::ContactRows;
use super::{Constraints, Row};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::block_cholesky::{BlockCholesky, MOST_NODES};
use crate::dynamics::inertia::Rigid;
use crate::dynamics::island::Member;

/// R as a part of the mean J M^-1 J' of the rows it belongs to.
const SOFTNESS: f64 = 1e-7;

/// Steps of refinement at the most.
const REFINEMENTS: usize = 4;

/// What is left in a row's velocity after refinement, m/s or rad/s.
const EXACT: f64 = 1e-14;

/// A row is violated beyond this part of its impulse, or this velocity, m/s or rad/s.
const TOLERANCE: f64 = 1e-9;

/// Multiplications that a factorisation may take for each that a sweep takes, and those that it always may.
const COST: (usize, usize) = (20, 100_000);

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

/// The memory that it takes, kept from step to step.
#[derive(Clone, Debug, Default)]
pub struct Direct {
    matrix: BlockCholesky,
    /// M of each member, one after the other.
    inertias: Vec<f64>,
    composite: Vec<Rigid>,
    /// The same with impulses that are given.
    given: Vec<f64>,
    /// The solution of a system.
    change: Vec<f64>,
    states: Vec<State>,
    /// 1 / R of each contact.
    hardness: Vec<f64>,
    /// Of each contact, what is left of its equations.
    residuals: Vec<[f64; 3]>,
    joints: Vec<Joint>,
    /// Velocities and impulses to go back to.
    kept_velocities: Vec<f64>,
    kept_impulses: Vec<[f64; 3]>,
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
}

/// An island, as it is being solved.
pub struct System<'a, R> {
    /// Of the world.
    pub robots: &'a mut [R],
    /// Those of the island.
    pub members: &'a [Member],
    /// Contacts.
    pub rows: &'a mut [ContactRows],
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
    }

    /// Takes in an island whose contacts are measured. Whether it can be solved here: the factorisation must cost
    /// little beside the sweeps that it saves, which it does for chains, stacks and single robots, and not for heaps.
    pub fn plan<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        members: &[Member],
        rows: &[ContactRows],
    ) -> bool {
        if members.len() > MOST_NODES {
            return false;
        }
        self.matrix.begin(members.iter().map(|member| member.len));
        let mut sweep = 0;
        for rows in rows {
            let [a, b] = &rows.sides;
            sweep += 7 * (a.len + b.len);
            if b.len > 0 {
                self.matrix.join(a.member, b.member);
            }
        }
        if self.matrix.plan(COST.0 * sweep + COST.1).is_none() {
            return false;
        }
        self.inertias.clear();
        for member in members {
            let at = self.inertias.len();
            self.inertias.resize(at + member.len * member.len, 0.0);
            let robot = robots[member.robot].as_mut();
            if !robot.write_implicit_inertia(&mut self.composite, &mut self.inertias[at..]) {
                return false;
            }
        }
        true
    }

    /// Solves all rows in at most so many rounds; begins with what presses and slips now.
    pub fn solve<R: AsMut<Articulation>>(
        &mut self,
        mut system: System<'_, R>,
        rounds: usize,
        interrupt: &dyn Fn() -> bool,
    ) -> Outcome {
        self.keep(&mut system);
        self.choose_states(&system);
        for _ in 0..rounds {
            if interrupt() {
                return Outcome::Interrupted;
            }
            if !self.solve_active(&mut system) {
                break;
            }
            if !self.project(&mut system) {
                if self.refine(&mut system) && self.holds(&system) {
                    self.finish(&mut system);
                    return Outcome::Solved;
                }
                break;
            }
        }
        self.go_back(&mut system);
        Outcome::Unsolved
    }

    fn keep<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) {
        self.kept_velocities.clear();
        self.kept_velocities.extend_from_slice(system.velocities);
        self.kept_impulses.clear();
        self.kept_impulses.extend(system.rows.iter().map(|rows| rows.impulse));
        self.joints.clear();
        for (index, member) in system.members.iter().enumerate() {
            let robot = system.robots[member.robot].as_mut();
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
                    });
                }
            }
        }
        self.residuals.clear();
        self.residuals.resize(system.rows.len(), [0.0; 3]);
    }

    fn go_back<R>(&mut self, system: &mut System<'_, R>) {
        system.velocities.copy_from_slice(&self.kept_velocities);
        for (rows, impulse) in system.rows.iter_mut().zip(&self.kept_impulses) {
            rows.impulse = *impulse;
        }
    }

    fn finish<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) {
        for joint in &self.joints {
            let robot = system.members[joint.member].robot;
            system.robots[robot].as_mut().constraints_mut().rows[joint.row].impulse = joint.impulse;
        }
    }

    /// From impulses and velocities as they are.
    fn choose_states<R>(&mut self, system: &System<'_, R>) {
        if self.hardness.is_empty() {
            self.measure(system);
        }
        self.states.clear();
        for rows in &*system.rows {
            let [n, t, u] = rows.impulse;
            let most = rows.friction * n;
            let state = if !rows.acts() {
                State::Open
            } else if n > 0.0 {
                let slips = t * t + u * u >= most * most * (1.0 - TOLERANCE);
                if slips { State::Slips } else { State::Sticks }
            } else if rows.velocities(system.blocks, system.velocities)[0] < rows.target {
                if rows.friction > 0.0 { State::Sticks } else { State::Slips }
            } else {
                State::Open
            };
            self.states.push(state);
        }
        for joint in &mut self.joints {
            joint.is_active = joint.least < joint.impulse && joint.impulse < joint.most
                || joint.impulse == 0.0 && joint.velocity(system.velocities) < 0.0 && joint.least == 0.0;
        }
    }

    /// 1 / R of the contacts, the same for those of the same two robots, which follow each other.
    fn measure<R>(&mut self, system: &System<'_, R>) {
        let pair = |rows: &ContactRows| rows.sides.map(|side| (side.len > 0).then_some(side.member));
        for rows in system.rows.chunk_by(|a, b| pair(a) == pair(b)) {
            let sum: f64 = rows.iter().map(|rows| rows.effect[0]).sum();
            let hardness = rows.len() as f64 / (SOFTNESS * sum);
            self.hardness.extend(rows.iter().map(|_| hardness));
        }
    }

    /// Finds the velocities for the active rows, soft by [`SOFTNESS`], from velocities without their
    /// impulses. False where there are none.
    fn solve_active<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) -> bool {
        self.given.clear();
        self.given.extend_from_slice(system.free);
        for (rows, state) in system.rows.iter_mut().zip(&self.states) {
            let [_, t, u] = rows.impulse;
            match state {
                State::Slips => rows.apply_impulse(system.blocks, [0.0, t, u], &mut self.given),
                State::Open => rows.impulse = [0.0; 3],
                State::Sticks => {}
            }
        }
        for joint in self.joints.iter().filter(|joint| !joint.is_active && joint.impulse != 0.0) {
            let member = &system.members[joint.member];
            let own = &mut self.given[member.first..member.first + member.len];
            joint.apply(system.robots[member.robot].as_mut().constraints_mut(), joint.impulse, own);
        }
        self.assemble(system);
        if !self.matrix.factorise() {
            return false;
        }
        system.velocities.copy_from_slice(&self.given);
        self.take_residuals(system);
        self.solve_residuals(system);
        for (velocity, change) in system.velocities.iter_mut().zip(&self.change) {
            *velocity += change;
        }
        system.velocities.iter().all(|velocity| velocity.is_finite())
    }

    /// M + J' R^-1 J of the active rows.
    fn assemble<R>(&mut self, system: &System<'_, R>) {
        self.matrix.clear();
        let mut at = 0;
        for (index, member) in system.members.iter().enumerate() {
            let end = at + member.len * member.len;
            self.matrix.diagonal_mut(index).copy_from_slice(&self.inertias[at..end]);
            at = end;
        }
        for joint in self.joints.iter().filter(|joint| joint.is_active) {
            let member = &system.members[joint.member];
            let block = self.matrix.diagonal_mut(joint.member);
            for (i, a) in joint.entries.map(|(velocity, factor)| (velocity - member.first, factor)) {
                for (j, b) in joint.entries.map(|(velocity, factor)| (velocity - member.first, factor)) {
                    block[i * member.len + j] += joint.hardness * a * b;
                }
            }
        }
        for ((rows, state), &hardness) in system.rows.iter().zip(&self.states).zip(&self.hardness) {
            let tangents = match state {
                State::Open => continue,
                State::Slips => 0.0,
                State::Sticks => hardness,
            };
            let [a, b] = &rows.sides;
            let [j, k] = [a, b].map(|side| side.jacobian(system.blocks));
            add_weighted(self.matrix.diagonal_mut(a.member), j, j, [hardness, tangents]);
            if b.len > 0 {
                add_weighted(self.matrix.diagonal_mut(b.member), k, k, [hardness, tangents]);
                if a.member == b.member {
                    continue;
                }
                let (block, is_swapped) = self.matrix.block_mut(a.member, b.member);
                let (rows, columns) = if is_swapped { (k, j) } else { (j, k) };
                add_weighted(block, rows, columns, [hardness, tangents]);
            }
        }
    }

    /// What is left of each active row's equation without its R. The largest.
    fn take_residuals<R>(&mut self, system: &System<'_, R>) -> f64 {
        let mut largest = 0.0f64;
        for ((rows, state), residual) in system.rows.iter().zip(&self.states).zip(&mut self.residuals) {
            *residual = [0.0; 3];
            if *state == State::Open {
                continue;
            }
            let [n, t, u] = rows.velocities(system.blocks, system.velocities);
            residual[0] = rows.target - n;
            if *state == State::Sticks {
                (residual[1], residual[2]) = (-t, -u);
            }
            largest = residual.iter().fold(largest, |largest, value| largest.max(value.abs()));
        }
        for joint in self.joints.iter_mut().filter(|joint| joint.is_active) {
            joint.residual = -joint.velocity(system.velocities);
            largest = largest.max(joint.residual.abs());
        }
        largest
    }

    /// The change of velocities by which the active rows, soft, lose their residuals.
    fn solve_residuals<R>(&mut self, system: &System<'_, R>) {
        let Self { change, residuals, hardness, joints, .. } = self;
        change.clear();
        change.resize(system.velocities.len(), 0.0);
        for ((rows, residual), &hardness) in system.rows.iter().zip(&*residuals).zip(&*hardness) {
            if *residual == [0.0; 3] {
                continue;
            }
            let [n, t, u] = residual.map(|residual| residual * hardness);
            for side in &rows.sides {
                let own = &mut change[side.first..side.first + side.len];
                for (own, j) in own.iter_mut().zip(side.jacobian(system.blocks).chunks_exact(4)) {
                    *own += j[0] * n + j[1] * t + j[2] * u;
                }
            }
        }
        for joint in joints.iter().filter(|joint| joint.is_active) {
            for (velocity, factor) in joint.entries {
                change[velocity] += factor * joint.residual * joint.hardness;
            }
        }
        self.matrix.solve(change);
    }

    /// Takes impulses from the soft rows' velocities and judges anew which rows are active. Whether any changed.
    fn project<R>(&mut self, system: &mut System<'_, R>) -> bool {
        let mut changed = false;
        for ((rows, state), &hardness) in system.rows.iter_mut().zip(&mut self.states).zip(&self.hardness) {
            if !rows.acts() {
                continue;
            }
            let [n, t, u] = rows.velocities(system.blocks, system.velocities);
            let normal = (rows.target - n) * hardness;
            let (t, u) = (-t * hardness, -u * hardness);
            let next = if normal <= 0.0 {
                rows.impulse = [0.0; 3];
                State::Open
            } else {
                let (most, size) = (rows.friction * normal, (t * t + u * u).sqrt());
                if size <= most && rows.friction > 0.0 {
                    rows.impulse = [normal, t, u];
                    State::Sticks
                } else {
                    let part = if size > 0.0 { most / size } else { 0.0 };
                    let slips = [normal, t * part, u * part];
                    let moved = (slips[1] - rows.impulse[1]).hypot(slips[2] - rows.impulse[2]);
                    changed |= *state == State::Slips && moved > TOLERANCE * normal;
                    rows.impulse = slips;
                    State::Slips
                }
            };
            changed |= next != *state;
            *state = next;
        }
        for joint in &mut self.joints {
            let impulse = -joint.velocity(system.velocities) * joint.hardness;
            joint.impulse = impulse.clamp(joint.least, joint.most);
            let is_active = joint.impulse == impulse;
            changed |= is_active != joint.is_active;
            joint.is_active = is_active;
        }
        changed
    }

    /// Takes the softness out of velocities and impulses. False where that does not succeed.
    fn refine<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) -> bool {
        system.velocities.copy_from_slice(system.free);
        for rows in system.rows.iter().filter(|rows| rows.impulse != [0.0; 3]) {
            rows.apply_impulse(system.blocks, rows.impulse, system.velocities);
        }
        for joint in self.joints.iter().filter(|joint| joint.impulse != 0.0) {
            let member = &system.members[joint.member];
            let own = &mut system.velocities[member.first..member.first + member.len];
            joint.apply(system.robots[member.robot].as_mut().constraints_mut(), joint.impulse, own);
        }
        let mut left = self.take_residuals(system);
        for _ in 0..REFINEMENTS {
            if left <= EXACT {
                break;
            }
            self.solve_residuals(system);
            for (i, rows) in system.rows.iter_mut().enumerate() {
                if self.states[i] == State::Open {
                    continue;
                }
                let moved = rows.velocities(system.blocks, &self.change);
                let mut added = [0, 1, 2].map(|k| (self.residuals[i][k] - moved[k]) * self.hardness[i]);
                if self.states[i] == State::Slips {
                    (added[1], added[2]) = (0.0, 0.0);
                }
                (0..3).for_each(|k| rows.impulse[k] += added[k]);
                rows.apply_impulse(system.blocks, added, system.velocities);
            }
            for joint in self.joints.iter_mut().filter(|joint| joint.is_active) {
                let moved: f64 = joint.entries.iter().map(|&(at, factor)| factor * self.change[at]).sum();
                let added = (joint.residual - moved) * joint.hardness;
                joint.impulse += added;
                let member = &system.members[joint.member];
                let own = &mut system.velocities[member.first..member.first + member.len];
                joint.apply(system.robots[member.robot].as_mut().constraints_mut(), added, own);
            }
            let after = self.take_residuals(system);
            let is_nearer = after < left;
            left = after;
            if !is_nearer {
                break;
            }
        }
        left <= TOLERANCE
    }

    /// Whether the impulses keep to their bounds, and what is not active to its side.
    fn holds<R>(&self, system: &System<'_, R>) -> bool {
        let contacts = system.rows.iter().zip(&self.states).all(|(rows, state)| {
            let [n, t, u] = rows.impulse;
            match state {
                State::Open => {
                    !rows.acts()
                        || rows.velocities(system.blocks, system.velocities)[0] >= rows.target - TOLERANCE
                }
                State::Slips | State::Sticks => {
                    n >= 0.0 && t.hypot(u) <= rows.friction * n * (1.0 + 1e-6) + f64::MIN_POSITIVE
                }
            }
        });
        contacts
            && self.joints.iter().all(|joint| {
                let slack = TOLERANCE * joint.impulse.abs();
                joint.least - slack <= joint.impulse && joint.impulse <= joint.most + slack
            })
    }
}

impl Joint {
    /// J qd + bias.
    fn velocity(&self, velocities: &[f64]) -> f64 {
        let [a, b] = self.entries;
        a.1 * velocities[a.0] + b.1 * velocities[b.0] + self.bias
    }

    /// Adds what an impulse does to the velocities of its robot.
    fn apply(&self, constraints: &Constraints, impulse: f64, velocities: &mut [f64]) {
        let n = velocities.len();
        let response = &constraints.responses[self.row * n..(self.row + 1) * n];
        velocities.iter_mut().zip(response).for_each(|(velocity, response)| *velocity += impulse * response);
    }
}

/// block += a' w b for columns of normal and two tangents, four numbers each, with weights of the normal and of the
/// tangents.
fn add_weighted(block: &mut [f64], a: &[f64], b: &[f64], weights: [f64; 2]) {
    // Single free bodies are many, and fast where the length is known.
    match (block.first_chunk_mut::<36>(), a.first_chunk::<24>(), b.first_chunk::<24>()) {
        (Some(block), Some(j), Some(k)) if a.len() == 24 && b.len() == 24 => {
            add_products(block, j, k, weights)
        }
        _ => add_products(block, a, b, weights),
    }
}

#[inline(always)]
fn add_products(block: &mut [f64], a: &[f64], b: &[f64], [normal, tangents]: [f64; 2]) {
    let width = b.len() / 4;
    for (row, a) in block.chunks_exact_mut(width).zip(a.chunks_exact(4)) {
        let [n, t, u] = [a[0] * normal, a[1] * tangents, a[2] * tangents];
        for (value, b) in row.iter_mut().zip(b.chunks_exact(4)) {
            *value += n * b[0] + t * b[1] + u * b[2];
        }
    }
}

//! Equations of the active rows: their matrix, its solution, and the refinement that makes it exact.

use super::{Direct, SOFTNESS, State, System};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::block_cholesky::BlockCholesky;
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::contact_law::TOLERANCE;
use crate::dynamics::constraint::contact_law::weighted;
use crate::dynamics::constraint::link_rows::LinkState;
use crate::dynamics::constraint::side::{Side, add_transposed};
use crate::dynamics::constraint::three_rows::weigh;

/// Maximum number of refinement steps.
pub(in crate::dynamics) const REFINEMENTS: usize = 4;

/// Residual velocity of a row at which refinement ends, m/s or rad/s.
pub(in crate::dynamics) const EXACT: f64 = 1e-14;

impl Direct {
    /// Computes 1 / R of the contacts. It is equal for consecutive contacts of the same two robots, except
    /// for springs.
    pub(super) fn measure<R>(&mut self, system: &System<'_, R>) {
        let pair = |rows: &ContactRows| rows.sides.map(|side| (side.len > 0).then_some(side.member));
        for rows in system.rows.chunk_by(|a, b| pair(a) == pair(b)) {
            let sum: f64 = rows.iter().map(|rows| rows.effect[0]).sum();
            let hardness = rows.len() as f64 / (SOFTNESS * sum);
            let normal =
                |rows: &ContactRows| if rows.compliance > 0.0 { 1.0 / rows.compliance } else { hardness };
            self.hardness.extend(rows.iter().map(|rows| [normal(rows), hardness]));
        }
    }

    /// Assembles M + J' R^-1 J of the active rows with their weights.
    pub(super) fn assemble<R>(&mut self, system: &System<'_, R>) {
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
            let joints = joint.joints(&self.terms);
            for (i, a) in joints.iter().map(|(velocity, factor)| (velocity - member.first, factor)) {
                for (j, b) in joints.iter().map(|(velocity, factor)| (velocity - member.first, factor)) {
                    block[i * member.len + j] += joint.hardness * a * b;
                }
            }
        }
        for (rows, &weights) in system.rows.iter().zip(&self.weights) {
            if weights == [0.0; 4] {
                continue;
            }
            add_rows(&mut self.matrix, rows, system.blocks, |entries| weighted(weights, entries));
        }
        for link in system.links.iter().filter(|link| link.weights != [0.0; 6]) {
            add_rows(&mut self.matrix, &link.rows, system.blocks, |entries| weigh(link.weights, entries));
        }
    }

    /// Computes the residual of each active row's equation. R counts only for constraints between links and
    /// for springs. Returns the largest residual.
    pub(super) fn take_residuals<R>(&mut self, system: &mut System<'_, R>) -> f64 {
        let mut largest = 0.0f64;
        for link in &mut *system.links {
            link.residuals = [0.0; 3];
            if link.acts() && link.state == LinkState::Holds {
                link.residuals = link.residual(link.rows.velocities(system.blocks, system.velocities));
                largest = link.residuals.iter().fold(largest, |largest, value| largest.max(value.abs()));
            }
        }
        for ((rows, state), residual) in system.rows.iter().zip(&self.states).zip(&mut self.residuals) {
            *residual = [0.0; 3];
            if *state == State::Open {
                continue;
            }
            let [n, t, u] = rows.slip(system.blocks, system.velocities);
            residual[0] = rows.target - n - rows.compliance * rows.impulse[0];
            if *state == State::Sticks {
                (residual[1], residual[2]) = (-t, -u);
            }
            largest = residual.iter().fold(largest, |largest, value| largest.max(value.abs()));
        }
        for joint in self.joints.iter_mut().filter(|joint| joint.is_active) {
            joint.residual =
                -joint.velocity(&self.terms, system.velocities) - joint.compliance * joint.impulse;
            largest = largest.max(joint.residual.abs() * joint.scale);
        }
        largest
    }

    /// Computes the change of velocities that removes the residuals of the active soft rows.
    pub(super) fn solve_residuals<R>(&mut self, system: &System<'_, R>) {
        let Self { change, residuals, hardness, joints, terms, .. } = self;
        change.clear();
        change.resize(system.velocities.len(), 0.0);
        for ((rows, residual), &[normal, tangent]) in system.rows.iter().zip(&*residuals).zip(&*hardness) {
            if *residual == [0.0; 3] {
                continue;
            }
            let [n, t, u] = *residual;
            rows.add_momentum(system.blocks, [n * normal, t * tangent, u * tangent], change);
        }
        for link in system.links.iter().filter(|link| link.residuals != [0.0; 3]) {
            let force = link.residuals.map(|residual| residual / link.compliance);
            link.rows.add_momentum(system.blocks, force, change);
        }
        for joint in joints.iter().filter(|joint| joint.is_active) {
            for &(velocity, factor) in joint.joints(terms) {
                change[velocity] += factor * joint.residual * joint.hardness;
            }
        }
        self.matrix.solve(change);
    }

    /// Removes the softness from velocities and impulses. Returns false if that fails.
    pub(super) fn refine<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) -> bool {
        system.velocities.copy_from_slice(system.free);
        for rows in system.rows.iter().filter(|rows| rows.impulse != [0.0; 3]) {
            rows.apply_impulse(system.blocks, rows.impulse, system.velocities);
        }
        for link in system.links.iter().filter(|link| link.rows.impulse != [0.0; 3]) {
            link.rows.apply_impulse(system.blocks, link.rows.impulse, system.velocities);
        }
        for joint in self.joints.iter().filter(|joint| joint.impulse != 0.0) {
            let member = &system.members[joint.member];
            let own = &mut system.velocities[member.first..member.first + member.len];
            joint.apply(system.robots[joint.member].as_mut().constraints_mut(), joint.impulse, own);
        }
        // Slipping rows are fixed from here on: the matrix must contain only the other rows.
        let is_bounded = system.links.iter().any(|link| link.state == LinkState::Saturated);
        if is_bounded || self.states.contains(&State::Slips) {
            for link in system.links.iter_mut().filter(|link| link.state == LinkState::Saturated) {
                link.weights = [0.0; 6];
            }
            for (weights, state) in self.weights.iter_mut().zip(&self.states) {
                if *state == State::Slips {
                    (weights[1], weights[2], weights[3]) = (0.0, 0.0, 0.0);
                }
            }
            self.assemble(system);
            if !self.matrix.factorise() {
                return false;
            }
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
                let [normal, tangent] = self.hardness[i];
                let hardness = [normal, tangent, tangent];
                let mut added = [0, 1, 2].map(|k| (self.residuals[i][k] - moved[k]) * hardness[k]);
                if self.states[i] == State::Slips {
                    (added[1], added[2]) = (0.0, 0.0);
                }
                (0..3).for_each(|k| rows.impulse[k] += added[k]);
                rows.apply_impulse(system.blocks, added, system.velocities);
            }
            for link in system.links.iter_mut().filter(|link| link.residuals != [0.0; 3]) {
                let moved = link.rows.velocities(system.blocks, &self.change);
                let added = [0, 1, 2].map(|k| (link.residuals[k] - moved[k]) / link.compliance);
                (0..3).for_each(|k| link.rows.impulse[k] += added[k]);
                link.rows.apply_impulse(system.blocks, added, system.velocities);
            }
            for joint in self.joints.iter_mut().filter(|joint| joint.is_active) {
                let joints = joint.joints(&self.terms);
                let moved: f64 = joints.iter().map(|&(at, factor)| factor * self.change[at]).sum();
                let added = (joint.residual - moved) * joint.hardness;
                joint.impulse += added;
                let member = &system.members[joint.member];
                let own = &mut system.velocities[member.first..member.first + member.len];
                joint.apply(system.robots[joint.member].as_mut().constraints_mut(), added, own);
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
}

/// Adds J' w J of three rows to the matrix; `weigh` returns w times a column.
fn add_rows(
    matrix: &mut BlockCholesky,
    rows: &ContactRows,
    blocks: &[f64],
    weigh: impl Fn([f64; 3]) -> [f64; 3] + Copy,
) {
    let [a, b] = &rows.sides;
    add_weighted(matrix.diagonal_mut(a.member), a.len, a, a, blocks, weigh);
    if b.len > 0 {
        add_weighted(matrix.diagonal_mut(b.member), b.len, b, b, blocks, weigh);
        if a.member == b.member {
            return;
        }
        let (block, is_swapped) = matrix.block_mut(a.member, b.member);
        let (rows, columns) = if is_swapped { (b, a) } else { (a, b) };
        add_weighted(block, columns.len, rows, columns, blocks, weigh);
    }
}

/// Adds J' w J of two sides to a block; if the sides are equal, only on and below the diagonal. Rows of the
/// block have `width` numbers.
fn add_weighted(
    block: &mut [f64],
    width: usize,
    rows: &Side,
    columns: &Side,
    blocks: &[f64],
    weigh: impl Fn([f64; 3]) -> [f64; 3],
) {
    let is_diagonal = rows.at == columns.at;
    if let (Some((j, _)), Some((k, _)), Some(block)) =
        (rows.single(blocks), columns.single(blocks), block.first_chunk_mut::<36>())
    {
        // Single free bodies are frequent, and a known length is fast.
        for (i, row) in block.as_chunks_mut::<6>().0.iter_mut().enumerate() {
            let at = 6 * (i / 2) + i % 2;
            add_transposed(row, k, weigh([j[at], j[at + 2], j[at + 4]]));
        }
        return;
    }
    for (own, part) in rows.parts(blocks) {
        let (pairs, last) = part.as_chunks::<6>();
        let entries = pairs.iter().flat_map(|&[a, b, c, d, e, f]| [[a, c, e], [b, d, f]]);
        let entries = entries.chain(last.first_chunk::<3>().copied());
        for (i, entries) in own.zip(entries) {
            let factors = weigh(entries);
            let row = &mut block[i * width..(i + 1) * width];
            for (span, part) in columns.parts(blocks) {
                if !is_diagonal || span.start <= i {
                    add_transposed(&mut row[span], part, factors);
                }
            }
        }
    }
}

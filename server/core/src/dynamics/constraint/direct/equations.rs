//! The equations of the active rows: their matrix, its solution, and the refinement that makes it exact.

use super::{Direct, SOFTNESS, State, System, TOLERANCE};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::side::{Side, add_transposed};

/// Steps of refinement at the most.
const REFINEMENTS: usize = 4;

/// What is left in a row's velocity after refinement, m/s or rad/s.
const EXACT: f64 = 1e-14;

impl Direct {
    /// 1 / R of the contacts, the same for those of the same two robots, which follow each other.
    pub(super) fn measure<R>(&mut self, system: &System<'_, R>) {
        let pair = |rows: &ContactRows| rows.sides.map(|side| (side.len > 0).then_some(side.member));
        for rows in system.rows.chunk_by(|a, b| pair(a) == pair(b)) {
            let sum: f64 = rows.iter().map(|rows| rows.effect[0]).sum();
            let hardness = rows.len() as f64 / (SOFTNESS * sum);
            self.hardness.extend(rows.iter().map(|_| hardness));
        }
    }

    /// M + J' R^-1 J of the active rows, with the weights that they have.
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
            for (i, a) in joint.entries.map(|(velocity, factor)| (velocity - member.first, factor)) {
                for (j, b) in joint.entries.map(|(velocity, factor)| (velocity - member.first, factor)) {
                    block[i * member.len + j] += joint.hardness * a * b;
                }
            }
        }
        for (rows, &weights) in system.rows.iter().zip(&self.weights) {
            if weights == [0.0; 4] {
                continue;
            }
            let [a, b] = &rows.sides;
            let n = system.members[a.member].len;
            add_weighted(self.matrix.diagonal_mut(a.member), n, a, a, system.blocks, weights);
            if b.len > 0 {
                let n = system.members[b.member].len;
                add_weighted(self.matrix.diagonal_mut(b.member), n, b, b, system.blocks, weights);
                if a.member == b.member {
                    continue;
                }
                let (block, is_swapped) = self.matrix.block_mut(a.member, b.member);
                let (rows, columns) = if is_swapped { (b, a) } else { (a, b) };
                add_weighted(block, columns.len, rows, columns, system.blocks, weights);
            }
        }
    }

    /// What is left of each active row's equation without its R. The largest.
    pub(super) fn take_residuals<R>(&mut self, system: &System<'_, R>) -> f64 {
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
    pub(super) fn solve_residuals<R>(&mut self, system: &System<'_, R>) {
        let Self { change, residuals, hardness, joints, .. } = self;
        change.clear();
        change.resize(system.velocities.len(), 0.0);
        for ((rows, residual), &hardness) in system.rows.iter().zip(&*residuals).zip(&*hardness) {
            if *residual == [0.0; 3] {
                continue;
            }
            rows.add_momentum(system.blocks, residual.map(|residual| residual * hardness), change);
        }
        for joint in joints.iter().filter(|joint| joint.is_active) {
            for (velocity, factor) in joint.entries {
                change[velocity] += factor * joint.residual * joint.hardness;
            }
        }
        self.matrix.solve(change);
    }

    /// Takes the softness out of velocities and impulses. False where that does not succeed.
    pub(super) fn refine<R: AsMut<Articulation>>(&mut self, system: &mut System<'_, R>) -> bool {
        system.velocities.copy_from_slice(system.free);
        for rows in system.rows.iter().filter(|rows| rows.impulse != [0.0; 3]) {
            rows.apply_impulse(system.blocks, rows.impulse, system.velocities);
        }
        for joint in self.joints.iter().filter(|joint| joint.impulse != 0.0) {
            let member = &system.members[joint.member];
            let own = &mut system.velocities[member.first..member.first + member.len];
            joint.apply(system.robots[member.robot].as_mut().constraints_mut(), joint.impulse, own);
        }
        // What slips is given from here on: the matrix is to be that of the other rows.
        if self.states.contains(&State::Slips) {
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
}

/// block += J' w J for the J of two sides, with weights of the normal and tt, tu, uu of the tangents; where the sides are one, on
/// and below the diagonal. Rows of the block have `width` numbers.
fn add_weighted(
    block: &mut [f64],
    width: usize,
    rows: &Side,
    columns: &Side,
    blocks: &[f64],
    [normal, tt, tu, uu]: [f64; 4],
) {
    let is_diagonal = rows.at == columns.at;
    let weigh = |[a, b, c]: [f64; 3]| [a * normal, b * tt + c * tu, b * tu + c * uu];
    if let (Some((j, _)), Some((k, _)), Some(block)) =
        (rows.single(blocks), columns.single(blocks), block.first_chunk_mut::<36>())
    {
        // Single free bodies are many, and fast where the length is known.
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

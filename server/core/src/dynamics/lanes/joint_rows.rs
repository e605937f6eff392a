//! Limits and dry friction of joints of copies that touch something, solved together with the rows of feet:
//! see [`Direct`](crate::dynamics::direct::Direct). The rows of copies that touch nothing are in
//! `rows`.

use pulp::Simd;

use super::robot::LaneRobot;
use super::rows::{FRICTION, ORDER, UPPER};
use super::tree_cholesky::TreeCholesky;
use crate::dynamics::constraint::contact_law::TOLERANCE;
use crate::dynamics::direct::SOFTNESS;
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::real::{MaskOf as _, Real as _};

/// A row on the velocity of one joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointRow<S: Simd> {
    /// Body, kind of its row, and index of the velocity.
    body: usize,
    kind: usize,
    velocity: usize,
    /// Whether it is an upper limit, which reverses the sign of the velocity.
    is_upper: bool,
    /// Lanes in which it exists, and in which it moves anything.
    is_there: Mask<S>,
    acts: Mask<S>,
    bias: Lanes<S>,
    least: Lanes<S>,
    most: Lanes<S>,
    impulse: Lanes<S>,
    kept_impulse: Lanes<S>,
    effect: Lanes<S>,
    hardness: Lanes<S>,
    residual: Lanes<S>,
    is_active: Mask<S>,
    speed: Lanes<S>,
    way: Lanes<S>,
}

/// Rows of joints, and the effects of impulses at the joints.
#[derive(Debug)]
pub(super) struct JointRows<S: Simd> {
    rows: Vec<JointRow<S>>,
    /// Responses by velocity of the impulse, then by velocity; only for velocities with a row.
    responses: Vec<Lanes<S>>,
}

impl<S: Simd> JointRow<S> {
    /// Returns a number of its velocity with the sign of the row.
    #[inline(always)]
    fn signed(&self, number: Lanes<S>) -> Lanes<S> {
        if self.is_upper { -number } else { number }
    }

    /// Returns J qd.
    #[inline(always)]
    fn own(&self, velocities: &[Lanes<S>]) -> Lanes<S> {
        self.signed(velocities[self.velocity])
    }

    /// Returns the impulse of the soft row at this J qd + bias.
    #[inline(always)]
    fn soft(&self, speed: Lanes<S>) -> Lanes<S> {
        (-speed * self.hardness).clamp(self.least, self.most)
    }

    /// Adds J' times a number in some lanes.
    #[inline(always)]
    fn add(&self, number: Lanes<S>, lanes: Mask<S>, sums: &mut [Lanes<S>]) {
        let slot = &mut sums[self.velocity];
        *slot = lanes.select(*slot + self.signed(number), *slot);
    }

    /// Applies an impulse to the velocities of some lanes.
    #[inline(always)]
    fn apply(&self, impulse: Lanes<S>, lanes: Mask<S>, responses: &[Lanes<S>], velocities: &mut [Lanes<S>]) {
        let own = &responses[self.velocity * velocities.len()..][..velocities.len()];
        let impulse = self.signed(impulse);
        for (velocity, response) in velocities.iter_mut().zip(own) {
            *velocity = lanes.select(*velocity + impulse * *response, *velocity);
        }
    }

    /// Returns the lanes in which an impulse is between its bounds.
    #[inline(always)]
    fn is_within(&self, impulse: Lanes<S>) -> Mask<S> {
        self.least.lt(impulse) & impulse.lt(self.most)
    }
}

impl<S: Simd> JointRows<S> {
    /// Creates the memory for a robot with this number of velocities, without rows.
    pub(super) fn new(zero: Lanes<S>, velocities: usize) -> Self {
        Self { rows: Vec::with_capacity(3 * velocities), responses: vec![zero; velocities * velocities] }
    }

    /// Returns the bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<JointRow<S>>() + size_of_val(&self.responses[..])
    }

    /// Applies the rows' initial impulses to the velocities of some lanes.
    #[inline(always)]
    pub(super) fn prepare(&mut self, lanes: Mask<S>, velocities: &mut [Lanes<S>]) {
        let Self { rows, responses } = self;
        for row in rows {
            let zero = row.bias.splat(0.0);
            row.effect = responses[row.velocity * (velocities.len() + 1)];
            row.acts = row.is_there & zero.lt(row.effect);
            row.hardness = zero.splat(1.0) / (zero.splat(SOFTNESS) * row.effect);
            row.impulse = (lanes & row.is_there & !row.acts).select(zero, row.impulse);
            row.apply(row.impulse, row.acts & lanes, responses, velocities);
        }
    }

    /// Adds the rows' parts to -p' (J v0 - target) and to p' J M^-1 J' p.
    #[inline(always)]
    pub(super) fn add_energy(&self, free: &[Lanes<S>], velocities: &[Lanes<S>], sums: &mut [Lanes<S>; 2]) {
        for row in &self.rows {
            let (before, after) = (row.own(free), row.own(velocities));
            let [linear, square] = *sums;
            sums[0] = row.is_there.select(linear - row.impulse * (before + row.bias), linear);
            sums[1] = row.is_there.select(square + row.impulse * (after - before), square);
        }
    }

    /// Scales the impulses of some lanes.
    #[inline(always)]
    pub(super) fn scale(&mut self, part: Lanes<S>, lanes: Mask<S>) {
        for row in &mut self.rows {
            row.impulse = (row.is_there & lanes).select(row.impulse * part, row.impulse);
        }
    }

    /// Sweeps once through all rows of some lanes. Updates the largest change of a row's own velocity.
    #[inline(always)]
    pub(super) fn sweep(&mut self, lanes: Mask<S>, velocities: &mut [Lanes<S>], largest: &mut Lanes<S>) {
        let Self { rows, responses } = self;
        for row in rows {
            let velocity = row.own(velocities) + row.bias;
            let impulse = (row.impulse - velocity / row.effect).clamp(row.least, row.most);
            let change = impulse - row.impulse;
            let moves = row.acts & lanes & !change.equals(change.splat(0.0));
            row.impulse = moves.select(impulse, row.impulse);
            row.apply(change, moves, responses, velocities);
            *largest = moves.select(largest.max((change * row.effect).abs()), *largest);
        }
    }

    /// Saves impulses.
    #[inline(always)]
    pub(super) fn keep(&mut self) {
        for row in &mut self.rows {
            row.kept_impulse = row.impulse;
        }
    }

    /// Restores impulses in some lanes.
    #[inline(always)]
    pub(super) fn go_back(&mut self, lanes: Mask<S>) {
        for row in &mut self.rows {
            row.impulse = lanes.select(row.kept_impulse, row.impulse);
        }
    }

    /// Starts with the present velocities and impulses.
    #[inline(always)]
    pub(super) fn begin_rounds(&mut self, velocities: &[Lanes<S>], momentum: &mut [Lanes<S>]) {
        for row in &mut self.rows {
            let zero = row.bias.splat(0.0);
            row.add(row.impulse, row.acts, momentum);
            let falls = (row.own(velocities) + row.bias).lt(zero);
            let presses = row.impulse.equals(zero) & falls & row.least.equals(zero);
            row.is_active = row.acts & (row.is_within(row.impulse) | presses);
        }
    }

    /// Begins a round of some lanes, and adds to the right side.
    #[inline(always)]
    pub(super) fn begin_round(
        &mut self,
        lanes: Mask<S>,
        is_first: bool,
        velocities: &[Lanes<S>],
        force: &mut [Lanes<S>],
    ) {
        for row in &mut self.rows {
            row.speed = row.own(velocities) + row.bias;
            let mut impulse = row.soft(row.speed);
            if is_first {
                impulse = row.is_active.select(-row.speed * row.hardness, row.impulse);
            } else {
                let is_active = row.is_within(impulse) & row.acts;
                row.is_active = (lanes & is_active) | (row.is_active & !lanes);
            }
            row.add(impulse, row.acts, force);
        }
    }

    /// Adds the weights of active rows to the diagonal.
    #[inline(always)]
    pub(super) fn assemble(&self, matrix: &mut TreeCholesky<S>) {
        for row in &self.rows {
            let of = &matrix.rows[row.velocity];
            let slot = &mut matrix.values[of.at + of.ancestors.len()];
            *slot = row.is_active.select(*slot + row.hardness, *slot);
        }
    }

    /// Computes the changes of rows' velocities by the solution, and converts the right side to the change of
    /// `momentum`.
    #[inline(always)]
    pub(super) fn find_ways(&mut self, change: &[Lanes<S>], force: &mut [Lanes<S>]) {
        for row in &mut self.rows {
            row.way = row.own(change);
            row.add(-(row.hardness * row.way), row.is_active, force);
        }
    }

    /// Subtracts the rows' effect along the solution from the slope.
    #[inline(always)]
    pub(super) fn subtract_slope(&self, length: Lanes<S>, sum: &mut Lanes<S>) {
        for row in &self.rows {
            let own = *sum - row.way * row.soft(row.speed + length * row.way);
            *sum = row.acts.select(own, *sum);
        }
    }

    /// Computes impulses from velocities in some lanes. Returns the lanes in which any row changed.
    #[inline(always)]
    pub(super) fn project(
        &mut self,
        lanes: Mask<S>,
        velocities: &[Lanes<S>],
        mut changed: Mask<S>,
    ) -> Mask<S> {
        for row in &mut self.rows {
            let on = row.acts & lanes;
            let impulse = row.soft(row.own(velocities) + row.bias);
            let is_active = row.is_within(impulse);
            changed = changed | (on & ((is_active & !row.is_active) | (!is_active & row.is_active)));
            row.impulse = on.select(impulse, row.impulse);
            row.is_active = (on & is_active) | (row.is_active & !on);
        }
        changed
    }

    /// Applies all impulses to the velocities of some lanes.
    #[inline(always)]
    pub(super) fn apply_all(&self, lanes: Mask<S>, velocities: &mut [Lanes<S>]) {
        for row in &self.rows {
            let has = row.acts & lanes & !row.impulse.equals(row.impulse.splat(0.0));
            row.apply(row.impulse, has, &self.responses, velocities);
        }
    }

    /// Computes the residual of each active row's equation. Returns the largest.
    #[inline(always)]
    pub(super) fn take_residuals(&mut self, velocities: &[Lanes<S>], mut largest: Lanes<S>) -> Lanes<S> {
        for row in &mut self.rows {
            row.residual = -(row.own(velocities) + row.bias);
            largest = row.is_active.select(largest.max(row.residual.abs()), largest);
        }
        largest
    }

    /// Adds the impulses for the residuals of active rows.
    #[inline(always)]
    pub(super) fn add_residuals(&self, change: &mut [Lanes<S>]) {
        for row in &self.rows {
            row.add(row.residual * row.hardness, row.is_active, change);
        }
    }

    /// Removes the softness of active rows in some lanes, by the solution.
    #[inline(always)]
    pub(super) fn refine(&mut self, lanes: Mask<S>, change: &[Lanes<S>], velocities: &mut [Lanes<S>]) {
        let Self { rows, responses } = self;
        for row in rows {
            let on = row.is_active & lanes;
            let added = (row.residual - row.own(change)) * row.hardness;
            row.impulse = on.select(row.impulse + added, row.impulse);
            row.apply(added, on, responses, velocities);
        }
    }

    /// Returns the lanes in which all impulses are within their bounds.
    #[inline(always)]
    pub(super) fn hold(&self, mut all: Mask<S>) -> Mask<S> {
        for row in &self.rows {
            let slack = row.bias.splat(TOLERANCE) * row.impulse.abs();
            let holds = (row.least - slack).le(row.impulse) & row.impulse.le(row.most + slack);
            all = all & (holds | !row.acts);
        }
        all
    }
}

impl<S: Simd> LaneRobot<S> {
    /// Sets up the rows of joints in some lanes at the start of a step.
    #[inline(always)]
    pub(super) fn take_joint_rows(&mut self, lanes: Mask<S>) {
        let zero = self.occupied.splat(0.0);
        let no = zero.lt(zero);
        let offset = self.tree.root_velocities();
        self.feet.solver.joints.rows.clear();
        for kinds in ORDER {
            for body in self.first..self.bodies.len() {
                for &kind in kinds {
                    let at = &self.bodies[body];
                    let row = at.rows[kind];
                    let is_there = zero.lt(row.is_there) & lanes;
                    if !is_there.any() {
                        continue;
                    }
                    let bounds = if kind == FRICTION {
                        [-at.most_friction, at.most_friction]
                    } else {
                        [zero, zero.splat(f64::INFINITY)]
                    };
                    self.feet.solver.joints.rows.push(JointRow {
                        body,
                        kind,
                        velocity: offset + body - self.first,
                        is_upper: kind == UPPER,
                        is_there,
                        acts: no,
                        bias: row.bias,
                        least: bounds[0],
                        most: bounds[1],
                        impulse: is_there.select(row.impulse, zero),
                        kept_impulse: zero,
                        effect: zero,
                        hardness: zero,
                        residual: zero,
                        is_active: no,
                        speed: zero,
                        way: zero,
                    });
                }
            }
        }
    }

    /// Computes the effects of impulses at joints with rows.
    #[inline(always)]
    pub(super) fn measure_joint_rows(&mut self) {
        let (first, n) = (self.first, self.bodies.len());
        let (offset, size) = (self.tree.root_velocities(), self.feet.solver.velocities.len());
        for index in 0..self.feet.solver.joints.rows.len() {
            let JointRow { body, velocity, .. } = self.feet.solver.joints.rows[index];
            self.respond(body);
            let own = &mut self.feet.solver.joints.responses[velocity * size..][..size];
            own[..offset].copy_from_slice(&self.root_responses[body][..offset]);
            own[offset..].copy_from_slice(&self.responses[body * n + first..(body + 1) * n]);
        }
    }

    /// Writes the rows' final impulses to the joints of some lanes.
    #[inline(always)]
    pub(super) fn put_joint_rows(&mut self, lanes: Mask<S>) {
        for row in &self.feet.solver.joints.rows {
            let slot = &mut self.bodies[row.body].rows[row.kind].impulse;
            *slot = (row.is_there & lanes).select(row.impulse, *slot);
        }
    }
}

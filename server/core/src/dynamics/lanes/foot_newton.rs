//! Newton's method for the impulses of feet, for all copies, as
//! [`Direct`](crate::dynamics::direct::Direct) for one robot. A lane does as many rounds as its
//! copy would; further rounds leave its numbers unchanged.

use pulp::Simd;

use super::feet::MAX_FEET;
use super::foot_rows::{Foot, FootNewton};
use super::foot_solver::FootSolver;
use crate::dynamics::constraint::contact_law::TOLERANCE;
use crate::dynamics::constraint::contact_law::{first_guess, given, is_in_cone, judge, soft, weighted};
use crate::dynamics::direct::{FLAT, HALVINGS, SOFTNESS};
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::real::{MaskOf as _, Real as _};

impl<S: Simd> Foot<S> {
    /// Writes numbers in some lanes.
    #[inline(always)]
    fn put<const N: usize>(slots: &mut [Lanes<S>; N], new: [Lanes<S>; N], lanes: Mask<S>) {
        for (slot, new) in slots.iter_mut().zip(new) {
            *slot = lanes.select(new, *slot);
        }
    }
}

impl<S: Simd> FootSolver<S> {
    /// Solves all rows of some lanes in at most `rounds` rounds, from their present impulses and velocities.
    /// Returns the lanes in which all rows hold.
    #[inline(always)]
    pub(super) fn solve_directly(&mut self, lanes: Mask<S>, rounds: usize) -> Mask<S> {
        let zero = self.zero();
        self.begin_rounds();
        let (mut going, mut settled) = (lanes, zero.lt(zero));
        for round in 0..rounds {
            if !going.any() {
                break;
            }
            let (solved, goes) = self.advance(going, round == 0);
            settled = settled | (going & solved & !goes);
            going = going & solved & goes;
        }
        if !settled.any() {
            return settled;
        }
        let is_exact = self.refine(settled);
        settled & is_exact & self.holds()
    }

    /// Starts with the present velocities and impulses.
    #[inline(always)]
    fn begin_rounds(&mut self) {
        let zero = self.zero();
        let one = zero.splat(1.0);
        let Self { feet, joints, velocities, momentum, anderson, hardness, .. } = self;
        let (mut sum, mut count) = (zero, zero);
        for foot in &*feet {
            let is_there = zero.lt(foot.is_there);
            sum = is_there.select(sum + foot.effect[0], sum);
            count = is_there.select(count + one, count);
        }
        *hardness = count / (zero.splat(SOFTNESS) * sum);
        momentum.fill(zero);
        anderson.begin(zero.le(zero));
        for foot in &mut *feet {
            foot.add_momentum(foot.impulse, foot.acts, momentum);
            let normal = foot.velocities(velocities)[0];
            let law = (foot.target, foot.friction);
            let (bound, presses, sticks) = first_guess(law, foot.effect[0], foot.impulse, normal);
            foot.newton.bound = foot.acts.select(bound, zero);
            foot.newton.presses = presses & foot.acts;
            foot.newton.sticks = sticks & foot.acts;
            foot.newton.slipped = zero.lt(zero);
        }
        joints.begin_rounds(velocities, momentum);
    }

    /// Makes a Newton step in some lanes. Returns the lanes with a step, and those in which rows have
    /// changed.
    #[inline(always)]
    fn advance(&mut self, lanes: Mask<S>, is_first: bool) -> (Mask<S>, Mask<S>) {
        let zero = self.zero();
        let one = zero.splat(1.0);
        let Self { feet, joints, velocities, momentum, force, hardness, .. } = self;
        for (force, momentum) in force.iter_mut().zip(&*momentum) {
            *force = -*momentum;
        }
        for foot in &mut *feet {
            let speeds = foot.slip(velocities);
            let (impulse, weights) = if is_first {
                let state = (foot.newton.presses, foot.newton.sticks);
                given(foot.target, [*hardness; 2], state, foot.impulse, speeds)
            } else {
                soft(foot.target, [*hardness; 2], foot.newton.bound, speeds)
            };
            foot.add_momentum(impulse, foot.acts, force);
            for (slot, speed) in foot.newton.speeds.iter_mut().zip(speeds) {
                *slot = foot.acts.select(speed, zero);
            }
            let on = foot.acts & lanes;
            Foot::put(&mut foot.newton.used, impulse, on);
            Foot::put(&mut foot.newton.weights, weights, on);
            Foot::put(&mut foot.newton.weights, [zero; 4], lanes & !foot.acts);
        }
        joints.begin_round(lanes, is_first, velocities, force);
        self.assemble();
        let mut is_there = self.matrix.factorise();
        self.change.copy_from_slice(&self.force);
        self.matrix.solve(&mut self.change);
        let mut slope = zero;
        for (index, (change, force)) in self.change.iter().zip(&self.force).enumerate() {
            is_there = is_there & change.is_finite();
            let own = -*change * *force;
            slope = if index == 0 { own } else { slope + own };
        }
        let Self { feet, joints, change, force, .. } = self;
        for foot in &mut *feet {
            let [n, t, u] = foot.velocities(change);
            let [normal, tt, tu, uu] = foot.newton.weights;
            let taken = [-normal * n, -tt * t - tu * u, -tu * t - uu * u];
            let is_none = normal.equals(zero) & tt.equals(zero) & tu.equals(zero) & uu.equals(zero);
            foot.add_momentum(taken, !is_none, force);
            foot.newton.ways = [n, t, u];
        }
        joints.find_ways(change, force);
        let length = if is_first { one } else { self.find_length(lanes & is_there, slope) };
        let on = lanes & is_there;
        let Self { velocities, momentum, change, force, .. } = self;
        for (velocity, change) in velocities.iter_mut().zip(&*change) {
            *velocity = on.select(*velocity + length * *change, *velocity);
        }
        for (momentum, force) in momentum.iter_mut().zip(&*force) {
            *momentum = on.select(*momentum + length * *force, *momentum);
        }
        let changed = self.project(on) | length.lt(one);
        (is_there, changed)
    }

    /// Assembles M + J' R^-1 J of the rows with their weights.
    #[inline(always)]
    pub(super) fn assemble(&mut self) {
        let Self { feet, joints, matrix, inertia, .. } = self;
        matrix.values.copy_from_slice(inertia);
        joints.assemble(matrix);
        for foot in &*feet {
            for (count, (row, (i, _))) in foot.jacobian.iter().zip(&foot.columns).enumerate() {
                let factors = weighted(foot.newton.weights, *row);
                // The columns before it belong to its ancestors.
                let target = &mut matrix.values[matrix.rows[*i].at..][..=count];
                for (target, column) in target.iter_mut().zip(&foot.jacobian[..=count]) {
                    *target += column[0] * factors[0] + column[1] * factors[1] + column[2] * factors[2];
                }
            }
        }
    }

    /// Returns the step length up to which the function falls in some lanes, at most 1. `slope` is the
    /// initial slope.
    #[inline(always)]
    fn find_length(&self, lanes: Mask<S>, slope: Lanes<S>) -> Lanes<S> {
        let zero = self.zero();
        let one = zero.splat(1.0);
        let (mut constant, mut square) = (zero, zero);
        for ((change, momentum), force) in self.change.iter().zip(&self.momentum).zip(&self.force) {
            constant += *change * *momentum;
            square += *change * *force;
        }
        let flat = zero.splat(FLAT) * slope.abs();
        let mut bisecting = lanes & slope.lt(zero);
        if bisecting.any() {
            bisecting = bisecting & !self.slope_at(one, constant, square).le(flat);
        }
        let mut length = one;
        let (mut below, mut above) = (zero, one);
        let mut open = bisecting;
        for _ in 0..HALVINGS {
            if !open.any() {
                break;
            }
            let middle = zero.splat(0.5) * (below + above);
            let slope = self.slope_at(middle, constant, square);
            let is_flat = slope.abs().le(flat) & open;
            length = is_flat.select(middle, length);
            open = open & !is_flat;
            let falls = slope.lt(zero);
            below = (open & falls).select(middle, below);
            above = (open & !falls).select(middle, above);
        }
        open.select(below, length)
    }

    #[inline(always)]
    fn slope_at(&self, length: Lanes<S>, constant: Lanes<S>, square: Lanes<S>) -> Lanes<S> {
        let mut sum = constant + length * square;
        for foot in &self.feet {
            let ([a, b, c], way) = (foot.newton.speeds, foot.newton.ways);
            let at = [a + length * way[0], b + length * way[1], c + length * way[2]];
            let (impulse, _) = soft(foot.target, [self.hardness; 2], foot.newton.bound, at);
            let own = sum - (way[0] * impulse[0] + way[1] * impulse[1] + way[2] * impulse[2]);
            sum = foot.acts.select(own, sum);
        }
        self.joints.subtract_slope(length, &mut sum);
        sum
    }

    /// Computes impulses from the soft rows' velocities, and the friction bounds from these impulses, in some
    /// lanes. Returns the lanes in which any row changed.
    #[inline(always)]
    fn project(&mut self, lanes: Mask<S>) -> Mask<S> {
        let zero = self.zero();
        let Self { feet, velocities, hardness, .. } = self;
        let hardness = *hardness;
        let no = zero.lt(zero);
        let (mut changed, mut differs, mut slips) = (no, no, no);
        for foot in &mut *feet {
            let on = foot.acts & lanes;
            let before = foot.newton.bound;
            let speeds = foot.slip(velocities);
            let began_with = (foot.newton.used, foot.newton.weights);
            let law = (foot.target, foot.friction);
            let judged = judge(law, [hardness; 2], before, speeds, began_with);
            changed = changed | (on & judged.changed);
            Foot::put(&mut foot.impulse, judged.impulse, on);
            foot.newton.presses = (on & judged.presses) | (foot.newton.presses & !on);
            foot.newton.sticks = (on & judged.sticks) | (foot.newton.sticks & !on);
            differs = differs | (on & !judged.slips.matches(foot.newton.slipped));
            foot.newton.slipped = (on & judged.slips) | (foot.newton.slipped & !on);
            slips = slips | (on & judged.slips);
            foot.newton.bound_residual = (on & judged.slips).select(judged.bound - before, zero);
            foot.newton.bound = (on & !judged.slips).select(judged.bound, before);
        }
        if (differs | slips).any() {
            self.accelerate_bounds(differs, slips);
        }
        self.joints.project(lanes, &self.velocities, changed)
    }

    /// Extrapolates the bounds of slipping feet. Restarts in lanes where the slipping feet differ from the
    /// previous round.
    #[inline(always)]
    fn accelerate_bounds(&mut self, differs: Mask<S>, slips: Mask<S>) {
        let zero = self.zero();
        let Self { feet, anderson, .. } = self;
        anderson.begin(differs);
        if !slips.any() {
            return;
        }
        let (mut bounds, mut residuals) = ([zero; MAX_FEET], [zero; MAX_FEET]);
        for ((slot, residual), foot) in bounds.iter_mut().zip(&mut residuals).zip(&*feet) {
            let FootNewton { slipped, bound, bound_residual, .. } = foot.newton;
            (*slot, *residual) = (slipped.select(bound, zero), bound_residual);
        }
        let count = feet.len().min(MAX_FEET);
        anderson.advance(slips, &mut bounds[..count], &residuals[..count]);
        for (foot, bound) in feet.iter_mut().zip(bounds) {
            let on = slips & foot.newton.slipped;
            // NaN becomes 0, as for one robot.
            let bound = zero.lt(bound).select(bound, zero);
            foot.newton.bound = on.select(bound, foot.newton.bound);
        }
    }

    /// Returns the lanes in which impulses are within their bounds, and inactive rows on their side.
    #[inline(always)]
    fn holds(&self) -> Mask<S> {
        let zero = self.zero();
        let mut all = zero.le(zero);
        for foot in &self.feet {
            let normal = foot.velocities(&self.velocities)[0];
            let open = !foot.acts | (foot.target - zero.splat(TOLERANCE)).le(normal);
            let presses = is_in_cone(foot.impulse, foot.friction);
            all = all & ((foot.newton.presses & presses) | (!foot.newton.presses & open));
        }
        self.joints.hold(all)
    }
}

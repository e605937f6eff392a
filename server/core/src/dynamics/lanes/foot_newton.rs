//! Newton's method for the impulses of feet, of all copies: what [`Direct`](crate::dynamics::constraint::direct::Direct) does for one
//! robot. A lane does as many rounds as its copy would: in those after, its numbers stay.

use pulp::Simd;

use super::feet::MOST_FEET;
use super::foot_rows::{Foot, FootNewton};
use super::foot_solver::FootSolver;
use super::number::{Lanes, Mask};
use crate::dynamics::constraint::direct::{FLAT, HALVINGS, SLIP_TOLERANCE, SOFTNESS, TOLERANCE};
use crate::dynamics::real::{MaskOf as _, Real as _, length_in_plane};

/// Impulses of soft rows, and the weights of their derivative.
type Soft<S> = ([Lanes<S>; 3], [Lanes<S>; 4]);

impl<S: Simd> Foot<S> {
    /// The impulses of soft rows at these velocities, with this bound of friction.
    #[inline(always)]
    fn soft(&self, hardness: Lanes<S>, bound: Lanes<S>, [n, t, u]: [Lanes<S>; 3]) -> Soft<S> {
        let zero = hardness.splat(0.0);
        let normal = (self.target - n) * hardness;
        let presses = zero.lt(normal);
        let (normal, weight) = (presses.select(normal, zero), presses.select(hardness, zero));
        let speed = length_in_plane(t, u);
        let none = bound.le(zero);
        let sticks = (speed * hardness).le(bound);
        let (part, st, su) = (bound / speed, t / speed, u / speed);
        let it = none.select(zero, sticks.select(-t * hardness, -st * bound));
        let iu = none.select(zero, sticks.select(-u * hardness, -su * bound));
        let tt = none.select(zero, sticks.select(hardness, part * su * su));
        let tu = none.select(zero, sticks.select(zero, -part * st * su));
        let uu = none.select(zero, sticks.select(hardness, part * st * st));
        ([normal, it, iu], [weight, tt, tu, uu])
    }

    /// The same where it is known which rows are equations, and what slips has the friction that it had.
    #[inline(always)]
    fn given(&self, hardness: Lanes<S>, [n, t, u]: [Lanes<S>; 3]) -> Soft<S> {
        let zero = hardness.splat(0.0);
        let (presses, sticks) = (self.newton.presses, self.newton.sticks);
        let normal = presses.select((self.target - n) * hardness, zero);
        let it = presses.select(sticks.select(-t * hardness, self.impulse[1]), zero);
        let iu = presses.select(sticks.select(-u * hardness, self.impulse[2]), zero);
        let weight = presses.select(hardness, zero);
        let tangent = (presses & sticks).select(hardness, zero);
        ([normal, it, iu], [weight, tangent, zero, tangent])
    }

    /// Writes numbers of some lanes.
    #[inline(always)]
    fn put<const N: usize>(slots: &mut [Lanes<S>; N], new: [Lanes<S>; N], lanes: Mask<S>) {
        for (slot, new) in slots.iter_mut().zip(new) {
            *slot = lanes.select(new, *slot);
        }
    }
}

impl<S: Simd> FootSolver<S> {
    /// Solves all rows of some lanes in at most so many rounds, from the impulses and velocities that they have. Where all rows hold.
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

    /// Takes velocities and impulses as they are.
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
            let alone = (foot.target - normal) / foot.effect[0];
            let [n, t, u] = foot.impulse;
            let pressed = zero.lt(n);
            let bound = foot.friction * pressed.select(n, alone.max(zero));
            let presses = (pressed | normal.lt(foot.target)) & foot.acts;
            let most = bound * bound * zero.splat(1.0 - TOLERANCE);
            let slips = bound.le(zero) | most.le(t * t + u * u);
            foot.newton.bound = foot.acts.select(bound, zero);
            foot.newton.presses = presses;
            foot.newton.sticks = presses & !slips;
            foot.newton.slipped = zero.lt(zero);
        }
        joints.begin_rounds(velocities, momentum);
    }

    /// A step of Newton of some lanes. Where there is one, and where rows have changed in it.
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
                foot.given(*hardness, speeds)
            } else {
                foot.soft(*hardness, foot.newton.bound, speeds)
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

    /// M + J' R^-1 J of the rows, with the weights that they have.
    #[inline(always)]
    pub(super) fn assemble(&mut self) {
        let Self { feet, joints, matrix, inertia, .. } = self;
        matrix.values.copy_from_slice(inertia);
        joints.assemble(matrix);
        for foot in &*feet {
            let [normal, tt, tu, uu] = foot.newton.weights;
            for (count, (row, (i, _))) in foot.jacobian.iter().zip(&foot.columns).enumerate() {
                let [a, b, c] = *row;
                let factors = [a * normal, b * tt + c * tu, b * tu + c * uu];
                // Columns before it are those of its ancestors.
                let target = &mut matrix.values[matrix.rows[*i].at..][..=count];
                for (target, column) in target.iter_mut().zip(&foot.jacobian[..=count]) {
                    *target += column[0] * factors[0] + column[1] * factors[1] + column[2] * factors[2];
                }
            }
        }
    }

    /// How far along the solution the function falls in some lanes, 1 at the most. `slope` is that at the begin.
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
            let (impulse, _) = foot.soft(self.hardness, foot.newton.bound, at);
            let own = sum - (way[0] * impulse[0] + way[1] * impulse[1] + way[2] * impulse[2]);
            sum = foot.acts.select(own, sum);
        }
        self.joints.subtract_slope(length, &mut sum);
        sum
    }

    /// Takes impulses from the soft rows' velocities, and the bounds of friction from these, of some lanes. Where any row changed.
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
            let (old, weights) = foot.soft(hardness, before, speeds);
            let bound = foot.friction * old[0];
            let (new, _) = foot.soft(hardness, bound, speeds);
            let holds = zero.lt(bound) & (length_in_plane(speeds[1], speeds[2]) * hardness).le(bound);
            let presses = zero.lt(new[0]);
            let is_slip = presses & !holds;
            let moved = length_in_plane(new[1] - old[1], new[2] - old[2]);
            let was = foot.newton.weights;
            let of_normal = alike(zero.lt(was[0]), zero.lt(weights[0]));
            let sticks = |of: [Lanes<S>; 4]| of[1].equals(hardness) & of[2].equals(zero);
            let of_tangents = alike(sticks(was), sticks(weights));
            let used = foot.newton.used;
            let turned = is_slip.select(length_in_plane(old[1] - used[1], old[2] - used[2]), zero);
            let most = zero.splat(SLIP_TOLERANCE) * new[0];
            changed = changed | (on & (!(of_normal & of_tangents) | most.lt(moved) | most.lt(turned)));
            let is_slipping = is_slip & zero.lt(bound);
            let kept =
                [presses.select(new[0], zero), presses.select(new[1], zero), presses.select(new[2], zero)];
            Foot::put(&mut foot.impulse, kept, on);
            foot.newton.presses = (on & presses) | (foot.newton.presses & !on);
            foot.newton.sticks = (on & presses & holds) | (foot.newton.sticks & !on);
            differs = differs | (on & !alike(is_slipping, foot.newton.slipped));
            foot.newton.slipped = (on & is_slipping) | (foot.newton.slipped & !on);
            slips = slips | (on & is_slipping);
            foot.newton.bound_residual = (on & is_slipping).select(bound - before, zero);
            foot.newton.bound = (on & !is_slipping).select(bound, before);
        }
        if (differs | slips).any() {
            self.accelerate_bounds(differs, slips);
        }
        self.joints.project(lanes, &self.velocities, changed)
    }

    /// Takes the bounds of what slips on. Where what slips differs from the round before, it begins anew.
    #[inline(always)]
    fn accelerate_bounds(&mut self, differs: Mask<S>, slips: Mask<S>) {
        let zero = self.zero();
        let Self { feet, anderson, .. } = self;
        anderson.begin(differs);
        if !slips.any() {
            return;
        }
        let mut pairs = [[zero; 2]; MOST_FEET];
        for (pair, foot) in pairs.iter_mut().zip(&*feet) {
            let FootNewton { slipped, bound, bound_residual, .. } = foot.newton;
            *pair = [slipped.select(bound, zero), bound_residual];
        }
        let count = feet.len().min(MOST_FEET);
        anderson.advance(slips, &mut pairs[..count]);
        for (foot, [bound, _]) in feet.iter_mut().zip(pairs) {
            let on = slips & foot.newton.slipped;
            // Not a number is none, as for one robot.
            let bound = zero.lt(bound).select(bound, zero);
            foot.newton.bound = on.select(bound, foot.newton.bound);
        }
    }

    /// Where the impulses keep to their bounds, and what is not active to its side.
    #[inline(always)]
    fn holds(&self) -> Mask<S> {
        let zero = self.zero();
        let mut all = zero.le(zero);
        for foot in &self.feet {
            let [n, t, u] = foot.impulse;
            let normal = foot.velocities(&self.velocities)[0];
            let open = !foot.acts | (foot.target - zero.splat(TOLERANCE)).le(normal);
            let most = foot.friction * n * zero.splat(1.0 + 1e-6) + zero.splat(f64::MIN_POSITIVE);
            let presses = zero.le(n) & length_in_plane(t, u).le(most);
            all = all & ((foot.newton.presses & presses) | (!foot.newton.presses & open));
        }
        self.joints.hold(all)
    }
}

/// Where two are the same.
#[inline(always)]
fn alike<S: Simd>(a: Mask<S>, b: Mask<S>) -> Mask<S> {
    (a & b) | (!a & !b)
}

//! Law of a contact's three rows, written over a [`Real`]: for one contact, or for one in each lane.
//!
//! [`ContactRows`](super::contact::ContactRows) has the rows of one contact and the reasons for them.
//! [`newton`](crate::dynamics::direct) and the lanes have the iterations that use this law.

use super::contact::{AT_REST, IMMOVABLE, MAX_CORRECTION_VELOCITY, OVERLAP_REDUCTION, REST, SLOP};
use crate::dynamics::real::{MaskOf, Real, length_in_plane};

/// Tolerance of a row, as a part of its impulse, or as a velocity in m/s or rad/s.
pub(in crate::dynamics) const TOLERANCE: f64 = 1e-9;

/// Tolerance of slipping friction: largest change, as a part of the normal impulse.
pub(in crate::dynamics) const SLIP_TOLERANCE: f64 = 1e-7;

/// Impulses of soft rows, and the weights of their derivative: normal, and tangents tt, tu, uu.
type Soft<R> = ([R; 3], [R; 4]);

/// Resistance of a contact's three rows to impulses.
#[derive(Clone, Copy, Debug)]
pub(in crate::dynamics) struct Resistance<R> {
    /// J M^-1 J' of the normal's row, plus the compliance of surfaces that are springs.
    pub(in crate::dynamics) normal: R,
    /// J M^-1 J': nt, nu.
    pub(in crate::dynamics) coupling: [R; 2],
    /// Inverse of the tangent part: tt, tu, uu.
    pub(in crate::dynamics) inverse: [R; 3],
    /// Inverse of the largest effect along a tangent.
    pub(in crate::dynamics) gradient_step: R,
}

impl<R: Real> Resistance<R> {
    /// Returns the next impulse of a sweep. The normal velocity is to change by `left`; the tangent
    /// velocities are to vanish within the friction bound.
    ///
    /// The tangent impulse is projected onto the disc of radius friction times normal impulse: the circular
    /// cone of Coulomb's law, not a pyramid. Once converged, friction opposes the slip.
    #[inline(always)]
    pub(in crate::dynamics) fn next(
        &self,
        [n0, t0, u0]: [R; 3],
        friction: R,
        [left, vt, vu]: [R; 3],
    ) -> [R; 3] {
        let zero = n0.splat(0.0);
        let normal = (n0 + left / self.normal).max(zero);
        let change = normal - n0;
        let most = friction * normal;
        let has_friction = zero.lt(most) | !t0.equals(zero) | !u0.equals(zero);
        if !has_friction.any() {
            return [normal, t0, u0];
        }
        let ([nt, nu], [a, b, c]) = (self.coupling, self.inverse);
        let (vt, vu) = (vt + nt * change, vu + nu * change);
        let (mut t, mut u) = (t0 - a * vt - b * vu, u0 - b * vt - c * vu);
        let slips = (most * most).lt(t * t + u * u);
        if slips.any() {
            // The impulse that would stop the slip does not show the direction of friction: some directions
            // are easier to move in than others. A step against the slip does.
            let (mut st, mut su) = (t0 - self.gradient_step * vt, u0 - self.gradient_step * vu);
            let size = length_in_plane(st, su);
            let is_beyond = most.lt(size);
            if is_beyond.any() {
                st = is_beyond.select(st * most / size, st);
                su = is_beyond.select(su * most / size, su);
            }
            (t, u) = (slips.select(st, t), slips.select(su, u));
        }
        [normal, has_friction.select(t, t0), has_friction.select(u, u0)]
    }
}

/// Returns the inverse of the tangent part of J M^-1 J', tt, tu and uu, and the inverse of the largest effect
/// along a tangent. They are 0 if nothing can move.
#[inline(always)]
pub(in crate::dynamics) fn inverse_of_tangents<R: Real>([nn, _, _, tt, tu, uu]: [R; 6]) -> ([R; 3], R) {
    let zero = nn.splat(0.0);
    let (determinant, trace) = (tt * uu - tu * tu, tt + uu);
    let half_difference = ((tt - uu) * (tt - uu) / zero.splat(4.0) + tu * tu).sqrt();
    let step = zero.splat(1.0) / (trace / zero.splat(2.0) + half_difference);
    let moves_both = (zero.splat(IMMOVABLE) * trace * trace).lt(determinant);
    let moves_one = (zero.splat(IMMOVABLE) * nn).lt(trace) & !moves_both;
    let mut inverse = [zero; 3];
    if moves_both.any() {
        let both = [uu / determinant, -tu / determinant, tt / determinant];
        for k in 0..3 {
            inverse[k] = moves_both.select(both[k], zero);
        }
    }
    if moves_one.any() {
        // Movable along one direction only, as a wheel's rim on its axle: the pseudo-inverse of l v v' is v
        // v' / l.
        let square = trace * trace;
        let one = [tt / square, tu / square, uu / square];
        for k in 0..3 {
            inverse[k] = moves_one.select(one[k], inverse[k]);
        }
    }
    (inverse, (moves_both | moves_one).select(step, zero))
}

/// Returns whether anything can move, by J M^-1 J'.
#[inline(always)]
pub(in crate::dynamics) fn acts<R: Real>([nn, _, _, tt, _, uu]: [R; 6]) -> R::Mask {
    (nn.splat(IMMOVABLE) * (nn + tt + uu)).lt(nn)
}

/// Limits the velocity at which a point that is touched in the middle of the step is at rest. It may at most
/// reverse the velocity `before` the step: more would add energy.
#[inline(always)]
pub(in crate::dynamics) fn leaving<R: Real>(turning: R, before: R) -> R {
    let zero = turning.splat(0.0);
    turning.clamp((-before).min(zero), (-before).max(zero))
}

/// Returns the normal velocity at which rigid surfaces at a distance arrive; 0 if they have arrived.
#[inline(always)]
pub(in crate::dynamics) fn arrival<R: Real>(distance: R, h: R) -> R {
    let depth = distance + h.splat(REST);
    h.splat(AT_REST).lt(depth).select(-depth / h, h.splat(0.0))
}

/// Returns the normal velocity of position correction.
#[inline(always)]
pub(in crate::dynamics) fn correction<R: Real>(distance: R, h: R) -> R {
    let wanted = h.splat(-OVERLAP_REDUCTION) * (distance + h.splat(SLOP)) / h;
    wanted.clamp(h.splat(0.0), h.splat(MAX_CORRECTION_VELOCITY))
}

/// Returns the impulses of soft rows at these velocities. The hardnesses are the normal's and the tangents',
/// and `bound` limits friction.
#[inline(always)]
pub(in crate::dynamics) fn soft<R: Real>(
    target: R,
    [normal_hardness, hardness]: [R; 2],
    bound: R,
    [n, t, u]: [R; 3],
) -> Soft<R> {
    let zero = target.splat(0.0);
    let normal = (target - n) * normal_hardness;
    let presses = zero.lt(normal);
    let (normal, weight) = (presses.select(normal, zero), presses.select(normal_hardness, zero));
    let speed = length_in_plane(t, u);
    let has_none = bound.le(zero);
    let slips = !(has_none | (speed * hardness).le(bound));
    let mut tangents = [has_none.select(zero, -t * hardness), has_none.select(zero, -u * hardness)];
    let stuck = has_none.select(zero, hardness);
    let mut weights = [stuck, zero, stuck];
    if slips.any() {
        let (part, t, u) = (bound / speed, t / speed, u / speed);
        tangents = [slips.select(-t * bound, tangents[0]), slips.select(-u * bound, tangents[1])];
        weights = [
            slips.select(part * u * u, weights[0]),
            slips.select(-part * t * u, weights[1]),
            slips.select(part * t * t, weights[2]),
        ];
    }
    ([normal, tangents[0], tangents[1]], [weight, weights[0], weights[1], weights[2]])
}

/// Like [`soft`], for known active rows; slipping contacts keep their friction.
#[inline(always)]
pub(in crate::dynamics) fn given<R: Real>(
    target: R,
    [normal_hardness, hardness]: [R; 2],
    (presses, sticks): (R::Mask, R::Mask),
    impulse: [R; 3],
    [n, t, u]: [R; 3],
) -> Soft<R> {
    let zero = target.splat(0.0);
    let normal = presses.select((target - n) * normal_hardness, zero);
    let it = presses.select(sticks.select(-t * hardness, impulse[1]), zero);
    let iu = presses.select(sticks.select(-u * hardness, impulse[2]), zero);
    let weight = presses.select(normal_hardness, zero);
    let tangent = (presses & sticks).select(hardness, zero);
    ([normal, it, iu], [weight, tangent, zero, tangent])
}

/// Returns the initial friction bound, and whether the rows press and stick, from the impulse and the normal
/// velocity.
#[inline(always)]
pub(in crate::dynamics) fn first_guess<R: Real>(
    (target, friction): (R, R),
    resistance: R,
    [n, t, u]: [R; 3],
    velocity: R,
) -> (R, R::Mask, R::Mask) {
    let zero = target.splat(0.0);
    // A new contact has no impulse yet: use the impulse that it would have alone.
    let alone = (target - velocity) / resistance;
    let pressed = zero.lt(n);
    let bound = friction * pressed.select(n, alone.max(zero));
    let presses = pressed | velocity.lt(target);
    let most = bound * bound * zero.splat(1.0 - TOLERANCE);
    let slips = bound.le(zero) | most.le(t * t + u * u);
    (bound, presses, presses & !slips)
}

/// Result of a round of Newton's method for a contact.
#[derive(Clone, Copy, Debug)]
pub(in crate::dynamics) struct Judged<R: Real> {
    /// Next impulse, N s.
    pub(in crate::dynamics) impulse: [R; 3],
    /// Friction bound from the normal impulse, N s.
    pub(in crate::dynamics) bound: R,
    /// Whether it presses, so that it is not open.
    pub(in crate::dynamics) presses: R::Mask,
    /// Whether it presses and sticks.
    pub(in crate::dynamics) sticks: R::Mask,
    /// Whether it presses and slips, with friction.
    pub(in crate::dynamics) slips: R::Mask,
    /// Whether the set of active rows changed, or the step was not exact.
    pub(in crate::dynamics) changed: R::Mask,
}

/// Computes impulses from the soft rows' velocities, and the friction bound from these impulses. `used` and
/// `was` are the impulse and the weights at the start of the round.
#[inline(always)]
pub(in crate::dynamics) fn judge<R: Real>(
    (target, friction): (R, R),
    both: [R; 2],
    before: R,
    speeds: [R; 3],
    (used, was): Soft<R>,
) -> Judged<R> {
    let (zero, [_, hardness]) = (target.splat(0.0), both);
    let (old, weights) = soft(target, both, before, speeds);
    let bound = friction * old[0];
    let (new, _) = soft(target, both, bound, speeds);
    let has_bound = zero.lt(bound);
    let holds = has_bound & (length_in_plane(speeds[1], speeds[2]) * hardness).le(bound);
    let presses = zero.lt(new[0]);
    let slips = presses & !holds;
    let moved = length_in_plane(new[1] - old[1], new[2] - old[2]);
    let of_normal = zero.lt(was[0]).matches(zero.lt(weights[0]));
    let stuck = was[1].equals(hardness) & was[2].equals(zero);
    let of_tangents = stuck.matches(weights[1].equals(hardness) & weights[2].equals(zero));
    // Across the slip the derivative is not constant, so the step was not exact.
    let mut turned = zero;
    if slips.any() {
        turned = slips.select(length_in_plane(old[1] - used[1], old[2] - used[2]), zero);
    }
    let most = zero.splat(SLIP_TOLERANCE) * new[0];
    Judged {
        impulse: [presses.select(new[0], zero), presses.select(new[1], zero), presses.select(new[2], zero)],
        bound,
        presses,
        sticks: presses & holds,
        slips: slips & has_bound,
        changed: !(of_normal & of_tangents) | most.lt(moved) | most.lt(turned),
    }
}

/// Returns whether an impulse presses and is within its friction bound.
#[inline(always)]
pub(in crate::dynamics) fn is_in_cone<R: Real>([n, t, u]: [R; 3], friction: R) -> R::Mask {
    let most = friction * n * n.splat(1.0 + 1e-6) + n.splat(f64::MIN_POSITIVE);
    n.splat(0.0).le(n) & length_in_plane(t, u).le(most)
}

/// Returns the weights of a contact's rows times a column of J.
#[inline(always)]
pub(in crate::dynamics) fn weighted<R: Real>([normal, tt, tu, uu]: [R; 4], [a, b, c]: [R; 3]) -> [R; 3] {
    [a * normal, b * tt + c * tu, b * tu + c * uu]
}

//! How a step takes time: semi-implicit Euler, or leapfrog, which costs the same and is of second order.
//!
//! With a(q, v) the accelerations that one pass through the tree gives, u the velocities in the middle of steps and h
//! the step, leapfrog is (Verlet 1967; Hairer, Lubich and Wanner, "Geometric Numerical Integration", section I.1.4)
//!
//! ```text
//! v_n       = u_(n-1/2) + h/2 (3/2 a_(n-1) - 1/2 a_(n-2))    extrapolated: what is reported
//! u_(n+1/2) = u_(n-1/2) + h a(q_n, v_n)
//! q_(n+1)   = q_n + h u_(n+1/2)
//! ```
//!
//! Only Coriolis, centrifugal and gyroscopic terms read v. Rows (limits, friction, contacts) hold for u, since u moves
//! positions. Semi-implicit Euler is the same with v = u.

use serde::{Deserialize, Serialize};

use super::real::{MaskOf, Real};

/// The method of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Integrator {
    /// Of second order where motion is smooth.
    #[default]
    Leapfrog,
    /// Semi-implicit Euler with implicit damping: the arithmetic of MuJoCo's `Euler`.
    Euler,
}

/// What the next leapfrog step can start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum History {
    /// Velocities that something else than a step gave: the first velocity in the middle of a step is half a
    /// kick away.
    #[default]
    Given,
    /// The velocity in the middle of the last step, and a command since whose answer may be a jump: it is not
    /// extrapolated.
    Interrupted,
    /// The velocity in the middle of the last step, in which something hit, stuck or let go.
    Kinked,
    /// The same, and the acceleration of that step.
    Smooth,
    /// The same, and the acceleration of the step before that.
    SmoothTwice,
}

impl History {
    /// After a step; `smooth` where nothing hit, stuck or let go in it.
    pub(super) fn after(self, smooth: bool) -> Self {
        match self {
            _ if !smooth => Self::Kinked,
            Self::Interrupted => Self::Kinked,
            Self::Given | Self::Kinked => Self::Smooth,
            Self::Smooth | Self::SmoothTwice => Self::SmoothTwice,
        }
    }

    /// The change from the velocity in the middle of the last step to that at its end, by what the last step and the
    /// one before it have changed: for a joint without springs and dampers 3/4 of the former less 1/4 of the latter.
    ///
    /// A lone damper takes the same part f of its velocity in each step, so that what changes is f of what changed
    /// before. That is foreseen exactly, and the rest as for other joints.
    #[inline]
    pub(super) fn extrapolated(self, at: Implicitness, change: f64, before: f64) -> f64 {
        let drift = match self {
            Self::Given | Self::Interrupted | Self::Kinked => return 0.0,
            Self::Smooth => 0.0,
            Self::SmoothTwice => change - at.decay() * before,
        };
        at.ahead(change, drift)
    }
}

/// A joint that a limit acts on has come to it in this step if it went there faster than this, rad/s or m/s: what is held may have as much by
/// what sweeps leave.
pub(super) const ARRIVES: f64 = 1e-6;

/// Of an [`Implicitness`]: from here on 1 - t is below rounding.
pub(super) const STIFF: f64 = 1e16;

/// When within a step the forces of a joint's springs and dampers are taken: dampers at `0.5 <= t <= 1` of the way
/// from the old to the new velocity, springs at the positions that go with it.
///
/// * t = 1: at the end of the step, as backward Euler does. Stable, and of first order.
/// * t = 1/2: dampers at the mean of both velocities (Crank and Nicolson), springs at
///   q_n + h/4 (u_(n+1/2) - u_(n-1/2)) (Newmark's average acceleration). Of second order.
///
/// With any t from 1/2 to 1 for each joint, no motion of joints with springs and dampers grows, whatever the mass
/// matrix M: for q ~ z^n and a mode p, with m = p* M p, k = p* K p and so on, the step is
/// (m + h t d + h^2 b k) (z - 1)^2 + ... = 0 with b = (3 t - 1)/2, c = (1 - t)/2, and |z| <= 1 holds if
/// k (1 - 2 b - 2 c) <= 0, which is -k (2 t - 1) <= 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Implicitness<R: Real = f64> {
    /// t.
    damper: R,
    /// The part of a lone damper's velocity that is left after a step.
    decay: R,
}

impl Implicitness {
    /// Backward Euler.
    pub const BACKWARD: Self = Self { damper: 1.0, decay: 0.0 };
    /// The mean.
    pub const MEAN: Self = Self { damper: 0.5, decay: 1.0 };
}

impl<R: Real> Implicitness<R> {
    /// The same of each.
    #[inline(always)]
    pub fn splat(zero: R, Implicitness { damper, decay }: Implicitness) -> Self {
        Self { damper: zero.splat(damper), decay: zero.splat(decay) }
    }

    /// The first where it is yes, else the second.
    #[inline(always)]
    pub(super) fn select(first: R::Mask, yes: Self, no: Self) -> Self {
        Self { damper: first.select(yes.damper, no.damper), decay: first.select(yes.decay, no.decay) }
    }

    /// For a joint whose springs and dampers would stop it within 1 / `stiffness` steps, h (d + h k) / I.
    ///
    /// A lone damper's velocity decays by 1 / (1 + x + x^2/2 + x^3/6 + x^4/24) in a step, x its `stiffness`: exp(-x)
    /// for small x, and never beyond zero for large ones.
    #[inline(always)]
    pub fn of(stiffness: R) -> Self {
        let x = stiffness;
        let backward = Self::splat(x, Implicitness::BACKWARD);
        let is_moderate = x.lt(x.splat(STIFF));
        if !is_moderate.any() {
            return backward;
        }
        let one = x.splat(1.0);
        let (before, rest) = Self::ratio(x);
        let all = one + x * rest;
        // One division for both.
        let inverse = one / (rest * all);
        let moderate = Self { damper: one - before * all * inverse, decay: rest * inverse };
        Self::select(is_moderate, moderate, backward)
    }

    /// The same of a joint of this inertia, by h (d + h k); the mean where nothing stops it.
    #[inline(always)]
    pub fn of_joint(stiffness: R, inertia: R) -> Self {
        let mean = Self::splat(stiffness, Implicitness::MEAN);
        let is_stiff = stiffness.splat(0.0).lt(stiffness);
        if !is_stiff.any() {
            return mean;
        }
        Self::select(is_stiff, Self::of(stiffness / inertia), mean)
    }

    /// The two numbers of t = 1 - first / second.
    #[inline(always)]
    fn ratio(x: R) -> (R, R) {
        let before = x.splat(0.5) + x * (x.splat(1.0 / 6.0) + x * x.splat(1.0 / 24.0));
        (before, x.splat(1.0) + x * before)
    }

    /// Of D = m + h t d + h^2 b k, with m the `inertia` and t that of [`Implicitness::of`] a `stiffness` h (d + h k) / m: the two
    /// numbers of D = first / second, of which the second is positive. `spring` is k, and `stiffness` h (d + h k).
    ///
    /// Who divides by D so divides once, and does not wait for t: from the leaves to the root each joint waits for those before it.
    #[inline(always)]
    pub fn resistance_ratio(inertia: R, stiffness: R, spring: R, h: R) -> (R, R) {
        let (mut before, mut rest) = (h.splat(0.0), h.splat(1.0));
        let is_moderate = stiffness.lt(h.splat(STIFF) * inertia);
        if is_moderate.any() {
            let (its_before, its_rest) = Self::ratio(stiffness / inertia);
            (before, rest) = (is_moderate.select(its_before, before), is_moderate.select(its_rest, rest));
        }
        ((inertia + stiffness) * rest - (stiffness + h.splat(0.5) * h * h * spring) * before, rest)
    }

    /// The change from the velocity in the middle of a step to that at its end, where the step changed it by `change`, and that is so
    /// much more than foreseen.
    #[inline(always)]
    pub fn ahead(self, change: R, drift: R) -> R {
        (change.splat(1.0) - self.damper) * self.decay * (change + change.splat(0.5) * self.decay * drift)
    }

    /// t.
    #[inline(always)]
    pub fn damper(self) -> R {
        self.damper
    }

    /// The part of a lone damper's velocity that is left after a step.
    #[inline(always)]
    pub fn decay(self) -> R {
        self.decay
    }

    /// Of a spring's position, by how much of h times the new velocity it is ahead.
    #[inline(always)]
    pub fn spring_after(self) -> R {
        self.damper.splat(1.5) * self.damper - self.damper.splat(0.5)
    }

    /// Of a spring's position, by how much of h times the old velocity it is behind.
    #[inline(always)]
    pub fn spring_before(self) -> R {
        self.damper.splat(0.5) - self.damper.splat(0.5) * self.damper
    }

    /// How far ahead of q_n a spring's position is in uniform motion, as a part of h.
    #[inline(always)]
    pub fn spring_ahead(self) -> R {
        self.damper.splat(2.0) * self.damper - self.damper.splat(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor of a lone damper's velocity: (1 - (1 - t) x) / (1 + t x).
    fn decay(x: f64) -> f64 {
        let t = Implicitness::of(x).damper();
        (1.0 - (1.0 - t) * x) / (1.0 + t * x)
    }

    #[test]
    fn a_lone_damper_decays_as_the_exponential_and_never_swings() {
        for x in [1e-6, 1e-3, 0.01, 0.1, 0.3] {
            assert!((decay(x) - (-x).exp()).abs() < 0.01 * x.powi(5) + 1e-15, "{x}: {}", decay(x));
        }
        for power in -12..20 {
            let x = 10f64.powi(power);
            assert!((decay(x) - Implicitness::of(x).decay()).abs() < 1e-12, "{x}");
            assert!((-1e-15..=1.0).contains(&decay(x)), "{x}: {}", decay(x));
            assert!((0.5..=1.0).contains(&Implicitness::of(x).damper()));
        }
        assert_eq!(Implicitness::of(f64::INFINITY), Implicitness::BACKWARD);
    }

    #[test]
    fn what_a_joint_resists_with_is_found_with_one_division() {
        let h = 1e-3;
        for inertia in [1e-9, 0.01, 3.0, 1e6] {
            for spring in [0.0, 1.0, 1e5, 1e12] {
                for damping in [0.0, 0.1, 1e4, 1e12] {
                    let stiffness = h * damping + h * h * spring;
                    let at = Implicitness::of(stiffness / inertia);
                    let expected = inertia + h * at.damper() * damping + h * h * at.spring_after() * spring;
                    let (first, second) = Implicitness::resistance_ratio(inertia, stiffness, spring, h);
                    assert!(second > 0.0);
                    assert!((first / second / expected - 1.0).abs() < 1e-13, "{inertia} {spring} {damping}");
                }
            }
        }
        // What has no inertia, or by rounding less, is moved as slowly as its damper has it.
        for inertia in [0.0, -1e-20] {
            let (first, second) = Implicitness::resistance_ratio(inertia, 0.5, 0.0, h);
            assert!((first / second - 0.5).abs() < 1e-15);
        }
    }

    /// The roots of a mass on a spring and a damper, M u+ = M u - h (k q' + d u'): for any stiffness,
    /// damping and t of its own choice, no root is beyond the unit circle.
    #[test]
    fn no_spring_and_damper_grows() {
        for spring in (-8..16).map(|power| 10f64.powf(f64::from(power) / 2.0)) {
            for damper in (-8..16).map(|power| 10f64.powf(f64::from(power) / 2.0)).chain([0.0]) {
                for at in [Implicitness::of(spring + damper), Implicitness::MEAN, Implicitness::BACKWARD] {
                    // In q_n and h u: u+ (1 + b k + t d) = u (1 + c k - (1 - t) d) - k q.
                    let new = 1.0 + at.spring_after() * spring + at.damper() * damper;
                    let old = 1.0 + at.spring_before() * spring - (1.0 - at.damper()) * damper;
                    let (kick, keep) = (-spring / new, old / new);
                    let (trace, determinant) = (1.0 + kick + keep, keep);
                    assert!((-1.0 - 1e-12..=1.0 + 1e-12).contains(&determinant));
                    assert!(trace.abs() <= 1.0 + determinant + 1e-12, "{spring} {damper} {at:?}");
                }
            }
        }
    }
}

//! Integrators: semi-implicit Euler, and leapfrog, which costs the same and is of second order.
//!
//! Let a(q, v) be the accelerations from one pass through the tree, u the velocities in the middle of steps,
//! and h the step. Leapfrog is (Verlet 1967; Hairer, Lubich and Wanner, "Geometric Numerical Integration",
//! section I.1.4)
//!
//! ```text
//! v_n       = u_(n-1/2) + h/2 (3/2 a_(n-1) - 1/2 a_(n-2))    extrapolated: what is reported
//! u_(n+1/2) = u_(n-1/2) + h a(q_n, v_n)
//! q_(n+1)   = q_n + h u_(n+1/2)
//! ```
//!
//! Only Coriolis, centrifugal and gyroscopic terms use v. Rows (limits, friction, contacts) hold for u, since
//! u moves positions. Semi-implicit Euler is the special case v = u.

use serde::{Deserialize, Serialize};

use super::bullet::BulletContacts;
use super::real::{MaskOf, Real};

/// Integration method of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Integrator {
    /// Leapfrog, of second order for smooth motion.
    #[default]
    Leapfrog,
    /// Semi-implicit Euler with implicit damping: the arithmetic of MuJoCo's `Euler`.
    Euler,
    /// [`Euler`](Self::Euler) with Bullet's laws of overlaps, hits, position limits, speeds and link damping, for
    /// scripts that depend on them; see [`bullet`](super::bullet).
    Bullet(BulletContacts),
}

impl Integrator {
    /// Returns the law of contacts, if it is Bullet's.
    #[inline]
    pub fn bullet(self) -> Option<BulletContacts> {
        if let Self::Bullet(contacts) = self { Some(contacts) } else { None }
    }
}

/// Data from earlier steps that the next leapfrog step can use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum History {
    /// Velocities that were set and not computed by a step: the first velocity in the middle of a step is
    /// half a kick away.
    #[default]
    Given,
    /// The velocity in the middle of the last step, and a command since then whose response may be a jump. It
    /// is not extrapolated.
    Interrupted,
    /// Velocity in the middle of the last step, in which a contact or friction began or ended.
    Kinked,
    /// Velocity in the middle of the last step, which was smooth, and that step's acceleration.
    Smooth,
    /// As [`Smooth`](Self::Smooth), and the acceleration of the smooth step before.
    SmoothTwice,
}

impl History {
    /// Returns the history after a step; `smooth` if no contact or friction began or ended in it.
    pub(super) fn after(self, smooth: bool) -> Self {
        match self {
            _ if !smooth => Self::Kinked,
            Self::Interrupted => Self::Kinked,
            Self::Given | Self::Kinked => Self::Smooth,
            Self::Smooth | Self::SmoothTwice => Self::SmoothTwice,
        }
    }

    /// Returns the change from the middle of the last step to its end, extrapolated from the changes of the
    /// last two steps. For a joint without springs and dampers it is 3/4 of the last change less 1/4 of the
    /// one before.
    ///
    /// A lone damper removes the same part f of its velocity in each step, so each change is f times the one
    /// before. This part is predicted exactly, and the rest as for other joints.
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

/// Arrival speed of a joint at its limit, rad/s or m/s. A joint that moved faster reached the limit in this
/// step; a held one may move slower than this by the solver's residual.
pub(super) const ARRIVES: f64 = 1e-6;

/// Stiffness of an [`Implicitness`] from which 1 - t is below rounding.
pub(super) const STIFF: f64 = 1e16;

/// Time within a step at which the forces of a joint's springs and dampers act. Dampers act at
/// `0.5 <= t <= 1` of the way from the old to the new velocity, springs at the corresponding positions.
///
/// * t = 1: at the end of the step, as in backward Euler. It is stable, and of first order.
/// * t = 1/2: dampers at the mean of both velocities (Crank and Nicolson), springs at q_n + h/4 (u_(n+1/2) -
///   u_(n-1/2)) (Newmark's average acceleration). It is of second order.
///
/// With any t from 1/2 to 1 for each joint, no motion of joints with springs and dampers grows, whatever the
/// mass matrix M. For q ~ z^n and a mode p, let m = p* M p, k = p* K p and so on. The step is
/// `(m + h t d + h^2 b k) (z - 1)^2 + ... = 0`. Here b = (3 t - 1)/2 and c = (1 - t)/2. |z| <= 1 holds if k
/// (1 - 2 b - 2 c) <= 0, which is -k (2 t - 1) <= 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Implicitness<R: Real = f64> {
    /// t.
    damper: R,
    /// Part of a lone damper's velocity that remains after a step.
    decay: R,
}

impl Implicitness {
    /// Backward Euler.
    pub const BACKWARD: Self = Self { damper: 1.0, decay: 0.0 };
    /// Mean of both velocities.
    pub const MEAN: Self = Self { damper: 0.5, decay: 1.0 };
}

impl<R: Real> Implicitness<R> {
    /// Returns the same value for each number of `R`.
    #[inline(always)]
    pub fn splat(zero: R, Implicitness { damper, decay }: Implicitness) -> Self {
        Self { damper: zero.splat(damper), decay: zero.splat(decay) }
    }

    /// Returns the first where the mask is true, else the second.
    #[inline(always)]
    pub(super) fn select(first: R::Mask, yes: Self, no: Self) -> Self {
        Self { damper: first.select(yes.damper, no.damper), decay: first.select(yes.decay, no.decay) }
    }

    /// Returns the implicitness of a joint whose springs and dampers would stop it within 1 / `stiffness`
    /// steps, with `stiffness` = h (d + h k) / I.
    ///
    /// A lone damper's velocity decays by 1 / (1 + x + x^2/2 + x^3/6 + x^4/24) in a step, where x is its
    /// `stiffness`. This approximates exp(-x) for small x, and never crosses zero for large ones.
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

    /// Returns the implicitness of a joint with this inertia, where `stiffness` is h (d + h k); the mean if
    /// nothing stops it.
    #[inline(always)]
    pub fn of_joint(stiffness: R, inertia: R) -> Self {
        let mean = Self::splat(stiffness, Implicitness::MEAN);
        let is_stiff = stiffness.splat(0.0).lt(stiffness);
        if !is_stiff.any() {
            return mean;
        }
        Self::select(is_stiff, Self::of(stiffness / inertia), mean)
    }

    /// Returns the two numbers of t = 1 - first / second.
    #[inline(always)]
    fn ratio(x: R) -> (R, R) {
        let before = x.splat(0.5) + x * (x.splat(1.0 / 6.0) + x * x.splat(1.0 / 24.0));
        (before, x.splat(1.0) + x * before)
    }

    /// Returns D = m + h t d + h^2 b k as two numbers, D = first / second, where the second is positive. m is
    /// the `inertia`, k the `spring`, and `stiffness` is h (d + h k). t is [`Implicitness::of`] of
    /// `stiffness` / m.
    ///
    /// Dividing by D then takes one division, which does not wait for t. From the leaves to the root, each
    /// joint waits for those before it.
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

    /// Returns the change from the velocity in the middle of a step to the one at its end. The step changed
    /// it by `change`, which is `drift` more than predicted.
    #[inline(always)]
    pub fn ahead(self, change: R, drift: R) -> R {
        (change.splat(1.0) - self.damper) * self.decay * (change + change.splat(0.5) * self.decay * drift)
    }

    /// Returns t.
    #[inline(always)]
    pub fn damper(self) -> R {
        self.damper
    }

    /// Returns the part of a lone damper's velocity that remains after a step.
    #[inline(always)]
    pub fn decay(self) -> R {
        self.decay
    }

    /// Returns the coefficient of h times the new velocity in a spring's position.
    #[inline(always)]
    pub fn spring_after(self) -> R {
        self.damper.splat(1.5) * self.damper - self.damper.splat(0.5)
    }

    /// Returns the coefficient of h times the old velocity that a spring's position lags by.
    #[inline(always)]
    pub fn spring_before(self) -> R {
        self.damper.splat(0.5) - self.damper.splat(0.5) * self.damper
    }

    /// Returns how far a spring's position leads q_n in uniform motion, as a part of h.
    #[inline(always)]
    pub fn spring_ahead(self) -> R {
        self.damper.splat(2.0) * self.damper - self.damper.splat(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the factor of a lone damper's velocity: (1 - (1 - t) x) / (1 + t x).
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
    fn the_resistance_of_a_joint_takes_one_division() {
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
        // Without inertia, or with a negative one from rounding, the damper alone limits the motion.
        for inertia in [0.0, -1e-20] {
            let (first, second) = Implicitness::resistance_ratio(inertia, 0.5, 0.0, h);
            assert!((first / second - 0.5).abs() < 1e-15);
        }
    }

    /// Roots of a mass on a spring and a damper, M u+ = M u - h (k q' + d u'). For any stiffness and damping,
    /// with the t that follows, no root is outside the unit circle.
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

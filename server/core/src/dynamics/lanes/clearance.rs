//! Clearance of copies: how far they can move without touching anything.

use pulp::Simd;

use crate::dynamics::lane::number::Lanes;
use crate::dynamics::real::Real as _;

/// Distance that points of a robot can move before they can touch anything, metres; infinite if there is
/// nothing to touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Clearance {
    /// Distance before any point can touch another object, including motion of a free root and of joints,
    /// metres.
    pub around: f64,
    /// Distance before any point can touch another point of the robot, including motion of joints, metres.
    pub own: f64,
    /// For each body, the largest distance that a point moves per unit of its joint; for a free root, per
    /// radian.
    pub levers: Vec<f64>,
    /// Distance from a moving robot within which contacts are looked for, in addition to twice its motion in
    /// a part of a step, metres.
    pub slack: f64,
}

/// Clearance of copies in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneClearance<S: Simd> {
    pub(super) around: Lanes<S>,
    pub(super) own: Lanes<S>,
}

impl<S: Simd> LaneClearance<S> {
    /// Returns an infinite clearance, with nothing to touch.
    pub(super) fn endless(zero: Lanes<S>) -> Self {
        Self { around: zero.splat(f64::INFINITY), own: zero.splat(f64::INFINITY) }
    }
}

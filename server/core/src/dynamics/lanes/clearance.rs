//! How far copies can move before they can touch anything.

use pulp::Simd;

use super::number::Lanes;
use crate::dynamics::real::Real as _;

/// How far points of a robot can move before they can touch anything, metres; infinite where there is nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Clearance {
    /// Before any can touch something else. What a free root moves counts, and what joints move.
    pub around: f64,
    /// Before any can touch another point of the robot. What joints move counts.
    pub own: f64,
    /// Of each body how far a point moves at the most where its joint moves by one unit; of a free root, where it turns by a radian.
    pub levers: Vec<f64>,
    /// Contacts are looked for so far from what moves, and twice what a part of a step moves it.
    pub slack: f64,
}

/// The same of copies.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneClearance<S: Simd> {
    pub(super) around: Lanes<S>,
    pub(super) own: Lanes<S>,
}

impl<S: Simd> LaneClearance<S> {
    /// Where there is nothing that anything could touch.
    pub(super) fn endless(zero: Lanes<S>) -> Self {
        Self { around: zero.splat(f64::INFINITY), own: zero.splat(f64::INFINITY) }
    }
}

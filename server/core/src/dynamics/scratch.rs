//! Scratch of a step, per body: without meaning between steps.

use glamx::{DMat3, DVec3};

use super::inertia::Articulated;
use super::integrator::Implicitness;
use super::ldlt::Ldlt6;
use super::spatial::Spatial;
use super::spatials::Spatials;

/// Impulses at the most whose responses are found at once: right-hand sides of one solution.
pub const MAX_RHS: usize = 8;

/// Of one body. All vectors are in the base's axes and about the body's own origin:
/// what goes from body to body is then only shifted, never turned.
#[derive(Clone, Debug)]
pub struct BodyScratch {
    /// `base_from_body`.
    pub rotation: DMat3,
    /// From its parent's origin to its own.
    pub reach: DVec3,
    /// From the base's origin to its own.
    pub origin: DVec3,
    /// v.
    pub velocity: Spatial,
    /// c = v x S qd.
    pub velocity_product: Spatial,
    /// IA: what it and all that hangs on it resist a force with.
    pub articulated: Articulated,
    /// pA: the force that goes with no acceleration.
    pub bias: Spatial,
    /// U = IA S.
    pub column: Spatial,
    /// When springs and dampers of its joint act.
    pub implicitness: Implicitness,
    /// The same of its actuator's law, also where that is saturated and so adds nothing to D.
    pub of_law: Implicitness,
    /// 1 / D, with D = S' U + armature + h (kd + damping) + h^2 kp; 0 where
    /// nothing resists (a joint without inertia, damping or stiffness is not moved).
    pub inverse_d: f64,
    /// u = effort - S' pA.
    pub drive: f64,
    /// a, gravity included.
    pub acceleration: Spatial,
    /// Change of velocity by an impulse elsewhere.
    pub delta: Spatial,
    /// x: what an impulse leaves at this joint in the backward pass.
    pub impulse: f64,
}

impl Default for BodyScratch {
    fn default() -> Self {
        Self {
            rotation: DMat3::IDENTITY,
            reach: DVec3::ZERO,
            origin: DVec3::ZERO,
            velocity: Spatial::ZERO,
            velocity_product: Spatial::ZERO,
            articulated: Articulated::default(),
            bias: Spatial::ZERO,
            column: Spatial::ZERO,
            implicitness: Implicitness::BACKWARD,
            of_law: Implicitness::BACKWARD,
            inverse_d: 0.0,
            drive: 0.0,
            acceleration: Spatial::ZERO,
            delta: Spatial::ZERO,
            impulse: 0.0,
        }
    }
}

/// Of one body, for several impulses at once.
#[derive(Clone, Copy, Debug)]
pub struct MultiRhs<const N: usize> {
    /// As [`BodyScratch::delta`].
    pub delta: Spatials<N>,
    /// As [`BodyScratch::impulse`].
    pub impulse: [f64; N],
    /// An impulse acts on it or on what hangs on it; else `delta` means nothing before the forward pass.
    pub has_impulse: bool,
}

impl<const N: usize> Default for MultiRhs<N> {
    fn default() -> Self {
        Self { delta: Spatials::ZERO, impulse: [0.0; N], has_impulse: false }
    }
}

/// Of all bodies of a robot.
#[derive(Debug, Default)]
pub struct Scratch {
    /// One a body.
    pub bodies: Vec<BodyScratch>,
    /// One a free body: its IA, factorised.
    pub free: Vec<Ldlt6>,
    /// One a body; none where there is only one.
    pub rhs: Vec<MultiRhs<MAX_RHS>>,
}

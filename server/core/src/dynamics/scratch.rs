//! Scratch of a step for each body, without meaning between steps.

use glamx::{DMat3, DVec3};

use super::inertia::Articulated;
use super::integrator::Implicitness;
use super::ldlt::Ldlt6;
use super::spatial::Spatial;
use super::spatials::Spatials;

/// Maximum number of impulses whose responses are computed at once, as right-hand sides of one solution.
pub const MAX_RHS: usize = 8;

/// Scratch of one body. All vectors are in the base's axes and about the body's own origin: quantities that
/// pass between bodies are only shifted, never turned.
#[derive(Clone, Debug)]
pub struct BodyScratch {
    /// `base_from_body`.
    pub rotation: DMat3,
    /// Vector from the parent's origin to its own, metres.
    pub reach: DVec3,
    /// Vector from the base's origin to its own, metres.
    pub origin: DVec3,
    /// v.
    pub velocity: Spatial,
    /// c = v x S qd.
    pub velocity_product: Spatial,
    /// IA: resistance to force of the body and its subtree.
    pub articulated: Articulated,
    /// pA: force at zero acceleration.
    pub bias: Spatial,
    /// U = IA S.
    pub column: Spatial,
    /// Time at which springs and dampers of its joint act.
    pub implicitness: Implicitness,
    /// Time at which its actuator's law acts, also while the actuator is saturated and adds nothing to D.
    pub of_law: Implicitness,
    /// 1 / D, with D = S' U + armature + h (kd + damping) + h^2 kp. It is 0 if nothing resists: a joint
    /// without inertia, damping or stiffness is not moved.
    pub inverse_d: f64,
    /// u = effort - S' pA.
    pub drive: f64,
    /// a, gravity included.
    pub acceleration: Spatial,
    /// Change of velocity by an impulse on another body.
    pub delta: Spatial,
    /// x: share of an impulse that this joint takes in the backward pass.
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

/// Scratch of one body for several impulses at once.
#[derive(Clone, Copy, Debug)]
pub struct MultiRhs<const N: usize> {
    /// As [`BodyScratch::delta`].
    pub delta: Spatials<N>,
    /// As [`BodyScratch::impulse`].
    pub impulse: [f64; N],
    /// Whether an impulse acts on the body or its subtree; if not, `delta` is undefined before the forward
    /// pass.
    pub has_impulse: bool,
}

impl<const N: usize> Default for MultiRhs<N> {
    fn default() -> Self {
        Self { delta: Spatials::ZERO, impulse: [0.0; N], has_impulse: false }
    }
}

/// Scratch of all bodies of a robot.
#[derive(Debug, Default)]
pub struct Scratch {
    /// One entry for each body.
    pub bodies: Vec<BodyScratch>,
    /// Factorised IA of each free body.
    pub free: Vec<Ldlt6>,
    /// One entry for each body; empty if there is only one body.
    pub rhs: Vec<MultiRhs<MAX_RHS>>,
}

//! M^-1 J' of several impulses at once, by one backward and one forward pass over the factorised tree. Their
//! numbers are stored side by side.
//!
//! Compiled for the vectors of the processor. Each has the same bits on all processors, since nothing is
//! fused or summed in another order.

use glamx::DMat3;
use pulp::{Arch, Simd, WithSimd};

use super::{Row, Sums};
use crate::dynamics::articulated::free_velocities;
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::ldlt::Ldlt6;
use crate::dynamics::scratch::{BodyScratch, MAX_RHS, MultiRhs, Scratch};
use crate::dynamics::spatials::Spatials;
use crate::dynamics::tree::{Body, JointType, Tree};

/// Writes the result of [`respond_to_force`](super::respond_to_force) for each of the six unit impulses on a
/// body about its origin. Torques about the base's axes come first, then forces along them.
pub fn respond_to_unit_forces(tree: &Tree, q: &[f64], body: usize, scratch: &mut Scratch, out: &mut [f64]) {
    Arch::new().dispatch(MultiRhsSolve::of_unit_forces(tree, q, body, scratch, out));
}

/// Writes the result of [`respond`](super::respond) for up to [`MAX_RHS`] rows of joints.
pub fn respond_to_joints(
    tree: &Tree,
    q: &[f64],
    (rows, sums): (&[Row], &Sums),
    scratch: &mut Scratch,
    out: &mut [f64],
) {
    begin(&mut scratch.rhs);
    let mut highest = 0;
    for (k, row) in rows.iter().take(MAX_RHS).enumerate() {
        for (body, (_, factor)) in row.bodies.into_iter().zip(row.entries) {
            push(&mut scratch.rhs, body).impulse[k] += factor;
            highest = highest.max(body);
        }
        for term in row.sum.map_or(&[][..], |sum| sums.terms(sum)) {
            push(&mut scratch.rhs, term.body).impulse[k] += term.factor;
            highest = highest.max(term.body);
        }
    }
    let Scratch { bodies, free, rhs } = scratch;
    Arch::new().dispatch(MultiRhsSolve::<MAX_RHS, false> { tree, q, highest, bodies, free, rhs, out });
}

fn begin<const N: usize>(rhs: &mut [MultiRhs<N>]) {
    for at in rhs {
        (at.impulse, at.has_impulse) = ([0.0; N], false);
    }
}

/// Returns the right-hand sides of a body that an impulse acts on.
#[inline(always)]
fn push<const N: usize>(rhs: &mut [MultiRhs<N>], body: usize) -> &mut MultiRhs<N> {
    let at = &mut rhs[body];
    if !at.has_impulse {
        (at.delta, at.has_impulse) = (Spatials::ZERO, true);
    }
    at
}

/// Solver that writes as many responses as there is room for, or, if it `ADDS`, adds them to the output.
pub struct MultiRhsSolve<'a, const N: usize, const ADDS: bool> {
    tree: &'a Tree,
    q: &'a [f64],
    /// Last body with an impulse.
    highest: usize,
    bodies: &'a [BodyScratch],
    free: &'a [Ldlt6],
    rhs: &'a mut [MultiRhs<N>],
    out: &'a mut [f64],
}

impl<'a> MultiRhsSolve<'a, MAX_RHS, false> {
    /// See [`respond_to_unit_forces`].
    pub fn of_unit_forces(
        tree: &'a Tree,
        q: &'a [f64],
        body: usize,
        scratch: &'a mut Scratch,
        out: &'a mut [f64],
    ) -> Self {
        let Scratch { bodies, free, rhs } = scratch;
        begin(rhs);
        let at = push(rhs, body);
        for k in 0..3 {
            (at.delta.angular[k][k], at.delta.linear[k][k + 3]) = (-1.0, -1.0);
        }
        Self { tree, q, highest: body, bodies, free, rhs, out }
    }
}

impl<'a> MultiRhsSolve<'a, 4, true> {
    /// Adds the result of [`respond_to_force`](super::respond_to_force), to the bit, for each of three
    /// impulses on a body about its origin; the fourth is unused. `rhs` has one entry for each body.
    pub fn of_wrenches(
        tree: &'a Tree,
        q: &'a [f64],
        (body, wrenches): (usize, &Spatials<4>),
        Scratch { bodies, free, .. }: &'a Scratch,
        rhs: &'a mut [MultiRhs<4>],
        out: &'a mut [f64],
    ) -> Self {
        begin(rhs);
        let at = push(rhs, body);
        for k in 0..3 {
            at.delta.set(k, -wrenches.get(k));
        }
        Self { tree, q, highest: body, bodies, free, rhs, out }
    }
}

impl<const N: usize, const ADDS: bool> WithSimd for MultiRhsSolve<'_, N, ADDS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { tree, q, highest, bodies, free, rhs, out } = self;
        // Children come after their parents.
        for i in (0..=highest).rev() {
            let Body { joint_type, parent, .. } = tree.bodies[i];
            if rhs[i].has_impulse && !matches!(joint_type, JointType::Free { .. }) {
                backward_step(rhs, i, joint_type, parent, &bodies[i]);
            }
        }
        let n = tree.velocity_count;
        let (count, nothing) = ((out.len() / n.max(1)).min(N), Spatials::ZERO);
        for (i, body) in tree.bodies.iter().enumerate() {
            let at = &bodies[i];
            let (above, own) = rhs.split_at_mut(i);
            let own = &mut own[0];
            let above = body.parent.map_or(&nothing, |parent| &above[parent].delta);
            let JointType::Free { slot } = body.joint_type else {
                let change = forward_step(own, above, body.joint_type, at);
                for k in 0..count {
                    put::<ADDS>(&mut out[k * n + body.velocity], change[k]);
                }
                continue;
            };
            let carried = above.motion_at(at.reach);
            own.delta = if own.has_impulse { free[slot].solve_all(&own.delta) } else { Spatials::ZERO };
            let (_, rotation) = free_pose(&q[body.position..]);
            // Linear in the parent's axes, angular in its own: see `free_velocities`.
            let own_from_base = at.rotation.transpose();
            let parent_from_base = DMat3::from_quat(rotation) * own_from_base;
            for k in 0..count {
                let motion = own.delta.get(k) - carried.get(k);
                let (linear, angular) = if ADDS {
                    // By the quaternion, as in the response to one impulse: a matrix would round differently.
                    free_velocities(motion, &at.rotation, rotation)
                } else {
                    (parent_from_base * motion.linear, own_from_base * motion.angular)
                };
                for i in 0..3 {
                    put::<ADDS>(&mut out[k * n + body.velocity + i], linear[i]);
                    put::<ADDS>(&mut out[k * n + body.velocity + 3 + i], angular[i]);
                }
            }
        }
    }
}

/// Transfers the impulses on a body to its parent.
#[inline(always)]
fn backward_step<const N: usize>(
    rhs: &mut [MultiRhs<N>],
    body: usize,
    joint_type: JointType,
    parent: Option<usize>,
    at: &BodyScratch,
) {
    let (above, own) = rhs.split_at_mut(body);
    let own = &mut own[0];
    let felt = own.delta.along(joint_type, at.rotation.z_axis);
    let mut taken = [0.0; N];
    for k in 0..N {
        own.impulse[k] -= felt[k];
        taken[k] = at.inverse_d * own.impulse[k];
    }
    if let Some(parent) = parent {
        let mut p = own.delta;
        p.add_multiples(at.column, &taken);
        push(above, parent).delta.add(&p.force_from(at.reach));
    }
}

/// Computes the changes of a body's and its joint's velocity from its parent's.
#[inline(always)]
fn forward_step<const N: usize>(
    own: &mut MultiRhs<N>,
    above: &Spatials<N>,
    joint_type: JointType,
    at: &BodyScratch,
) -> [f64; N] {
    let mut delta = above.motion_at(at.reach);
    let taken = delta.dot(at.column);
    let mut change = [0.0; N];
    for k in 0..N {
        change[k] = at.inverse_d * (own.impulse[k] - taken[k]);
    }
    delta.add_along(joint_type, at.rotation.z_axis, &change);
    own.delta = delta;
    change
}

#[inline(always)]
fn put<const ADDS: bool>(slot: &mut f64, number: f64) {
    *slot = if ADDS { *slot + number } else { number };
}

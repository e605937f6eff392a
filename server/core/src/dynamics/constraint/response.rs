//! J and M^-1 J': what an impulse works on, and what it does to all velocities by one trip up
//! and down the factorised tree.

use glamx::DVec3;

use crate::dynamics::articulated::{along, free_velocities, part_mut, write_free};
use crate::dynamics::inertia::Rigid;
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::scratch::{BodyScratch, Scratch};
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::{Body, JointType, Tree};

/// Writes the change of all velocities by impulses of these sizes at the joints of
/// these bodies. O(n); needs IA, U and D of this step (the articulated-body
/// algorithm once more, without velocities and gravity).
pub fn respond(tree: &Tree, q: &[f64], joints: &[(usize, f64)], scratch: &mut Scratch, out: &mut [f64]) {
    clear(scratch);
    for &(body, size) in joints {
        scratch.bodies[body].impulse += size;
    }
    // Children come after their parents.
    let highest = joints.iter().map(|joint| joint.0).max().unwrap_or(0);
    (0..=highest).rev().for_each(|body| {
        rise(tree, body, scratch);
    });
    descend(tree, q, scratch, out);
}

/// The same for an impulse on a body: `force` about its origin, in the base's axes.
pub fn respond_to_force(
    tree: &Tree,
    q: &[f64],
    (body, force): (usize, Spatial),
    scratch: &mut Scratch,
    out: &mut [f64],
) {
    clear(scratch);
    scratch.bodies[body].delta = -force;
    let mut next = Some(body);
    while let Some(body) = next {
        next = rise(tree, body, scratch);
    }
    descend(tree, q, scratch, out);
}

/// J' f: what an impulse on a body does to each velocity's own momentum. `force` is about the
/// body's origin, in the base's axes; power is then J qd. Writes all velocities.
pub fn project(
    tree: &Tree,
    q: &[f64],
    scratch: &[BodyScratch],
    (body, force): (usize, Spatial),
    out: &mut [f64],
) {
    out.fill(0.0);
    let (mut force, mut i) = (force, body);
    loop {
        let (body, at) = (&tree.bodies[i], &scratch[i]);
        match body.joint_type {
            JointType::Revolute | JointType::Prismatic => {
                out[body.velocity] = along(body.joint_type, force, at.rotation.z_axis);
            }
            JointType::Free { .. } => {
                // The map from motion to velocities only turns: it takes forces as well.
                let (_, rotation) = free_pose(&q[body.position..]);
                let (linear, angular) = free_velocities(force, &at.rotation, rotation);
                write_free(&mut out[body.velocity..], linear, angular);
            }
        }
        let Some(parent) = body.parent else { break };
        force = force.force_from(at.reach);
        i = parent;
    }
}

/// J and M^-1 J' of unit impulses along three axes at a point of a robot that is one free body, world: what
/// [`project`] and [`respond_to_force`] find, without a walk. J has four numbers for each velocity, of which the last is
/// nothing; responses are one after the other. False where the robot is something else.
pub fn single_body_rows(
    tree: &Tree,
    scratch: &Scratch,
    (point, axes): (DVec3, [DVec3; 3]),
    jacobian: &mut [f64],
    responses: &mut [f64],
) -> bool {
    let ([body], [at], [factors]) = (&tree.bodies[..], &scratch.bodies[..], &scratch.free[..]) else {
        return false;
    };
    if tree.fixed_base || !factors.is_regular() {
        return false;
    }
    let (Some(jacobian), Some(responses)) =
        (jacobian.first_chunk_mut::<24>(), responses.first_chunk_mut::<18>())
    else {
        return false;
    };
    let Rigid { mass, first_moment, .. } = body.inertia;
    let center = first_moment / mass;
    let inverse = body.inertia.shifted(-center).moment.matrix().inverse();
    let own_from_world = at.rotation.transpose();
    let arm = point - at.origin;
    for (k, axis) in axes.into_iter().enumerate() {
        let moment = own_from_world * arm.cross(axis);
        for i in 0..3 {
            jacobian[4 * i + k] = axis[i];
            jacobian[4 * (i + 3) + k] = moment[i];
        }
        // About the centre of mass linear and angular motion are apart.
        let turn = inverse * (moment - center.cross(own_from_world * axis));
        let shift = axis / mass - at.rotation * turn.cross(center);
        for i in 0..3 {
            responses[6 * k + i] = shift[i];
            responses[6 * k + 3 + i] = turn[i];
        }
    }
    for velocity in jacobian.chunks_exact_mut(4) {
        velocity[3] = 0.0;
    }
    true
}

fn clear(scratch: &mut Scratch) {
    for at in &mut scratch.bodies {
        at.impulse = 0.0;
        at.delta = Spatial::ZERO;
    }
}

/// Takes what acts on a body on to its parent, if there is something and one that feels it. `delta` holds p until
/// the way down.
fn rise(tree: &Tree, body: usize, scratch: &mut Scratch) -> Option<usize> {
    let Body { joint_type, parent, .. } = tree.bodies[body];
    if let JointType::Free { .. } = joint_type {
        return None;
    }
    let at = &mut scratch.bodies[body];
    let p = at.delta;
    at.impulse -= along(joint_type, p, at.rotation.z_axis);
    let parent = parent?;
    if at.impulse != 0.0 || p != Spatial::ZERO {
        let p = (p + at.column * (at.inverse_d * at.impulse)).force_from(at.reach);
        scratch.bodies[parent].delta += p;
    }
    Some(parent)
}

/// Down, through every branch.
fn descend(tree: &Tree, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
    for (i, body) in tree.bodies.iter().enumerate() {
        let above = body.parent.map_or(Spatial::ZERO, |parent| scratch.bodies[parent].delta);
        let at = &mut scratch.bodies[i];
        let carried = above.motion_at(at.reach);
        match body.joint_type {
            JointType::Revolute | JointType::Prismatic => {
                let change = at.inverse_d * (at.impulse - at.column.dot(carried));
                at.delta = carried;
                *part_mut(body.joint_type, &mut at.delta) += at.rotation.z_axis * change;
                out[body.velocity] = change;
            }
            JointType::Free { slot } => {
                at.delta = scratch.free[slot].solve(-at.delta);
                let (_, rotation) = free_pose(&q[body.position..]);
                let (linear, angular) = free_velocities(at.delta - carried, &at.rotation, rotation);
                write_free(&mut out[body.velocity..], linear, angular);
            }
        }
    }
}

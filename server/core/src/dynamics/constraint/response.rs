//! J and M^-1 J': what an impulse works on, and what it does to all velocities by one trip up
//! and down the factorised tree.

use glamx::DVec3;

use super::Row;
use super::side::Side;
use crate::dynamics::articulated::{along, free_velocities, part_mut, write_free};
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::scratch::{BodyScratch, Scratch, SixTrips};
use crate::dynamics::six::Six;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::{Body, JointType, SingleBody, Tree};

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

/// [`respond_to_force`] for each of the six unit impulses on a body about its origin: torques about the base's axes, then
/// forces along them; all of one after all of the one before.
pub fn respond_to_unit_forces(tree: &Tree, q: &[f64], body: usize, scratch: &mut Scratch, out: &mut [f64]) {
    begin_six(&mut scratch.six);
    let at = push(&mut scratch.six, body);
    for k in 0..3 {
        (at.delta.angular[k][k], at.delta.linear[k][k + 3]) = (-1.0, -1.0);
    }
    respond_to_six(tree, q, body, scratch, out);
}

/// [`respond`] for up to six rows of joints at once.
pub fn respond_to_joints(tree: &Tree, q: &[f64], rows: &[Row], scratch: &mut Scratch, out: &mut [f64]) {
    begin_six(&mut scratch.six);
    let mut highest = 0;
    for (k, row) in rows.iter().take(6).enumerate() {
        for (body, (_, factor)) in row.bodies.into_iter().zip(row.entries) {
            push(&mut scratch.six, body).impulse[k] += factor;
            highest = highest.max(body);
        }
    }
    respond_to_six(tree, q, highest, scratch, out);
}

fn begin_six(six: &mut [SixTrips]) {
    for at in six {
        (at.impulse, at.has_impulse) = ([0.0; 6], false);
    }
}

/// A body that an impulse acts on.
fn push(six: &mut [SixTrips], body: usize) -> &mut SixTrips {
    let at = &mut six[body];
    if !at.has_impulse {
        (at.delta, at.has_impulse) = (Six::default(), true);
    }
    at
}

/// One trip for six, whose numbers lie side by side. Writes as many as there is room for.
fn respond_to_six(tree: &Tree, q: &[f64], highest: usize, scratch: &mut Scratch, out: &mut [f64]) {
    let Scratch { bodies, free, six } = scratch;
    // Children come after their parents.
    for i in (0..=highest).rev() {
        let Body { joint_type, parent, .. } = tree.bodies[i];
        if !six[i].has_impulse || matches!(joint_type, JointType::Free { .. }) {
            continue;
        }
        let lifted = lift(&mut six[i], &bodies[i], axis_of(joint_type, &bodies[i]));
        if let Some(parent) = parent {
            push(six, parent).delta.add(&lifted);
        }
    }
    let n = tree.velocity_count;
    let count = (out.len() / n.max(1)).min(6);
    for (i, body) in tree.bodies.iter().enumerate() {
        let at = &bodies[i];
        let (above, own) = six.split_at_mut(i);
        let own = &mut own[0];
        let above = body.parent.map(|parent| &above[parent].delta);
        match body.joint_type {
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                let change = lower(own, above.unwrap_or(&Six::default()), at, axis_of(body.joint_type, at));
                for (k, change) in change.into_iter().enumerate().take(count) {
                    out[k * n + body.velocity] = change;
                }
            }
            JointType::Free { slot } => {
                let (_, rotation) = free_pose(&q[body.position..]);
                let carried = above.map(|above| above.motion_at(at.reach)).unwrap_or_default();
                let forces = if own.has_impulse { own.delta } else { Six::default() };
                for k in 0..count {
                    let delta = free[slot].solve(-forces.get(k));
                    own.delta.set(k, delta);
                    let (linear, angular) = free_velocities(delta - carried.get(k), &at.rotation, rotation);
                    write_free(&mut out[k * n + body.velocity..], linear, angular);
                }
            }
        }
    }
}

/// S of a joint of one axis, in the base's axes.
fn axis_of(joint_type: JointType, at: &BodyScratch) -> Spatial {
    let mut axis = Spatial::ZERO;
    *part_mut(joint_type, &mut axis) = at.rotation.z_axis;
    axis
}

/// What six impulses on a body leave for its parent.
#[inline(never)]
fn lift(own: &mut SixTrips, at: &BodyScratch, axis: Spatial) -> Six {
    let felt = own.delta.dot(axis);
    own.impulse = std::array::from_fn(|k| own.impulse[k] - felt[k]);
    let mut p = own.delta;
    p.add_multiples(at.column, &own.impulse.map(|impulse| at.inverse_d * impulse));
    p.force_from(at.reach)
}

/// What six changes of its parent's velocity change a body's by, and its joint's.
#[inline(never)]
fn lower(own: &mut SixTrips, above: &Six, at: &BodyScratch, axis: Spatial) -> [f64; 6] {
    let mut delta = above.motion_at(at.reach);
    let taken = delta.dot(at.column);
    let change = std::array::from_fn(|k| at.inverse_d * (own.impulse[k] - taken[k]));
    delta.add_multiples(axis, &change);
    own.delta = delta;
    change
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
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
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

/// [`project`] of three impulses, added to a side's J.
pub fn project_onto(
    tree: &Tree,
    q: &[f64],
    scratch: &[BodyScratch],
    (body, mut forces): (usize, [Spatial; 3]),
    side: &Side,
    jacobian: &mut [f64],
) {
    let mut next = Some(body);
    while let Some(i) = next {
        let (body, at) = (&tree.bodies[i], &scratch[i]);
        let mut add = |velocity: usize, entries: [f64; 3]| {
            let columns = side.columns_of(velocity).into_iter().flatten();
            columns.zip(entries).for_each(|(column, entry)| jacobian[column] += entry);
        };
        match body.joint_type {
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                let entries = forces.map(|force| along(body.joint_type, force, at.rotation.z_axis));
                add(body.velocity, entries);
            }
            JointType::Free { .. } => {
                let (_, rotation) = free_pose(&q[body.position..]);
                let parts = forces.map(|force| free_velocities(force, &at.rotation, rotation));
                for i in 0..3 {
                    add(body.velocity + i, parts.map(|(linear, _)| linear[i]));
                    add(body.velocity + 3 + i, parts.map(|(_, angular)| angular[i]));
                }
            }
        }
        forces = forces.map(|force| force.force_from(at.reach));
        next = body.parent;
    }
}

/// J and M^-1 J' of unit impulses along three axes at a point of a robot that is one free body, world: what
/// [`project`] and [`respond_to_force`] find, without a walk, as a [`Side`] has them. False where the robot is something else.
pub fn single_body_rows(
    tree: &Tree,
    scratch: &Scratch,
    (point, axes): (DVec3, [DVec3; 3]),
    numbers: &mut [f64],
) -> bool {
    let ([at], [factors], Some(body)) = (&scratch.bodies[..], &scratch.free[..], &tree.single) else {
        return false;
    };
    if !factors.is_regular() {
        return false;
    }
    let Some((jacobian, responses)) = numbers.split_first_chunk_mut::<18>() else { return false };
    let Some(responses) = responses.first_chunk_mut::<18>() else { return false };
    let SingleBody { mass, center, inverse_moment } = *body;
    let own_from_world = at.rotation.transpose();
    let arm = point - at.origin;
    for (k, axis) in axes.into_iter().enumerate() {
        let moment = own_from_world * arm.cross(axis);
        for i in 0..3 {
            jacobian[6 * (i / 2) + 2 * k + i % 2] = axis[i];
            jacobian[6 * ((i + 3) / 2) + 2 * k + (i + 3) % 2] = moment[i];
        }
        // About the centre of mass linear and angular motion are apart.
        let turn = inverse_moment * (moment - center.cross(own_from_world * axis));
        let shift = axis / mass - at.rotation * turn.cross(center);
        for i in 0..3 {
            responses[6 * k + i] = shift[i];
            responses[6 * k + 3 + i] = turn[i];
        }
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
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
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

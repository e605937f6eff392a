//! J and M^-1 J': what an impulse works on, and what it does to all rates by one trip up
//! and down the factorised tree.

use crate::dynamics::articulated::{along, free_rates, part_mut, write_free};
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::{Body, Freedom, Tree};
use crate::dynamics::work::{Work, Workspace};

/// Writes the change of all rates by impulses of these sizes at the joints of
/// these bodies. O(n); needs IA, U and D of this step (the articulated-body
/// algorithm once more, without velocities and gravity).
pub fn respond(tree: &Tree, q: &[f64], joints: &[(usize, f64)], work: &mut Workspace, out: &mut [f64]) {
    clear(work);
    for &(body, size) in joints {
        work.bodies[body].impulse += size;
    }
    // Children come after their parents.
    let highest = joints.iter().map(|joint| joint.0).max().unwrap_or(0);
    (0..=highest).rev().for_each(|body| {
        rise(tree, body, work);
    });
    descend(tree, q, work, out);
}

/// The same for an impulse on a body: `force` about its origin, in the base's axes.
pub fn respond_to_force(
    tree: &Tree,
    q: &[f64],
    (body, force): (usize, Spatial),
    work: &mut Workspace,
    out: &mut [f64],
) {
    clear(work);
    work.bodies[body].delta = -force;
    let mut next = Some(body);
    while let Some(body) = next {
        next = rise(tree, body, work);
    }
    descend(tree, q, work, out);
}

/// J' f: what an impulse on a body does to each rate's own momentum. `force` is about the
/// body's origin, in the base's axes; power is then J qd. Writes all rates.
pub fn project(tree: &Tree, q: &[f64], work: &[Work], (body, force): (usize, Spatial), out: &mut [f64]) {
    out.fill(0.0);
    let (mut force, mut i) = (force, body);
    loop {
        let (body, at) = (&tree.bodies[i], &work[i]);
        match body.freedom {
            Freedom::Revolute | Freedom::Prismatic => {
                out[body.velocity] = along(body.freedom, force, at.rotation.z_axis);
            }
            Freedom::Free { .. } => {
                // The map from motion to rates only turns: it takes forces as well.
                let (_, rotation) = free_pose(&q[body.position..]);
                let (linear, angular) = free_rates(force, &at.rotation, rotation);
                write_free(&mut out[body.velocity..], linear, angular);
            }
        }
        let Some(parent) = body.parent else { break };
        force = force.force_from(at.reach);
        i = parent;
    }
}

fn clear(work: &mut Workspace) {
    for at in &mut work.bodies {
        at.impulse = 0.0;
        at.delta = Spatial::ZERO;
    }
}

/// Takes what acts on a body on to its parent, if there is something and one that feels it. `delta` holds p until
/// the way down.
fn rise(tree: &Tree, body: usize, work: &mut Workspace) -> Option<usize> {
    let Body { freedom, parent, .. } = tree.bodies[body];
    if let Freedom::Free { .. } = freedom {
        return None;
    }
    let at = &mut work.bodies[body];
    let p = at.delta;
    at.impulse -= along(freedom, p, at.rotation.z_axis);
    let parent = parent?;
    if at.impulse != 0.0 || p != Spatial::ZERO {
        let p = (p + at.column * (at.inverse_d * at.impulse)).force_from(at.reach);
        work.bodies[parent].delta += p;
    }
    Some(parent)
}

/// Down, through every branch.
fn descend(tree: &Tree, q: &[f64], work: &mut Workspace, out: &mut [f64]) {
    for (i, body) in tree.bodies.iter().enumerate() {
        let above = body.parent.map_or(Spatial::ZERO, |parent| work.bodies[parent].delta);
        let at = &mut work.bodies[i];
        let carried = above.motion_at(at.reach);
        match body.freedom {
            Freedom::Revolute | Freedom::Prismatic => {
                let change = at.inverse_d * (at.impulse - at.column.dot(carried));
                at.delta = carried;
                *part_mut(body.freedom, &mut at.delta) += at.rotation.z_axis * change;
                out[body.velocity] = change;
            }
            Freedom::Free { slot } => {
                at.delta = work.free[slot].solve(-at.delta);
                let (_, rotation) = free_pose(&q[body.position..]);
                let (linear, angular) = free_rates(at.delta - carried, &at.rotation, rotation);
                write_free(&mut out[body.velocity..], linear, angular);
            }
        }
    }
}

//! M^-1 J': what an impulse does to all rates, by one trip up and down the
//! factorised tree.

use crate::dynamics::articulated::{along, free_rates, part_mut, write_free};
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::{Freedom, Tree};
use crate::dynamics::work::Workspace;

/// Writes the change of all rates by impulses of these sizes at the joints of
/// these bodies. O(n); needs IA, U and D of this step (the articulated-body
/// algorithm once more, without velocities and gravity).
pub fn respond(tree: &Tree, q: &[f64], joints: &[(usize, f64)], work: &mut Workspace, out: &mut [f64]) {
    for at in &mut work.bodies {
        at.impulse = 0.0;
        at.delta = Spatial::ZERO;
    }
    for &(body, size) in joints {
        work.bodies[body].impulse += size;
    }
    // Up. `delta` holds p until the way down.
    let highest = joints.iter().map(|joint| joint.0).max().unwrap_or(0);
    for i in (0..=highest).rev() {
        let body = &tree.bodies[i];
        let at = &mut work.bodies[i];
        let p = at.delta;
        if let Freedom::Free { .. } = body.freedom {
            continue;
        }
        at.impulse -= along(body.freedom, p, at.rotation.z_axis);
        let Some(parent) = body.parent else { continue };
        if at.impulse == 0.0 && p == Spatial::ZERO {
            continue;
        }
        let p = (p + at.column * (at.inverse_d * at.impulse)).force_from(at.reach);
        work.bodies[parent].delta += p;
    }
    // Down, through every branch.
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

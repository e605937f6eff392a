//! The inertia that a step's impulses work against, as a dense matrix: the inverse of what
//! [`respond`](super::constraint::respond) applies.

use glamx::DVec3;

use super::articulated::along;
use super::inertia::Rigid;
use super::kinematics::free_pose;
use super::scratch::Scratch;
use super::spatial::Spatial;
use super::tree::{JointType, Tree};

/// What stands for the inertia of a joint that nothing moves.
const LOCKED: f64 = 1e30;

/// Writes M with what actuators, damping and armature add to its diagonal, `velocity_count` squared, row by row: the
/// composite-rigid-body algorithm (Featherstone table 6.2) with the places and the 1 / D that this step's passes
/// found. False where a free body has a direction without inertia: then there is no such matrix.
pub fn implicit_inertia(
    tree: &Tree,
    q: &[f64],
    scratch: &Scratch,
    composite: &mut Vec<Rigid>,
    matrix: &mut [f64],
) -> bool {
    let n = tree.velocity_count;
    composite.clear();
    composite
        .extend(tree.bodies.iter().zip(&scratch.bodies).map(|(body, at)| body.inertia.turned(&at.rotation)));
    for (i, body) in tree.bodies.iter().enumerate().rev() {
        if let Some(parent) = body.parent {
            let lifted = composite[i].shifted(scratch.bodies[i].reach);
            composite[parent] += lifted;
        }
    }
    matrix.fill(0.0);
    for (i, body) in tree.bodies.iter().enumerate() {
        let at = &scratch.bodies[i];
        let (own, count) = columns(tree, q, scratch, i);
        for (a, &column) in own[..count].iter().enumerate() {
            let row = body.velocity + a;
            let mut force = composite[i].times(column);
            let mut j = i;
            loop {
                let (above, count) = columns(tree, q, scratch, j);
                for (b, direction) in above[..count].iter().enumerate() {
                    let value = direction.dot(force);
                    matrix[row * n + tree.bodies[j].velocity + b] = value;
                    matrix[(tree.bodies[j].velocity + b) * n + row] = value;
                }
                let Some(parent) = tree.bodies[j].parent else { break };
                force = force.force_from(scratch.bodies[j].reach);
                j = parent;
            }
        }
        match body.joint_type {
            JointType::Free { slot } => {
                if !scratch.free[slot].is_regular() {
                    return false;
                }
            }
            JointType::Revolute | JointType::Prismatic => {
                let added = if at.inverse_d > 0.0 {
                    1.0 / at.inverse_d - along(body.joint_type, at.column, at.rotation.z_axis)
                } else {
                    LOCKED
                };
                matrix[body.velocity * (n + 1)] += added;
            }
        }
    }
    true
}

/// The columns of S about the body's origin, in the base's axes, and how many there are.
fn columns(tree: &Tree, q: &[f64], scratch: &Scratch, body: usize) -> ([Spatial; 6], usize) {
    let (body, at) = (&tree.bodies[body], &scratch.bodies[body]);
    let mut columns = [Spatial::ZERO; 6];
    match body.joint_type {
        JointType::Revolute => columns[0].angular = at.rotation.z_axis,
        JointType::Prismatic => columns[0].linear = at.rotation.z_axis,
        JointType::Free { .. } => {
            let own_from_parent = free_pose(&q[body.position..]).1.inverse();
            for (i, axis) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                columns[i].linear = at.rotation * (own_from_parent * axis);
                columns[i + 3].angular = at.rotation * axis;
            }
        }
    }
    (columns, body.joint_type.velocities())
}

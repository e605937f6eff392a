//! Inertia that a step's impulses act on, as a dense matrix: the inverse of the operator
//! [`respond`](super::constraint::respond).

use glamx::DVec3;

use super::articulated::{along, part_mut};
use super::constraint::project;
use super::inertia::Rigid;
use super::kinematics::free_pose;
use super::ldlt::Ldlt6;
use super::scratch::{BodyScratch, Scratch};
use super::spatial::Spatial;
use super::tree::{Body, JointType, Tree};

/// Inertia of a joint that nothing moves.
pub(super) const LOCKED: f64 = 1e30;

/// Writes M with the terms that actuators, damping and armature add to its diagonal, `velocity_count`
/// squared, row by row, on and below the diagonal. Uses the composite-rigid-body algorithm (Featherstone
/// table 6.2) with the poses and the 1 / D of this step's passes. Returns false if a free body has a
/// direction without inertia: then there is no such matrix.
pub fn implicit_inertia(
    tree: &Tree,
    q: &[f64],
    scratch: &Scratch,
    composite: &mut Vec<Rigid>,
    matrix: &mut [f64],
) -> bool {
    if !scratch.free.iter().all(Ldlt6::is_regular) {
        return false;
    }
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
    for (i, body) in tree.bodies.iter().enumerate() {
        let at = &scratch.bodies[i];
        let mut write = |row: usize, column: Spatial| {
            // The momentum of a unit velocity, projected onto the velocities above it.
            let row = &mut matrix[row * n..row * n + body.velocity + body.joint_type.velocities()];
            project(tree, q, &scratch.bodies, (i, composite[i].times(column)), row);
        };
        match body.joint_type {
            JointType::Free { .. } => {
                for (k, column) in free_columns(q, body, at).into_iter().enumerate() {
                    write(body.velocity + k, column);
                }
            }
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                let mut column = Spatial::ZERO;
                *part_mut(body.joint_type, &mut column) = at.rotation.z_axis;
                write(body.velocity, column);
                matrix[body.velocity * (n + 1)] += if at.inverse_d > 0.0 {
                    1.0 / at.inverse_d - along(body.joint_type, at.column, at.rotation.z_axis)
                } else {
                    LOCKED
                };
            }
        }
    }
    true
}

/// Returns the columns of S of a free body about its origin, in the base's axes.
fn free_columns(q: &[f64], body: &Body, at: &BodyScratch) -> [Spatial; 6] {
    let own_from_parent = free_pose(&q[body.position..]).1.inverse();
    let mut columns = [Spatial::ZERO; 6];
    for (i, axis) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        columns[i].linear = at.rotation * (own_from_parent * axis);
        columns[i + 3].angular = at.rotation * axis;
    }
    columns
}

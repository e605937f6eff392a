//! Joint-space mass matrix M(q), in the dense form that a step never builds.

use glamx::{DMat3, DVec3};

use super::inertia::Rigid;
use super::kinematics::{free_pose, placement};
use super::spatial::{Placement, Spatial};
use super::tree::{Body, JointType, Tree};

/// Returns M at positions `q`, row by row, `velocity_count` squared, without armature: the
/// composite-rigid-body algorithm (Featherstone table 6.2). Units follow the velocities: kg m^2, kg m or kg.
pub fn mass_matrix(tree: &Tree, q: &[f64]) -> Vec<f64> {
    let n = tree.velocity_count;
    let placements: Vec<Placement> = tree.bodies.iter().map(|body| placement(body, q)).collect();
    let mut composite: Vec<Rigid> = tree.bodies.iter().map(|body| body.inertia).collect();
    for (i, body) in tree.bodies.iter().enumerate().rev() {
        if let Some(parent) = body.parent {
            let lifted = composite[i].turned(&placements[i].rotation).shifted(placements[i].origin);
            composite[parent] += lifted;
        }
    }
    let mut matrix = vec![0.0; n * n];
    for (i, body) in tree.bodies.iter().enumerate() {
        for (a, column) in subspace(body, q).into_iter().enumerate() {
            let mut force = composite[i].times(column);
            let (mut j, row) = (i, body.velocity + a);
            loop {
                let above = &tree.bodies[j];
                for (b, direction) in subspace(above, q).into_iter().enumerate() {
                    let value = direction.dot(force);
                    matrix[row * n + above.velocity + b] = value;
                    matrix[(above.velocity + b) * n + row] = value;
                }
                let Some(parent) = above.parent else { break };
                force = placements[j].force_to_parent(force);
                j = parent;
            }
        }
    }
    matrix
}

/// Returns the columns of S; the body's own velocity is S qd.
fn subspace(body: &Body, q: &[f64]) -> Vec<Spatial> {
    match body.joint_type {
        JointType::Revolute | JointType::Spherical { .. } => vec![Spatial::new(DVec3::Z, DVec3::ZERO)],
        JointType::Prismatic => vec![Spatial::new(DVec3::ZERO, DVec3::Z)],
        JointType::Free { .. } => {
            // Velocities are linear in the parent's axes, then angular in the body's own.
            let own = DMat3::from_quat(free_pose(&q[body.position..]).1).transpose();
            let linear = [own.x_axis, own.y_axis, own.z_axis].map(|axis| Spatial::new(DVec3::ZERO, axis));
            let angular = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| Spatial::new(axis, DVec3::ZERO));
            linear.into_iter().chain(angular).collect()
        }
    }
}

//! Inverse dynamics: efforts from accelerations.

use glamx::{DMat3, DVec3};

use super::articulated::{along, base_acceleration, free_velocities, write_free};
use super::configuration::{Configuration, Kinematics};
use super::mass_matrix::mass_matrix;
use super::spatial::Spatial;
use super::tree::{JointType, Tree};

/// Resistance to a joint's motion in addition to the inertia of links.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resistance {
    /// Armature, kg m^2 or kg.
    pub armature: f64,
    /// Damping, N m s/rad or N s/m.
    pub damping: f64,
    /// Stiffness of the spring, N m/rad or N/m; only for a joint of one axis.
    pub spring_stiffness: f64,
    /// Rest position of the spring, rad or m.
    pub spring_rest: f64,
}

/// Returns the efforts that give these accelerations under gravity (m/s^2, world axes), by velocity: N m or
/// N. For a free root they are the force and the torque at its origin, world axes. `accelerations` and
/// `resistance` are by velocity too; missing values are zero. Dry friction, limits and contacts are ignored.
///
/// The recursive Newton-Euler algorithm (Featherstone table 5.1), with armature, damping and spring added at
/// each joint, as in a step.
pub fn inverse_dynamics(
    tree: &Tree,
    configuration: &Configuration,
    gravity: DVec3,
    accelerations: &[f64],
    resistance: &[Resistance],
) -> Vec<f64> {
    let (q, qd) = configuration.state(tree);
    let mut qdd = accelerations.to_vec();
    qdd.resize(tree.velocity_count, 0.0);
    let world_from_root = DMat3::from_quat(configuration.root.rotation);
    if !tree.fixed_base {
        turn(&world_from_root.transpose(), &mut qdd);
    }
    let Kinematics { mut scratch, .. } = Kinematics::new(tree, &q, &qd);
    let base = Spatial::new(DVec3::ZERO, base_acceleration(&configuration.base(tree), gravity));
    for (i, body) in tree.bodies.iter().enumerate() {
        let above = body.parent.map_or(base, |parent| scratch[parent].acceleration);
        let at = &mut scratch[i];
        let (qd, qdd) = (&qd[body.velocity..], &qdd[body.velocity..]);
        let z = at.rotation.z_axis;
        let own = match body.joint_type {
            JointType::Revolute | JointType::Spherical { .. } => Spatial::new(z * qdd[0], DVec3::ZERO),
            JointType::Prismatic => Spatial::new(DVec3::ZERO, z * qdd[0]),
            JointType::Free { .. } => {
                // The linear velocity is in axes that do not turn with the body: a step adds R w x v, see
                // `accelerate`.
                let of = |v: &[f64]| (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]));
                let ((linear, angular), (linear_qdd, angular_qdd)) = (of(qd), of(qdd));
                let joint_from_body = super::kinematics::free_pose(&q[body.position..]).1;
                let own_axes =
                    joint_from_body.inverse() * (linear_qdd - (joint_from_body * angular).cross(linear));
                Spatial::new(at.rotation * angular_qdd, at.rotation * own_axes)
            }
        };
        at.acceleration = above.motion_at(at.reach) + at.velocity_product + own;
        let inertia = body.inertia.turned(&at.rotation);
        // The force on the body: I a + v x* I v.
        at.bias = inertia.times(at.acceleration) + at.velocity.cross_force(inertia.times(at.velocity));
    }
    let mut efforts = vec![0.0; tree.velocity_count];
    for (i, body) in tree.bodies.iter().enumerate().rev() {
        let (force, reach) = (scratch[i].bias, scratch[i].reach);
        let out = &mut efforts[body.velocity..];
        match body.joint_type {
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                out[0] = along(body.joint_type, force, scratch[i].rotation.z_axis);
                if let Some(spring) = resistance.get(body.velocity).filter(|of| of.spring_stiffness > 0.0) {
                    out[0] += spring.spring_stiffness * (tree.position_of_axis(i, &q) - spring.spring_rest);
                }
            }
            JointType::Free { .. } => {
                let rotation = super::kinematics::free_pose(&q[body.position..]).1;
                let (linear, angular) = free_velocities(force, &scratch[i].rotation, rotation);
                write_free(out, linear, angular);
            }
        }
        if let Some(parent) = body.parent {
            scratch[parent].bias += force.force_from(reach);
        }
    }
    for (((effort, resistance), qd), qdd) in efforts.iter_mut().zip(resistance).zip(&qd).zip(&qdd) {
        *effort += resistance.armature * qdd + resistance.damping * qd;
    }
    if !tree.fixed_base {
        turn(&world_from_root, &mut efforts);
    }
    efforts
}

/// Returns the joint-space inertia matrix with armature, row by row, in the velocity order of
/// [`Configuration`].
pub fn inertia_matrix(tree: &Tree, configuration: &Configuration, resistance: &[Resistance]) -> Vec<f64> {
    let (q, _) = configuration.state(tree);
    let n = tree.velocity_count;
    let mut matrix = mass_matrix(tree, &q);
    for (i, resistance) in resistance.iter().enumerate().take(n) {
        matrix[i * n + i] += resistance.armature;
    }
    if !tree.fixed_base {
        // Own axes to world axes: R M R', rows and then columns.
        let rotation = DMat3::from_quat(configuration.root.rotation);
        for row in matrix.chunks_exact_mut(n) {
            turn(&rotation, row);
        }
        let mut column = vec![0.0; n];
        for j in 0..n {
            for i in 0..n {
                column[i] = matrix[i * n + j];
            }
            turn(&rotation, &mut column);
            for i in 3..6 {
                matrix[i * n + j] = column[i];
            }
        }
        // Rounding broke the symmetry: one half of the block that was turned twice is copied to the other.
        for i in 3..6 {
            for j in 3..i {
                matrix[i * n + j] = matrix[j * n + i];
            }
        }
    }
    matrix
}

/// Rotates a free root's three angular entries.
fn turn(rotation: &DMat3, values: &mut [f64]) {
    if let Some(angular) = values.get_mut(3..6) {
        let turned = *rotation * DVec3::new(angular[0], angular[1], angular[2]);
        angular.copy_from_slice(&turned.to_array());
    }
}

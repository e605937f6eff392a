//! Jacobian: how velocities move a point of a link.

use glamx::{DMat3, DVec3};

use super::configuration::{Configuration, Kinematics};
use super::spatial::Spatial;
use super::tree::{JointType, Tree};

/// Returns the geometric Jacobian of a point, one column for each velocity. A column is the velocity of the
/// point (`linear`) and the angular velocity of the link (`angular`) per unit of that velocity, world axes.
/// `point` is in the link's frame, metres. Columns are ordered as in [`Configuration`].
///
/// Siciliano et al., "Robotics" (2009), eq. 3.30: z x (p - o) and z for a revolute joint, z and 0 for a
/// prismatic one.
pub fn jacobian(tree: &Tree, configuration: &Configuration, link: usize, point: DVec3) -> Vec<Spatial> {
    let (q, qd) = configuration.state(tree);
    let kinematics = Kinematics::new(tree, &q, &qd);
    let at = kinematics.link(tree, link);
    let mut columns = vec![Spatial::ZERO; tree.velocity_count];
    fill(tree, &kinematics, link, at.origin + at.rotation * point, &mut columns);
    let world_from_base = configuration.base(tree).rotation;
    if tree.fixed_base {
        for column in &mut columns {
            *column = Spatial::new(world_from_base * column.angular, world_from_base * column.linear);
        }
    } else {
        in_world_axes(&DMat3::from_quat(configuration.root.rotation), &mut columns);
    }
    columns
}

/// Fills columns by the velocities of a step, in the base's axes; `point` is relative to the base's origin.
pub(super) fn fill(tree: &Tree, kinematics: &Kinematics, link: usize, point: DVec3, columns: &mut [Spatial]) {
    columns.fill(Spatial::ZERO);
    let mut next = tree.links[link].body;
    while let Some(index) = next {
        let body = &tree.bodies[index];
        let reach = point - kinematics.origins[index];
        let rotation = &kinematics.scratch[index].rotation;
        let turn = |axis: DVec3| Spatial::new(axis, axis.cross(reach));
        let column = &mut columns[body.velocity..];
        match body.joint_type {
            JointType::Revolute | JointType::Spherical { .. } => column[0] = turn(rotation.z_axis),
            JointType::Prismatic => column[0] = Spatial::new(DVec3::ZERO, rotation.z_axis),
            JointType::Free { .. } => {
                // Linear in the joint's axes at position zero, angular in the body's own.
                let above = body.parent.map_or(DMat3::IDENTITY, |parent| kinematics.scratch[parent].rotation);
                let zero = above * body.at_zero.rotation;
                for (i, axis) in [zero.x_axis, zero.y_axis, zero.z_axis].into_iter().enumerate() {
                    column[i] = Spatial::new(DVec3::ZERO, axis);
                }
                for (i, axis) in [rotation.x_axis, rotation.y_axis, rotation.z_axis].into_iter().enumerate() {
                    column[3 + i] = turn(axis);
                }
            }
        }
        next = body.parent;
    }
}

/// Converts a free root's three columns of own axes to world axes: own = R' world, so J R'.
fn in_world_axes(world_from_root: &DMat3, columns: &mut [Spatial]) {
    let Some([x, y, z]) = columns.get(3..6).and_then(|own| <[Spatial; 3]>::try_from(own).ok()) else {
        return;
    };
    let world_from_root = world_from_root.transpose();
    for (column, of_world) in
        [world_from_root.x_axis, world_from_root.y_axis, world_from_root.z_axis].into_iter().enumerate()
    {
        columns[3 + column] = x * of_world.x + y * of_world.y + z * of_world.z;
    }
}

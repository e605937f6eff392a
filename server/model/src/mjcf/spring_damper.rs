//! `springdamper`: computes stiffness and damping of a joint from a time constant, a damping ratio and the
//! joint's inertia.
//!
//! It follows MuJoCo's compiler (`mjCModel::AutoSpringDamper`, user_model.cc). The inertia is one over the
//! diagonal of the inverse of the joint-space inertia matrix, with all joints in the file's pose
//! (`dof_invweight0`). For a ball joint it is one over the mean of its three entries.
//!
//! The diagonal comes from two passes. One goes inwards for articulated-body inertias (Featherstone 2008,
//! section 7.3), the other outwards for the acceleration of each body by a force on it. This takes O(n), and
//! no matrix of all joints.

use std::collections::BTreeMap;

use glamx::{DMat3, DPose3, DVec3};

use super::body::Body;
use super::joint::{BodyJoint, Kind};
use crate::inertia;
use crate::report::Disposition::Ignored;
use crate::robot::Inertial;
use crate::translation::notes::Notes;
use crate::urdf::findings::quoted;

/// Angular above linear, world axes, about one point of the tree.
type Spatial = [f64; 6];
type Spatial2 = [Spatial; 6];

/// Inertia below which a joint moves no mass, kg or kg m^2: MuJoCo's `mjMINVAL`.
const LEAST: f64 = 1e-15;

/// A degree of freedom.
#[derive(Clone, Copy)]
struct Axis {
    /// Velocity of the body for a joint velocity of one.
    subspace: Spatial,
    armature: f64,
    /// Force for a joint acceleration of one, and its component along the joint: U and D of the
    /// articulated-body algorithm.
    force: Spatial,
    inertia: f64,
}

/// Sets stiffness and damping of all joints that have a `springdamper`.
pub(super) fn set(bodies: &mut [Body], notes: &mut Notes) {
    let asks = |body: &Body| body.joints.iter().any(|joint| joint.spring_damper.is_some());
    if !bodies.iter().any(asks) {
        return;
    }
    let inverses = inverse_inertias(bodies);
    for (body, inverses) in bodies.iter_mut().zip(inverses) {
        let mut first = 0;
        for joint in &mut body.joints {
            let count = axes_of(joint);
            let of_joint = inverses.get(first..first + count).unwrap_or_default();
            first += count;
            let Some([time_constant, ratio]) = joint.spring_damper else { continue };
            let mean = of_joint.iter().sum::<f64>() / count as f64;
            if !(mean.is_finite() && mean > 0.0) {
                let name = quoted(&joint.name);
                let message = format!("springdamper of joint {name} needs a mass that it moves: left out");
                notes.warn_at_line(Ignored, joint.at, message);
                continue;
            }
            joint.damping = 2.0 / (mean * time_constant);
            joint.spring = Some([1.0 / (mean * (time_constant * ratio).powi(2)), joint.rest]);
        }
    }
}

fn axes_of(joint: &BodyJoint) -> usize {
    if joint.kind == Kind::Ball { 3 } else { 1 }
}

/// Returns the inertia that each joint of one axis moves, by name: as for a spring, one over the diagonal of
/// the inverse. Infinite or NaN for a joint that moves no mass.
pub(super) fn joint_inertias(bodies: &[Body]) -> BTreeMap<String, f64> {
    let mut of_joints = BTreeMap::new();
    for (body, inverses) in bodies.iter().zip(inverse_inertias(bodies)) {
        let mut inverses = inverses.into_iter();
        for joint in &body.joints {
            let own: Vec<f64> = inverses.by_ref().take(axes_of(joint)).collect();
            if let [inverse] = own.as_slice() {
                of_joints.insert(joint.name.clone(), 1.0 / inverse);
            }
        }
    }
    of_joints
}

/// Returns the world pose of each body, and the reference point of its tree.
fn frames(bodies: &[Body]) -> (Vec<DPose3>, Vec<DVec3>) {
    let mut world_from_body: Vec<DPose3> = Vec::with_capacity(bodies.len());
    let mut origins: Vec<DVec3> = Vec::with_capacity(bodies.len());
    for body in bodies {
        // A parent comes before its children.
        let above = world_from_body.get(body.parent).copied().unwrap_or(DPose3::IDENTITY);
        let pose = above * body.parent_from_body;
        let origin = match origins.get(body.parent) {
            Some(origin) if body.parent > 0 => *origin,
            _ => pose.translation,
        };
        world_from_body.push(pose);
        origins.push(origin);
    }
    (world_from_body, origins)
}

/// Returns the diagonal of the inverse of the joint-space inertia matrix, by body and then by axis of its
/// joints. Infinite for an axis that moves no mass.
fn inverse_inertias(bodies: &[Body]) -> Vec<Vec<f64>> {
    let (world_from_body, origins) = frames(bodies);
    let mut axes: Vec<Vec<Axis>> = Vec::with_capacity(bodies.len());
    let mut inertias: Vec<Spatial2> = Vec::with_capacity(bodies.len());
    for ((body, pose), origin) in bodies.iter().zip(&world_from_body).zip(&origins) {
        axes.push(axes_of_body(body, pose, *origin));
        inertias.push(spatial_inertia(&body.inertial, pose, *origin));
    }
    for (index, body) in bodies.iter().enumerate().skip(1).rev() {
        let Some(mut inertia) = inertias.get(index).copied() else { continue };
        for axis in axes.get_mut(index).into_iter().flatten().rev() {
            axis.force = product(&inertia, &axis.subspace);
            axis.inertia = dot(&axis.subspace, &axis.force) + axis.armature;
            if axis.inertia > LEAST {
                add_outer(&mut inertia, &axis.force, &axis.force, -1.0 / axis.inertia);
            }
        }
        if let Some(above) = inertias.get_mut(body.parent) {
            add(above, &inertia);
        }
    }
    // Acceleration of each body by a force on it; zero for the world.
    let mut mobilities: Vec<Spatial2> = Vec::with_capacity(bodies.len());
    let mut inverses: Vec<Vec<f64>> = Vec::with_capacity(bodies.len());
    for (body, axes) in bodies.iter().zip(&axes) {
        let mut mobility = mobilities.get(body.parent).copied().unwrap_or_default();
        let mut of_body = Vec::with_capacity(axes.len());
        for axis in axes {
            of_body.push(outwards(axis, &mut mobility));
        }
        mobilities.push(mobility);
        // A free body's own axes come first, and belong to no joint.
        of_body.drain(..if body.is_free { 6 } else { 0 });
        inverses.push(of_body);
    }
    inverses
}

/// Goes from the body above an axis to the one below it. Returns the axis' acceleration for a force of one
/// along it.
fn outwards(axis: &Axis, mobility: &mut Spatial2) -> f64 {
    let Axis { subspace, force, inertia, .. } = axis;
    if *inertia <= LEAST {
        return f64::INFINITY;
    }
    // A force of one along the axis pushes the body above by -U / D.
    let above = product(mobility, force);
    let inverse = 1.0 / inertia + dot(force, &above) / (inertia * inertia);
    // L' Y L + S S' / D with L = 1 - U S' / D.
    add_outer(mobility, &above, subspace, -1.0 / inertia);
    add_outer(mobility, subspace, &above, -1.0 / inertia);
    add_outer(mobility, subspace, subspace, inverse);
    inverse
}

/// Returns the axes of a body: three translations and three rotations if it is free, then its joints'.
fn axes_of_body(body: &Body, world_from_body: &DPose3, origin: DVec3) -> Vec<Axis> {
    let axis = |subspace: Spatial, armature: f64| Axis { subspace, armature, force: [0.0; 6], inertia: 0.0 };
    let relative = |point: DVec3| world_from_body.transform_point(point) - origin;
    let mut axes = Vec::new();
    if body.is_free {
        axes.extend(DVec3::AXES.map(|along| axis(spatial(DVec3::ZERO, along), 0.0)));
        let center = relative(body.inertial.center_of_mass);
        axes.extend(DVec3::AXES.map(|about| axis(spatial(about, center.cross(about)), 0.0)));
    }
    for joint in &body.joints {
        let (anchor, armature) = (relative(joint.anchor), joint.armature);
        let turn = |about: DVec3| {
            let about = world_from_body.rotation * about;
            axis(spatial(about, anchor.cross(about)), armature)
        };
        match joint.kind {
            Kind::Hinge => axes.push(turn(joint.axis)),
            Kind::Slide => {
                let along = world_from_body.rotation * joint.axis;
                axes.push(axis(spatial(DVec3::ZERO, along), armature));
            }
            Kind::Ball => axes.extend(DVec3::AXES.map(turn)),
        }
    }
    axes
}

/// Returns the spatial inertia about the origin, world axes (Featherstone 2008, equation 2.63).
fn spatial_inertia(inertial: &Inertial, world_from_body: &DPose3, origin: DVec3) -> Spatial2 {
    let Inertial { mass, center_of_mass, inertia } = *inertial;
    let center = world_from_body.transform_point(center_of_mass) - origin;
    let cross = DMat3::from_cols(center.cross(DVec3::X), center.cross(DVec3::Y), center.cross(DVec3::Z));
    let about = inertia::rotated(inertia, world_from_body.rotation) - cross * cross * mass;
    let (about, cross) = (about.to_cols_array_2d(), (cross * mass).to_cols_array_2d());
    let mut all = [[0.0; 6]; 6];
    for (column, (about, cross)) in about.iter().zip(&cross).enumerate() {
        for (row, (about, cross)) in about.iter().zip(cross).enumerate() {
            // Tensors are symmetric, and a cross product's matrix is minus its transpose.
            if let Some(entry) = all.get_mut(row).and_then(|row| row.get_mut(column)) {
                *entry = *about;
            }
            if let Some(entry) = all.get_mut(row).and_then(|row| row.get_mut(column + 3)) {
                *entry = *cross;
            }
            if let Some(entry) = all.get_mut(row + 3).and_then(|row| row.get_mut(column)) {
                *entry = -*cross;
            }
        }
        if let Some(entry) = all.get_mut(column + 3).and_then(|row| row.get_mut(column + 3)) {
            *entry = mass;
        }
    }
    all
}

fn spatial(angular: DVec3, linear: DVec3) -> Spatial {
    [angular.x, angular.y, angular.z, linear.x, linear.y, linear.z]
}

fn dot(a: &Spatial, b: &Spatial) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn product(matrix: &Spatial2, vector: &Spatial) -> Spatial {
    matrix.map(|row| dot(&row, vector))
}

fn add(sum: &mut Spatial2, part: &Spatial2) {
    for (row, added) in sum.iter_mut().zip(part) {
        row.iter_mut().zip(added).for_each(|(sum, part)| *sum += part);
    }
}

/// Adds: `matrix += factor a b'`.
fn add_outer(matrix: &mut Spatial2, a: &Spatial, b: &Spatial, factor: f64) {
    for (row, a) in matrix.iter_mut().zip(a) {
        row.iter_mut().zip(b).for_each(|(entry, b)| *entry += factor * a * b);
    }
}

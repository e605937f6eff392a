//! J and M^-1 J': the velocities that an impulse acts on, and its effect on all velocities. One backward and
//! one forward pass over the factorised tree compute the effect.

use glamx::{DMat3, DVec3};

use super::side::Side;
use crate::dynamics::articulated::{along, free_velocities, part_mut, write_free};
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::scratch::{BodyScratch, Scratch};
use crate::dynamics::spatial::Spatial;
use crate::dynamics::spatials::{Spatials, turned};
use crate::dynamics::tree::{Body, JointType, SingleBody, Tree};

/// Writes the change of all velocities by impulses of these sizes at the joints of these bodies. O(n); needs
/// IA, U and D of this step (another pass of the articulated-body algorithm, without velocities and gravity).
pub fn respond(tree: &Tree, q: &[f64], joints: &[(usize, f64)], scratch: &mut Scratch, out: &mut [f64]) {
    clear(scratch);
    for &(body, size) in joints {
        scratch.bodies[body].impulse += size;
    }
    // Children come after their parents.
    let highest = joints.iter().map(|joint| joint.0).max().unwrap_or(0);
    (0..=highest).rev().for_each(|body| {
        backward_step(tree, body, scratch);
    });
    forward_pass(tree, q, scratch, out);
}

/// Writes the change of all velocities by an impulse on a body: `force` about its origin, in the base's axes.
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
        next = backward_step(tree, body, scratch);
    }
    forward_pass(tree, q, scratch, out);
}

/// Writes J' f, the effect of an impulse on each velocity's own momentum. `force` is about the body's origin,
/// in the base's axes; power is then J qd. Writes all velocities.
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
                // The map from motion to velocities is only a rotation, so it converts forces as well.
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

/// Adds [`project`] of three impulses to a side's J.
#[inline(always)]
pub fn project_onto(
    tree: &Tree,
    q: &[f64],
    scratch: &[BodyScratch],
    (body, forces): (usize, &Spatials<4>),
    side: &Side,
    jacobian: &mut [f64],
) {
    let (mut forces, mut i) = (*forces, body);
    loop {
        let (body, at) = (&tree.bodies[i], &scratch[i]);
        let columns = side.columns_from(body.velocity);
        match body.joint_type {
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                let entries = forces.along(body.joint_type, at.rotation.z_axis);
                columns.add(0, &entries, jacobian);
            }
            JointType::Free { .. } => {
                // See `project`.
                let own_from_base = at.rotation.transpose();
                let parent_from_base = DMat3::from_quat(free_pose(&q[body.position..]).1) * own_from_base;
                let linear = turned(&forces.linear, &parent_from_base);
                let angular = turned(&forces.angular, &own_from_base);
                for i in 0..3 {
                    columns.add(i, &linear[i], jacobian);
                    columns.add(3 + i, &angular[i], jacobian);
                }
            }
        }
        let Some(parent) = body.parent else { break };
        forces = forces.force_from(at.reach);
        i = parent;
    }
}

/// Pose and inertia of a robot that is one free body: all that J and M^-1 J' of its contacts depend on. Each
/// body has several contacts, and the robot's other data are scattered in memory.
#[derive(Clone, Copy, Debug)]
pub struct PlacedBody {
    /// Inertia of the body.
    pub body: SingleBody,
    /// `world_from_body`.
    rotation: DMat3,
    origin: DVec3,
}

impl PlacedBody {
    /// Returns `None` if the robot is not a single free body.
    pub fn new(tree: &Tree, scratch: &Scratch) -> Option<Self> {
        let ([at], [factors], Some(body)) = (&scratch.bodies[..], &scratch.free[..], &tree.single) else {
            return None;
        };
        factors.is_regular().then_some(Self { body: *body, rotation: at.rotation, origin: at.origin })
    }
}

/// Rotation of a free body and its centre of rotation, world.
#[derive(Clone, Copy, Debug, Default)]
pub struct Turning {
    angular: DVec3,
    origin: DVec3,
}

impl Turning {
    /// Returns the acceleration of a point of the body with constant velocities.
    pub fn arc(&self, point: DVec3) -> DVec3 {
        self.angular.cross(self.angular.cross(point - self.origin))
    }
}

impl PlacedBody {
    /// Returns its rotation with these velocities, whose angular part, in its own axes, begins at 3.
    pub fn turning(&self, velocities: &[f64]) -> Turning {
        let [_, _, _, x, y, z] = velocities else { return Turning::default() };
        Turning { angular: self.rotation * DVec3::new(*x, *y, *z), origin: self.origin }
    }
}

/// Writes J and M^-1 J' of unit impulses along three axes at a point of a free body, world, in the layout of
/// a [`Side`]. The results equal those of [`project`] and [`respond_to_force`], without passes over the tree.
/// Returns false if there is no room for them.
///
/// Always inlined, to be compiled for the vectors of the processor.
#[inline(always)]
pub fn single_body_rows(at: &PlacedBody, (point, axes): (DVec3, [DVec3; 3]), numbers: &mut [f64]) -> bool {
    let Some((jacobian, responses)) = numbers.split_first_chunk_mut::<18>() else { return false };
    let Some(responses) = responses.first_chunk_mut::<18>() else { return false };
    let SingleBody { inverse_mass, center, inverse_moment } = at.body;
    let own_from_world = at.rotation.transpose();
    let own_arm = own_from_world * (point - at.origin);
    // About the centre of mass, linear and angular motion are independent.
    let lever = own_arm - center;
    for (k, axis) in axes.into_iter().enumerate() {
        let own_axis = own_from_world * axis;
        let moment = own_arm.cross(own_axis);
        for i in 0..3 {
            jacobian[6 * (i / 2) + 2 * k + i % 2] = axis[i];
            jacobian[6 * ((i + 3) / 2) + 2 * k + (i + 3) % 2] = moment[i];
        }
        let turn = inverse_moment * lever.cross(own_axis);
        let mut shift = axis * inverse_mass;
        if center != DVec3::ZERO {
            shift -= at.rotation * turn.cross(center);
        }
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

/// Transfers the impulse on a body to its parent. Returns the parent if there is an impulse and a parent that
/// it moves. `delta` holds p until the forward pass.
fn backward_step(tree: &Tree, body: usize, scratch: &mut Scratch) -> Option<usize> {
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

/// Runs from the root to the leaves, through every branch.
fn forward_pass(tree: &Tree, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
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

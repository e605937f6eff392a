//! First pass, root to leaves: poses and velocities of bodies.

use glamx::{DMat3, DPose3, DQuat, DVec3};

use super::scratch::BodyScratch;
use super::spatial::{Placement, Spatial};
use super::spherical::{orientation, velocity_product};
use super::tree::{Body, JointType, LinkFrame, NEXT_AXIS, Tree};
use super::trigonometry::sin_cos;

/// Pose and velocity of a body, world axes.
#[derive(Clone, Copy, Debug)]
pub struct BodyMotion {
    /// `world_from_body`.
    pub pose: DPose3,
    /// Velocity of the body's origin, m/s.
    pub linear: DVec3,
    /// Angular velocity, rad/s.
    pub angular: DVec3,
}

/// Computes poses and velocities of all bodies (Featherstone table 7.1, first loop), in the base's axes.
///
/// v_i = X v_parent + S qd,  c_i = v_i x S qd
pub fn update_kinematics(tree: &Tree, positions: &[f64], velocities: &[f64], scratch: &mut [BodyScratch]) {
    for (i, body) in tree.bodies.iter().enumerate() {
        let (base_from_parent, parent_origin, parent_velocity) = match body.parent {
            Some(parent) => (scratch[parent].rotation, scratch[parent].origin, scratch[parent].velocity),
            None => (DMat3::IDENTITY, DVec3::ZERO, Spatial::ZERO),
        };
        let at = &mut scratch[i];
        // Frame of the joint at position zero.
        let zero = base_from_parent * body.at_zero.rotation;
        let reach = base_from_parent * body.at_zero.origin;
        let (q, qd) = (&positions[body.position..], &velocities[body.velocity..]);
        let own = match body.joint_type {
            JointType::Revolute => {
                at.rotation = turned_about_z(&zero, q[0]);
                at.reach = reach;
                Spatial::new(zero.z_axis * qd[0], DVec3::ZERO)
            }
            JointType::Prismatic => {
                at.rotation = zero;
                at.reach = reach + zero.z_axis * q[0];
                Spatial::new(DVec3::ZERO, zero.z_axis * qd[0])
            }
            JointType::Spherical { axis } => {
                let frame = Placement { rotation: zero, origin: reach };
                let parent = (parent_origin, parent_velocity);
                update_ball_axis(axis, frame, parent, q, &velocities[..body.velocity + 1], at);
                continue;
            }
            JointType::Free { .. } => {
                let (origin, rotation) = free_pose(q);
                at.rotation = zero * DMat3::from_quat(rotation);
                at.reach = reach + zero * origin;
                // Linear in the parent's axes, angular in the body's own.
                let (linear, angular) = (DVec3::new(qd[0], qd[1], qd[2]), DVec3::new(qd[3], qd[4], qd[5]));
                Spatial::new(at.rotation * angular, zero * linear)
            }
        };
        at.origin = parent_origin + at.reach;
        at.velocity = parent_velocity.motion_at(at.reach) + own;
        // S moves with the body: its derivative in fixed axes is v x S.
        at.velocity_product = at.velocity.cross_motion(own);
    }
}

/// Computes one of the three bodies of a ball joint. `frame` is the joint's at position zero, or the previous
/// body's; `velocities` end with the body's own.
#[inline(never)]
fn update_ball_axis(
    axis: u8,
    frame: Placement,
    (parent_origin, parent_velocity): (DVec3, Spatial),
    q: &[f64],
    velocities: &[f64],
    at: &mut BodyScratch,
) {
    at.rotation = if axis == 0 { turned_to_first_axis(&frame.rotation, q) } else { frame.rotation };
    at.reach = frame.origin;
    at.origin = parent_origin + at.reach;
    let velocity = velocities.last().copied().unwrap_or_default();
    let own = Spatial::new(at.rotation.z_axis * velocity, DVec3::ZERO);
    at.velocity = parent_velocity.motion_at(at.reach) + own;
    // All three axes turn with the child: the last one has the whole velocity product.
    at.velocity_product = match velocities.last_chunk::<3>() {
        Some(all) if axis == 2 => velocity_product(&at.rotation, all, at.velocity),
        _ => Spatial::ZERO,
    };
}

/// Returns the frame of the first body of a ball joint, whose z is the child's x.
fn turned_to_first_axis(zero: &DMat3, q: &[f64]) -> DMat3 {
    *zero * DMat3::from_quat(orientation(q)) * NEXT_AXIS
}

/// Returns a frame after a turn about its own z.
#[inline]
fn turned_about_z(frame: &DMat3, angle: f64) -> DMat3 {
    let (sin, cos) = sin_cos(angle);
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *frame;
    DMat3::from_cols(x * cos + y * sin, y * cos - x * sin, z)
}

/// Returns `parent_from_body` at a position.
pub fn placement(body: &Body, q: &[f64]) -> Placement {
    joint_placement(body, &q[body.position..])
}

/// Returns `parent_from_body` for the body's own positions, which come first.
pub fn joint_placement(body: &Body, q: &[f64]) -> Placement {
    let zero = &body.at_zero;
    match body.joint_type {
        JointType::Revolute => {
            Placement { rotation: turned_about_z(&zero.rotation, q[0]), origin: zero.origin }
        }
        JointType::Prismatic => {
            Placement { rotation: zero.rotation, origin: zero.origin + zero.rotation.z_axis * q[0] }
        }
        JointType::Spherical { axis: 0 } => {
            Placement { rotation: turned_to_first_axis(&zero.rotation, q), origin: zero.origin }
        }
        JointType::Spherical { .. } => *zero,
        JointType::Free { .. } => {
            let (origin, rotation) = free_pose(q);
            zero.then(&Placement::new(rotation, origin))
        }
    }
}

/// Returns the seven positions of a free body, as a pose.
pub fn free_pose(q: &[f64]) -> (DVec3, DQuat) {
    (DVec3::new(q[0], q[1], q[2]), DQuat::from_xyzw(q[3], q[4], q[5], q[6]))
}

impl Tree {
    /// Sets the positions of mimic joints and of tendons. Chains are at most as long as the number of pairs.
    pub fn apply_mimics(&self, q: &mut [f64]) {
        for _ in 0..self.mimics.len() {
            for pair in &self.mimics {
                let leader = q[self.bodies[pair.leader].position];
                q[self.bodies[pair.follower].position] = pair.multiplier * leader + pair.offset;
            }
        }
        self.apply_tendons(q);
    }

    /// Returns `world_from_link` of each link of the model.
    ///
    /// `world_from_root` is the pose of the root link; `positions` exclude a free root's.
    pub fn link_poses(&self, world_from_root: DPose3, positions: &[f64]) -> Vec<DPose3> {
        let bodies = self.body_poses(world_from_root, positions);
        let pose = |link: &LinkFrame| {
            let body = link.body.map_or(world_from_root, |body| bodies[body]);
            body * link.body_from_link
        };
        self.links.iter().map(pose).collect()
    }

    /// Like [`Tree::link_poses`] for one link, to the bit, but computes only the bodies between it and the
    /// root. `q` are all positions; a free root's are ignored.
    pub fn link_pose(&self, world_from_root: DPose3, q: &[f64], link: usize) -> DPose3 {
        let LinkFrame { body, body_from_link } = self.links[link];
        if body.is_none() {
            return world_from_root * body_from_link;
        }
        let (mut chain, mut next) = (Vec::new(), body);
        while let Some(index) = next {
            chain.push(index);
            next = self.bodies[index].parent;
        }
        let has_free_root = self.root_positions() > 0;
        let mut at = Placement::new(world_from_root.rotation, world_from_root.translation);
        for index in chain.into_iter().rev().filter(|index| *index > 0 || !has_free_root) {
            at = at.then(&placement(&self.bodies[index], q));
        }
        DPose3::from_parts(at.origin, DQuat::from_mat3(&at.rotation).normalize()) * body_from_link
    }

    /// Returns the rotation of [`Tree::link_pose`], except for rounding. It allocates nothing, so a step can
    /// use it.
    pub fn link_rotation(&self, world_from_root: DQuat, q: &[f64], link: usize) -> DQuat {
        let LinkFrame { body, body_from_link } = self.links[link];
        let has_free_root = self.root_positions() > 0;
        let is_jointed = |index: &usize| *index > 0 || !has_free_root;
        let mut root_from_link = DMat3::from_quat(body_from_link.rotation);
        let mut next = body.filter(is_jointed);
        while let Some(index) = next {
            let body = &self.bodies[index];
            root_from_link = placement(body, q).rotation * root_from_link;
            next = body.parent.filter(is_jointed);
        }
        world_from_root * DQuat::from_mat3(&root_from_link).normalize()
    }

    /// Returns `world_from_body` of each moving body; takes the arguments of [`Tree::link_poses`].
    pub fn body_poses(&self, world_from_root: DPose3, positions: &[f64]) -> Vec<DPose3> {
        let root = self.root_positions();
        let mut q = vec![0.0; root];
        q.extend_from_slice(positions);
        q.resize(self.position_count, 0.0);
        let world_from_root = Placement::new(world_from_root.rotation, world_from_root.translation);
        let mut bodies: Vec<Placement> = Vec::with_capacity(self.bodies.len());
        for (i, body) in self.bodies.iter().enumerate() {
            bodies.push(match body.parent {
                None if i == 0 && root > 0 => world_from_root,
                None => world_from_root.then(&placement(body, &q)),
                Some(parent) => bodies[parent].then(&placement(body, &q)),
            });
        }
        let pose =
            |body: &Placement| DPose3::from_parts(body.origin, DQuat::from_mat3(&body.rotation).normalize());
        bodies.iter().map(pose).collect()
    }
}

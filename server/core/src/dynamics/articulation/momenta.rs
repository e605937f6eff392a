//! Energy and momenta of a robot as it continues to move.

use glamx::{DMat3, DVec3};

use super::{Articulation, StepScratch};
use crate::dynamics::inertia::Rigid;
use crate::dynamics::integrate::advance;
use crate::dynamics::kinematics::update_kinematics;
use crate::dynamics::scratch::BodyScratch;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::JointType;

/// Momenta of bodies about one point, world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::dynamics) struct Momenta {
    /// Inertia of all bodies as if they were one.
    pub(in crate::dynamics) inertia: Rigid,
    /// Angular and linear momentum, kg m^2/s and kg m/s.
    pub(in crate::dynamics) momentum: Spatial,
    /// Kinetic energy, J.
    pub(in crate::dynamics) energy: f64,
}

impl Articulation {
    /// Returns whether its root moves freely.
    pub(in crate::dynamics) fn has_free_root(&self) -> bool {
        let root = self.tree.bodies.first();
        !self.tree.fixed_base && root.is_some_and(|root| matches!(root.joint_type, JointType::Free { .. }))
    }

    /// Adds its momenta about a point after the new velocities have moved it for `h` seconds.
    pub(in crate::dynamics) fn add_momenta_ahead(&mut self, point: DVec3, h: f64, sum: &mut Momenta) {
        let Self { tree, state, scratch } = self;
        let StepScratch { new_velocities, bodies_ahead, ahead, .. } = scratch;
        ahead.clear();
        ahead.extend_from_slice(&state.positions);
        advance(tree, ahead, new_velocities, h);
        bodies_ahead.resize(tree.bodies.len(), BodyScratch::default());
        update_kinematics(tree, ahead, new_velocities, bodies_ahead);
        self.add_bodies(point, sum);
    }

    /// Adds its momenta about a point at its present pose, with the new velocities.
    pub(in crate::dynamics) fn add_momenta(&mut self, point: DVec3, sum: &mut Momenta) {
        let Self { tree, state, scratch } = self;
        let StepScratch { new_velocities, bodies_ahead, .. } = scratch;
        bodies_ahead.resize(tree.bodies.len(), BodyScratch::default());
        update_kinematics(tree, &state.positions, new_velocities, bodies_ahead);
        self.add_bodies(point, sum);
    }

    fn add_bodies(&self, point: DVec3, sum: &mut Momenta) {
        let (base, turn) = (&self.state.base, DMat3::from_quat(self.state.base.rotation));
        for (body, at) in self.tree.bodies.iter().zip(&self.scratch.bodies_ahead) {
            let inertia = body.inertia.turned(&(turn * at.rotation));
            let velocity = Spatial::new(turn * at.velocity.angular, turn * at.velocity.linear);
            let reach = base.transform_point(at.origin) - point;
            let momentum = inertia.times(velocity);
            sum.inertia += inertia.shifted(reach);
            sum.momentum += momentum.force_from(reach);
            sum.energy += 0.5 * momentum.dot(velocity);
        }
    }

    /// Scales the new velocities.
    pub(in crate::dynamics) fn scale_motion(&mut self, part: f64) {
        self.scratch.new_velocities.iter_mut().for_each(|velocity| *velocity *= part);
    }

    /// Adds a rigid motion, given about a point, world axes, to the velocities after a step, at the pose of
    /// the last [`add_momenta`](Self::add_momenta).
    pub(in crate::dynamics) fn add_motion(&mut self, point: DVec3, motion: Spatial) {
        let base = &self.state.base;
        let (Some(root), Some(at)) = (self.tree.bodies.first(), self.scratch.bodies_ahead.first()) else {
            return;
        };
        let turn = DMat3::from_quat(base.rotation);
        let own = motion.motion_at(base.transform_point(at.origin) - point);
        // Linear in the parent's axes, angular in the body's own.
        let linear = ((turn * root.at_zero.rotation).transpose() * own.linear).to_array();
        let angular = ((turn * at.rotation).transpose() * own.angular).to_array();
        for velocities in [&mut self.state.half_velocities, &mut self.state.velocities] {
            for (velocity, more) in velocities.iter_mut().zip(linear.into_iter().chain(angular)) {
                *velocity += more;
            }
        }
    }
}

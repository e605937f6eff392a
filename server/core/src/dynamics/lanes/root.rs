//! Free root in lanes: its pose, and the effects of forces and impulses on its velocities.
//!
//! It is the first body of its tree, and as such among the bodies of [`LaneRobot`]. Its joint has six
//! velocities, which are here.

use glamx::{DPose3, DQuat, DVec3};
use pulp::Simd;

use super::free::{Root, get, parts, set};
use super::robot::LaneRobot;
use crate::dynamics::integrate::advance_joint;
use crate::dynamics::integrator::Integrator;
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::lane::vectors::{Spatial, Vector};
use crate::dynamics::real::{MaskOf as _, MatrixOf as _, Real as _, VectorOf as _};
use crate::dynamics::tree::JointType;

impl<S: Simd> LaneRobot<S> {
    /// Returns the pose of a copy's free root, `world_from_root`, and its linear and angular velocity, world
    /// axes. `None` for a fixed one.
    pub fn root(&self, lane: usize) -> Option<(DPose3, DVec3, DVec3)> {
        if self.first == 0 {
            return None;
        }
        let (mut q, mut qd) = ([0.0; 7], [0.0; 6]);
        get(&self.root.positions, lane, &mut q);
        get(&self.root.velocities, lane, &mut qd);
        let pose = DPose3::from_parts(DVec3::new(q[0], q[1], q[2]), DQuat::from_xyzw(q[3], q[4], q[5], q[6]));
        let angular = pose.rotation * DVec3::new(qd[3], qd[4], qd[5]);
        Some((pose, DVec3::new(qd[0], qd[1], qd[2]), angular))
    }

    /// Computes the pose and the velocity of the root.
    #[inline(always)]
    pub(super) fn update_root_pose(&mut self) {
        let (rotation, origin) = self.at_zero(0);
        let frame = self.base().after(rotation);
        let reach = self.base().times(origin);
        let [x, y, z, ..] = self.root.positions;
        let (linear, angular) = parts(&self.root.velocities);
        let still = Vector { x: x.splat(0.0), y: x.splat(0.0), z: x.splat(0.0) };
        let at = &mut self.bodies[0];
        at.rotation = frame.after(self.root.rotation().matrix());
        at.reach = reach + frame.times(Vector { x, y, z });
        let own = Spatial { angular: at.rotation.times(angular), linear: frame.times(linear) };
        at.velocity = Spatial { angular: still, linear: still }.motion_at(at.reach) + own;
        at.velocity_product = at.velocity.cross_motion(own);
    }

    /// Computes the root's acceleration, and the new velocities of some lanes. `base` is the base's
    /// acceleration.
    #[inline(always)]
    pub(super) fn accelerate_root(&mut self, base: Spatial<S>, going: Mask<S>) {
        let h = self.occupied.splat(self.stepping.h);
        let at = &mut self.bodies[0];
        let carried = base.motion_at(at.reach) + at.velocity_product;
        at.acceleration = self.factors.solve(-at.bias);
        let own = at.acceleration - carried;
        let (linear_change, angular_change) = self.root_velocities(own);
        let (linear, angular) = parts(&self.root.velocities);
        // As in the one-robot step: the linear velocity is in axes that do not turn with the body.
        let linear_change = linear_change + self.root.rotation().times(angular).cross(linear);
        let (linear, angular) = parts(&self.root.half_velocities);
        let (linear, angular) = (linear + linear_change * h, angular + angular_change * h);
        let new = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
        for (slot, new) in self.root_new.iter_mut().zip(new) {
            *slot = going.select(new, *slot);
        }
    }

    /// Returns the change of the root's velocities by a force on it, about its origin, and stores the body's
    /// motion.
    #[inline(always)]
    pub(super) fn push_root(&mut self, force: Spatial<S>) -> [Lanes<S>; 6] {
        let delta = self.factors.solve(force);
        self.bodies[0].delta = delta;
        // By matrices, as in `constraint/multi_rhs.rs`: another order would give other bits.
        let own_from_base = self.bodies[0].rotation.transposed();
        let linear = self.root.rotation().matrix().after(own_from_base).times(delta.linear);
        let angular = own_from_base.times(delta.angular);
        [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
    }

    /// Returns a motion of the root in the base's axes as velocities: linear in the base's axes, angular in
    /// its own.
    #[inline(always)]
    pub(super) fn root_velocities(&self, motion: Spatial<S>) -> (Vector<S>, Vector<S>) {
        let own_from_base = self.bodies[0].rotation.transposed();
        let linear = self.root.rotation().times(own_from_base.times(motion.linear));
        (linear, own_from_base.times(motion.angular))
    }

    /// Integrates the root with its new velocities. The masks are the lanes whose last step and this one are
    /// smooth, and those in which the one before is smooth too.
    #[inline(always)]
    pub(super) fn finish_root(&mut self, discontinuous: Mask<S>, is_smooth: Mask<S>, is_twice: Mask<S>) {
        let zero = self.occupied.splat(0.0);
        let (h, half) = (zero.splat(self.stepping.h), zero.splat(0.5));
        let is_leapfrog = self.stepping.integrator == Integrator::Leapfrog;
        self.clearance.around -= h * Root::speed_of(&self.root_way, self.levers[0]);
        let root = &mut self.root;
        for k in 0..6 {
            let new = self.root_new[k];
            root.changes_before[k] = root.changes[k];
            root.changes[k] = new - root.half_velocities[k];
            root.half_velocities[k] = new;
            // Without springs and dampers, the reported velocity follows `Implicitness::MEAN`.
            let drift = is_twice.select(root.changes[k] - root.changes_before[k], zero);
            let ahead = half * (root.changes[k] + half * drift);
            let end = new + (is_smooth | is_twice).select(ahead, zero);
            root.velocities[k] = if is_leapfrog { discontinuous.select(new, end) } else { new };
        }
        // Rotations take sines and a square root, by the function of the one-robot step: another one would
        // give other bits.
        let joint_type = JointType::Free { slot: 0 };
        for lane in (0..S::F64_LANES).filter(|lane| self.occupied.get(*lane) == 1.0) {
            let (mut q, mut qd) = ([0.0; 7], [0.0; 6]);
            get(&root.positions, lane, &mut q);
            get(&self.root_way, lane, &mut qd);
            advance_joint(joint_type, &mut q, &qd, self.stepping.h);
            set(&mut root.positions, lane, &q);
        }
    }
}

//! Passes through the tree, as [`kinematics`](crate::dynamics::kinematics) and
//! [`articulated`](crate::dynamics::articulated) do them for one copy.

use glamx::DMat3;
use pulp::Simd;

use super::joint::Body;
use super::robot::LaneRobot;
use crate::dynamics::articulated::{SINGULAR, along, part_mut};
use crate::dynamics::lane::number::Mask;
use crate::dynamics::lane::vectors::{Articulated, Matrix, Spatial, Vector};
use crate::dynamics::ldlt::Ldlt6;
use crate::dynamics::real::{MaskOf as _, MatrixOf as _, Real as _, VectorOf as _};
use crate::dynamics::spatial::Placement;
use crate::dynamics::tree::JointType;
use crate::dynamics::velocity_terms::FAST;

impl<S: Simd> LaneRobot<S> {
    /// Returns the frame of a body at position zero, in its parent.
    #[inline(always)]
    pub(super) fn at_zero(&self, body: usize) -> (Matrix<S>, Vector<S>) {
        let Placement { rotation, origin } = &self.tree.bodies[body].at_zero;
        (Matrix::broadcast(self.simd, rotation), Vector::broadcast(self.simd, *origin))
    }

    /// Returns the axes of the base.
    #[inline(always)]
    pub(super) fn base(&self) -> Matrix<S> {
        Matrix::broadcast(self.simd, &DMat3::IDENTITY)
    }

    /// Computes poses and velocities of all bodies. Returns the lanes in which one turns too fast for lanes.
    #[inline(always)]
    pub(super) fn update_kinematics(&mut self) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let most = FAST / self.stepping.h;
        let most = zero.splat(most * most);
        let mut is_fast = zero.lt(zero);
        let still = Vector::zero(zero);
        if self.first > 0 {
            self.update_root_pose();
            let angular = self.bodies[0].velocity.angular;
            is_fast = most.lt(angular.dot(angular));
        }
        for i in self.first..self.bodies.len() {
            let (joint_type, parent) = (self.tree.bodies[i].joint_type, self.tree.bodies[i].parent);
            let (above_rotation, above) = match parent {
                Some(parent) => (self.bodies[parent].rotation, self.bodies[parent].velocity),
                None => (self.base(), Spatial { angular: still, linear: still }),
            };
            let (rotation, origin) = self.at_zero(i);
            let frame = above_rotation.after(rotation);
            let reach = above_rotation.times(origin);
            let (q, qd) = (self.states[i].position, self.states[i].velocity);
            let at = &mut self.bodies[i];
            if joint_type == JointType::Prismatic {
                at.rotation = frame;
                at.reach = reach + frame.z * q;
                let own = frame.z * qd;
                at.velocity = above.motion_at(at.reach);
                at.velocity.linear = at.velocity.linear + own;
                at.velocity_product = Spatial { angular: still, linear: at.velocity.angular.cross(own) };
            } else {
                let (sin, cos) = q.sin_cos();
                at.rotation =
                    Matrix { x: frame.x * cos + frame.y * sin, y: frame.y * cos - frame.x * sin, z: frame.z };
                at.reach = reach;
                let own = frame.z * qd;
                at.velocity = above.motion_at(at.reach);
                at.velocity.angular = at.velocity.angular + own;
                at.velocity_product = Spatial {
                    angular: at.velocity.angular.cross(own),
                    linear: at.velocity.linear.cross(own),
                };
            }
            let angular = at.velocity.angular;
            is_fast = is_fast | most.lt(angular.dot(angular));
        }
        is_fast
    }

    /// Second pass, leaves to root.
    #[inline(always)]
    pub(super) fn gather_inertia(&mut self) {
        let n = self.bodies.len();
        for at in &mut self.bodies {
            let inertia = at.inertia.turned(&at.rotation);
            at.articulated = Articulated::of(&inertia);
            at.bias = at.velocity.cross_force(inertia.times(at.velocity));
        }
        for i in (self.first..n).rev() {
            let (joint_type, parent) = (self.tree.bodies[i].joint_type, self.tree.bodies[i].parent);
            self.factorise(i, joint_type);
            let Some(parent) = parent else { continue };
            let Body { articulated, bias, velocity_product, column, inverse_d, drive, reach, .. } =
                &self.bodies[i];
            let left = articulated.without(*column, *inverse_d);
            let bias = *bias + left.times(*velocity_product) + *column * (*inverse_d * *drive);
            let (left, bias) = (left.shifted(*reach), bias.force_from(*reach));
            let above = &mut self.bodies[parent];
            above.articulated += left;
            above.bias += bias;
        }
        if self.first > 0 {
            self.factors = Ldlt6::new(&self.bodies[0].articulated);
        }
    }

    /// Computes U, D and u of a body.
    #[inline(always)]
    fn factorise(&mut self, i: usize, joint_type: JointType) {
        let (law, state) = (&self.laws[i], &self.states[i]);
        let (drive, q, half) = (&state.drive, state.position, state.half_velocity);
        let zero = q.splat(0.0);
        let h = zero.splat(self.stepping.h);
        let at = &mut self.bodies[i];
        let z = at.rotation.z;
        let (column, largest) = if joint_type == JointType::Prismatic {
            (at.articulated.times_slide(z), at.articulated.mass.largest())
        } else {
            (at.articulated.times_turn(z), at.articulated.moment.largest())
        };
        let own = along(joint_type, column, z);
        let is_saturated = drive.saturated.is_number();
        let resistance;
        (at.implicitness, at.of_law, resistance) =
            drive.resist(is_saturated, own, &law.own, (self.stepping.integrator, h));
        let steady = drive.steady_law(q, half, h, at.implicitness);
        let effort =
            is_saturated.select(drive.saturated, steady) + law.own.steady_effort(q, half, h, at.implicitness);
        at.column = column;
        let (first, second) = resistance;
        at.inverse_d = (largest * zero.splat(SINGULAR) * second).lt(first).select(second / first, zero);
        at.drive = effort - along(joint_type, at.bias, z);
    }

    /// Third pass, root to leaves: computes the new velocities of some lanes.
    #[inline(always)]
    pub(super) fn accelerate(&mut self, going: Mask<S>) {
        let zero = self.occupied.splat(0.0);
        let h = zero.splat(self.stepping.h);
        let still = Vector::zero(zero);
        let base = Spatial { angular: still, linear: self.base_acceleration };
        if self.first > 0 {
            self.accelerate_root(base, going);
        }
        for i in self.first..self.bodies.len() {
            let (joint_type, parent) = (self.tree.bodies[i].joint_type, self.tree.bodies[i].parent);
            let above = parent.map_or(base, |parent| self.bodies[parent].acceleration);
            let half = self.states[i].half_velocity;
            let at = &mut self.bodies[i];
            let carried = above.motion_at(at.reach) + at.velocity_product;
            let qdd = at.inverse_d * (at.drive - at.column.dot(carried));
            at.acceleration = carried;
            let part = part_mut(joint_type, &mut at.acceleration);
            *part = *part + at.rotation.z * qdd;
            at.new_velocity = going.select(half + h * qdd, at.new_velocity);
        }
    }

    /// Writes the effect of a unit impulse at a joint on all velocities, by one backward and one forward pass
    /// over the tree.
    #[inline(always)]
    pub(super) fn respond(&mut self, joint: usize) {
        let zero = self.occupied.splat(0.0);
        let still = Vector::zero(zero);
        let none = Spatial { angular: still, linear: still };
        let (first, n) = (self.first, self.bodies.len());
        self.bodies.iter_mut().for_each(|at| at.impulse = zero);
        let (mut next, mut p, mut given) = (Some(joint), none, zero.splat(1.0));
        while let Some(i) = next.filter(|i| *i >= first) {
            let (joint_type, parent) = (self.tree.bodies[i].joint_type, self.tree.bodies[i].parent);
            let at = &mut self.bodies[i];
            at.impulse = given - along(joint_type, p, at.rotation.z);
            p = (p + at.column * (at.inverse_d * at.impulse)).force_from(at.reach);
            (next, given) = (parent, zero);
        }
        if first > 0 {
            self.root_responses[joint] = self.push_root(-p);
        }
        for i in first..n {
            let (joint_type, parent) = (self.tree.bodies[i].joint_type, self.tree.bodies[i].parent);
            let above = parent.map_or(none, |parent| self.bodies[parent].delta);
            let at = &mut self.bodies[i];
            let carried = above.motion_at(at.reach);
            let change = at.inverse_d * (at.impulse - at.column.dot(carried));
            at.delta = carried;
            let part = part_mut(joint_type, &mut at.delta);
            *part = *part + at.rotation.z * change;
            self.responses[joint * n + i] = change;
        }
    }
}

//! Rows of a foot in lanes: J, M^-1 J' and targets, as [`ContactRows`] has them for one copy.
//!
//! In a lane without a contact everything is zero, and the rows act on nothing.
//!
//! [`ContactRows`]: crate::dynamics::constraint::contact::ContactRows

use glamx::{DMat3, DQuat};
use pulp::Simd;

use super::foot_points::{FootContact, choose};
use super::foot_solver::FootSolver;
use super::robot::LaneRobot;
use crate::dynamics::arcs::{carried, of_point, straight};
use crate::dynamics::articulated::{along, part_mut};
use crate::dynamics::constraint::contact_law::{self, inverse_of_tangents};
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::lane::vectors::{Matrix, Spatial, Vector};
use crate::dynamics::real::{MaskOf as _, MatrixOf as _, Real as _, VectorOf as _};

/// A foot of all copies.
#[derive(Clone, Debug)]
pub(super) struct Foot<S: Simd> {
    /// Velocities for which J has columns, and whether each is added to the second of two sums.
    pub(super) columns: Vec<(usize, bool)>,
    /// 1 where it touches or is about to.
    pub(super) is_there: Lanes<S>,
    /// Vector from the body's origin to the point, base axes, metres.
    arm: Vector<S>,
    /// See [`arc`](crate::dynamics::arcs::arc), base's axes.
    arc: Vector<S>,
    /// Directions in which its rows act on the body, base axes.
    directions: [Vector<S>; 3],
    /// Normal and tangents, world.
    axes: [Vector<S>; 3],
    distance: Lanes<S>,
    /// Coulomb's coefficient.
    pub(super) friction: Lanes<S>,
    /// J, by column.
    pub(super) jacobian: Vec<[Lanes<S>; 3]>,
    /// M^-1 J', by velocity.
    pub(super) responses: Vec<[Lanes<S>; 3]>,
    /// See [`ContactRows`](crate::dynamics::constraint::contact::ContactRows).
    pub(super) effect: [Lanes<S>; 6],
    pub(super) inverse: [Lanes<S>; 3],
    pub(super) gradient_step: Lanes<S>,
    pub(super) unloaded: [Lanes<S>; 3],
    pub(super) target: Lanes<S>,
    pub(super) drift: [Lanes<S>; 2],
    pub(super) correction_velocity: Lanes<S>,
    pub(super) split_impulse: Lanes<S>,
    pub(super) impulse: [Lanes<S>; 3],
    /// Impulse to restore.
    pub(super) kept_impulse: [Lanes<S>; 3],
    /// Lanes in which it can move anything.
    pub(super) acts: Mask<S>,
    pub(super) newton: FootNewton<S>,
}

/// State of Newton's method for a foot.
#[derive(Clone, Debug)]
pub(super) struct FootNewton<S: Simd> {
    /// Whether it presses, and slips or sticks, so that it is not open.
    pub(super) presses: Mask<S>,
    pub(super) sticks: Mask<S>,
    /// Whether it slipped in the last round.
    pub(super) slipped: Mask<S>,
    pub(super) bound: Lanes<S>,
    pub(super) bound_residual: Lanes<S>,
    pub(super) speeds: [Lanes<S>; 3],
    pub(super) ways: [Lanes<S>; 3],
    pub(super) used: [Lanes<S>; 3],
    pub(super) weights: [Lanes<S>; 4],
    pub(super) residuals: [Lanes<S>; 3],
}

impl<S: Simd> Foot<S> {
    /// Creates a foot without contact, of a robot with this number of velocities.
    pub(super) fn new(zero: Lanes<S>, columns: Vec<(usize, bool)>, velocities: usize) -> Self {
        let no = zero.lt(zero);
        let still = Vector::zero(zero);
        let newton = FootNewton {
            presses: no,
            sticks: no,
            slipped: no,
            bound: zero,
            bound_residual: zero,
            speeds: [zero; 3],
            ways: [zero; 3],
            used: [zero; 3],
            weights: [zero; 4],
            residuals: [zero; 3],
        };
        Self {
            jacobian: vec![[zero; 3]; columns.len()],
            responses: vec![[zero; 3]; velocities],
            columns,
            is_there: zero,
            arm: still,
            arc: still,
            directions: [still; 3],
            axes: [still; 3],
            distance: zero,
            friction: zero,
            effect: [zero; 6],
            inverse: [zero; 3],
            gradient_step: zero,
            unloaded: [zero; 3],
            target: zero,
            drift: [zero; 2],
            correction_velocity: zero,
            split_impulse: zero,
            impulse: [zero; 3],
            kept_impulse: [zero; 3],
            acts: no,
            newton,
        }
    }

    /// Returns the bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.columns[..]) + size_of_val(&self.jacobian[..]) + size_of_val(&self.responses[..])
    }

    /// Starts with a contact and its last impulse. `side` says which of the two robots it is; `origin` is its
    /// body's origin in the base's axes. The base is at the world's origin.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as the rows do")]
    pub(super) fn meet(&mut self, simd: S, contact: &FootContact<S>, side: usize, origin: Vector<S>) {
        let zero = self.target.splat(0.0);
        let (one, still) = (zero.splat(1.0), Vector::zero(zero));
        let is_there = zero.lt(contact.is_there);
        self.is_there = contact.is_there;
        let Vector { x, y, z } = contact.normal;
        // As `DVec3::any_orthonormal_pair`, which also uses the sign of a zero.
        let is_below = z.lt(zero) | (z.equals(zero) & (one / z).lt(zero));
        let sign = is_below.select(zero.splat(-1.0), one);
        let a = zero.splat(-1.0) / (sign + z);
        let b = x * y * a;
        let t = Vector { x: one + sign * x * x * a, y: sign * b, z: -sign * x };
        let u = Vector { x: b, y: sign + y * y * a, z: -y };
        let axes = [contact.normal, t, u];
        let pressed = is_there & zero.lt(contact.impulse.dot(contact.normal));
        let base_from_world = Matrix::broadcast(simd, &DMat3::from_quat(DQuat::IDENTITY).transpose());
        let arm = base_from_world.times(contact.position - still) - origin;
        self.arm = choose(is_there, arm, still);
        self.distance = is_there.select(contact.distance, zero);
        let sign = zero.splat(if side == 0 { -1.0 } else { 1.0 });
        for k in 0..3 {
            self.axes[k] = choose(is_there, axes[k], still);
            self.directions[k] = choose(is_there, base_from_world.times(axes[k] * sign), still);
            self.impulse[k] = pressed.select(contact.impulse.dot(axes[k]), zero);
        }
    }

    /// Returns the velocities along the axes.
    #[inline(always)]
    pub(super) fn velocities(&self, velocities: &[Lanes<S>]) -> [Lanes<S>; 3] {
        let zero = self.target.splat(0.0);
        let mut sums = [[zero; 2]; 3];
        for (j, (velocity, is_odd)) in self.jacobian.iter().zip(&self.columns) {
            let own = velocities[*velocity];
            for k in 0..3 {
                sums[k][usize::from(*is_odd)] += j[k] * own;
            }
        }
        [sums[0][0] + sums[0][1], sums[1][0] + sums[1][1], sums[2][0] + sums[2][1]]
    }

    /// Returns the normal velocity, and the tangent velocities relative to those without slip.
    #[inline(always)]
    pub(super) fn slip(&self, velocities: &[Lanes<S>]) -> [Lanes<S>; 3] {
        let [n, t, u] = self.velocities(velocities);
        [n, t - self.drift[0], u - self.drift[1]]
    }

    /// Applies an impulse along the axes to the velocities of some lanes.
    #[inline(always)]
    pub(super) fn apply_impulse(&self, impulse: [Lanes<S>; 3], lanes: Mask<S>, velocities: &mut [Lanes<S>]) {
        for (velocity, [n, t, u]) in velocities.iter_mut().zip(&self.responses) {
            let new = *velocity + (*n * impulse[0] + *t * impulse[1] + *u * impulse[2]);
            *velocity = lanes.select(new, *velocity);
        }
    }

    /// Adds J' times an impulse along the axes in some lanes.
    #[inline(always)]
    pub(super) fn add_momentum(&self, impulse: [Lanes<S>; 3], lanes: Mask<S>, momentum: &mut [Lanes<S>]) {
        for (j, (velocity, _)) in self.jacobian.iter().zip(&self.columns) {
            let slot = &mut momentum[*velocity];
            let new = *slot + (j[0] * impulse[0] + j[1] * impulse[1] + j[2] * impulse[2]);
            *slot = lanes.select(new, *slot);
        }
    }

    /// Computes J M^-1 J'.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as the rows do")]
    fn measure(&mut self) {
        let zero = self.target.splat(0.0);
        let mut effects = [[zero; 3]; 3];
        for k in 0..3 {
            let mut sums = [[zero; 2]; 3];
            for (j, (velocity, is_odd)) in self.jacobian.iter().zip(&self.columns) {
                let own = self.responses[*velocity][k];
                for l in 0..3 {
                    sums[l][usize::from(*is_odd)] += j[l] * own;
                }
            }
            effects[k] = [sums[0][0] + sums[0][1], sums[1][0] + sums[1][1], sums[2][0] + sums[2][1]];
        }
        let [[nn, ..], [tn, tt, _], [un, ut, uu]] = effects;
        self.effect = [zero + nn, zero + tn, zero + un, zero + tt, zero + ut, zero + uu];
        (self.inverse, self.gradient_step) = inverse_of_tangents(self.effect);
        self.acts = contact_law::acts(self.effect);
    }

    /// Sets the target velocities, from those before the step.
    #[inline(always)]
    pub(super) fn set_targets(&mut self, before: &[Lanes<S>], h: f64) {
        let zero = self.target.splat(0.0);
        let before = self.velocities(before);
        let half = zero.splat(-0.5 * h);
        let h = zero.splat(h);
        let turning =
            [zero, self.directions[1].dot(self.arc) * half, self.directions[2].dot(self.arc) * half];
        let mut leaving = [zero; 3];
        for k in 0..3 {
            leaving[k] = contact_law::leaving(turning[k], before[k]);
        }
        self.drift = [leaving[1], leaving[2]];
        self.target = contact_law::arrival(self.distance, h) + leaving[0];
        self.correction_velocity = contact_law::correction(self.distance, h);
        self.split_impulse = zero;
    }

    /// Returns the impulse on the second of the two robots, world.
    #[inline(always)]
    pub(super) fn world_impulse(&self) -> Vector<S> {
        let ([n, t, u], [a, b, c]) = (self.axes, self.impulse);
        n * a + t * b + u * c
    }

    /// Returns the lanes in which it has an impulse.
    #[inline(always)]
    pub(super) fn has_impulse(&self) -> Mask<S> {
        let zero = self.target.splat(0.0);
        !(self.impulse[0].equals(zero) & self.impulse[1].equals(zero) & self.impulse[2].equals(zero))
    }
}

impl<S: Simd> LaneRobot<S> {
    /// Computes the arcs of feet.
    #[inline(always)]
    pub(super) fn find_arcs(&mut self) {
        for index in 0..self.feet.touched.len() {
            let (body, _) = self.feet.touched[index];
            let foot = &mut self.feet.solver.feet[index];
            let at = &self.bodies[body];
            let is_there = foot.is_there.splat(0.0).lt(foot.is_there);
            let point = choose(is_there, self.feet.contacts[index].position, at.origin);
            let mut sum = of_point(at.velocity, point - at.origin);
            let mut next = Some(body);
            while let Some(i) = next {
                let at = &self.bodies[i];
                sum = sum + carried(at.velocity_product, point - at.origin);
                if i < self.first {
                    sum = sum - straight(at.velocity);
                }
                next = self.tree.bodies[i].parent;
            }
            foot.arc = sum;
        }
    }

    /// Computes J and M^-1 J' of all feet, and the quantities derived from them.
    #[inline(always)]
    pub(super) fn measure_feet(&mut self) {
        for index in 0..self.feet.touched.len() {
            let (body, _) = self.feet.touched[index];
            let foot = &self.feet.solver.feet[index];
            let (arm, [n, t, u]) = (foot.arm, foot.directions);
            let wrenches = [
                Spatial { angular: arm.cross(n), linear: n },
                Spatial { angular: arm.cross(t), linear: t },
                Spatial { angular: arm.cross(u), linear: u },
            ];
            self.project_wrenches(wrenches, body, index);
            self.respond_to_wrenches(wrenches, body, index);
            self.feet.solver.feet[index].measure();
        }
    }

    /// Writes J, the effect of wrenches on a body on each velocity's own momentum. Columns start at the root.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as the rows do")]
    fn project_wrenches(&mut self, wrenches: [Spatial<S>; 3], body: usize, index: usize) {
        let zero = self.occupied.splat(0.0);
        let (mut forces, mut next) = (wrenches, Some(body));
        let foot = &mut self.feet.solver.feet[index];
        let mut column = foot.columns.len();
        while let Some(i) = next.filter(|i| *i >= self.first) {
            let (joint_type, at) = (self.tree.bodies[i].joint_type, &self.bodies[i]);
            column -= 1;
            for k in 0..3 {
                foot.jacobian[column][k] = zero + along(joint_type, forces[k], at.rotation.z);
                forces[k] = forces[k].force_from(at.reach);
            }
            next = self.tree.bodies[i].parent;
        }
        if self.first == 0 {
            return;
        }
        let own_from_base = self.bodies[0].rotation.transposed();
        let parent_from_base = self.root.rotation().matrix().after(own_from_base);
        for k in 0..3 {
            let linear = parent_from_base.times(forces[k].linear);
            let angular = own_from_base.times(forces[k].angular);
            let six = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
            for (j, own) in foot.jacobian.iter_mut().zip(six) {
                j[k] = zero + own;
            }
        }
    }

    /// Writes M^-1 J', the effect of wrenches on a body on all velocities.
    #[inline(always)]
    fn respond_to_wrenches(&mut self, wrenches: [Spatial<S>; 3], body: usize, index: usize) {
        let zero = self.occupied.splat(0.0);
        let still = Vector::zero(zero);
        let none = Spatial { angular: still, linear: still };
        let (first, n) = (self.first, self.bodies.len());
        let offset = self.tree.root_velocities();
        let FootSolver { feet, deltas, .. } = &mut self.feet.solver;
        let responses = &mut feet[index].responses;
        for response in &mut responses[offset..] {
            *response = [zero; 3];
        }
        // Until the forward pass, the share of the impulses that each joint takes.
        let (mut next, mut p) = (Some(body), wrenches);
        for p in &mut p {
            *p = -*p;
        }
        while let Some(i) = next.filter(|i| *i >= first) {
            let (joint_type, parent) = (self.tree.bodies[i].joint_type, self.tree.bodies[i].parent);
            let at = &self.bodies[i];
            for k in 0..3 {
                let impulse = zero - along(joint_type, p[k], at.rotation.z);
                responses[offset + i - first][k] = impulse;
                p[k] = (p[k] + at.column * (at.inverse_d * impulse)).force_from(at.reach);
            }
            next = parent;
        }
        if first > 0 {
            let own_from_base = self.bodies[0].rotation.transposed();
            let carried = none.motion_at(self.bodies[0].reach);
            let rotation = self.root.rotation();
            for k in 0..3 {
                let delta = self.factors.solve(-p[k]);
                deltas[0][k] = delta;
                let motion = delta - carried;
                // In the axes of the root's velocities; see `root_velocities`.
                let linear = rotation.times(own_from_base.times(motion.linear));
                let angular = own_from_base.times(motion.angular);
                let six = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
                for (response, own) in responses.iter_mut().zip(six) {
                    response[k] = zero + own;
                }
            }
        }
        for i in first..n {
            let (joint_type, parent) = (self.tree.bodies[i].joint_type, self.tree.bodies[i].parent);
            let above = parent.map_or([none; 3], |parent| deltas[parent]);
            let at = &self.bodies[i];
            for k in 0..3 {
                let mut delta = above[k].motion_at(at.reach);
                let response = &mut responses[offset + i - first][k];
                let change = at.inverse_d * (*response - delta.dot(at.column));
                let part = part_mut(joint_type, &mut delta);
                *part = *part + at.rotation.z * change;
                deltas[i][k] = delta;
                *response = zero + change;
            }
        }
    }
}

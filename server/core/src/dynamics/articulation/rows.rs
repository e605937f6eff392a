//! Data of a robot for constraint rows: Jacobians, responses to impulses, and predicted poses.

use glamx::{DMat3, DPose3, DQuat, DVec3};
use pulp::Arch;

use super::Articulation;
use super::StepScratch;
use crate::dynamics::arcs::arc;
use crate::dynamics::constraint::side::Side;
use crate::dynamics::constraint::{
    Constraints, MultiRhsSolve, PlacedBody, RowKey, prepare, project_onto, respond, respond_to_force,
    respond_to_unit_forces, sweep,
};
use crate::dynamics::implicit_inertia::implicit_inertia;
use crate::dynamics::inertia::Rigid;
use crate::dynamics::integrate::advance_joint;
use crate::dynamics::kinematics::joint_placement;
use crate::dynamics::ldlt::Ldlt6;
use crate::dynamics::scratch::MultiRhs;
use crate::dynamics::spatial::{Placement, Spatial};
use crate::dynamics::spatials::Spatials;
use crate::dynamics::symmetric::Symmetric;
use crate::dynamics::tree::JointType;

/// Maximum number of positions of a body, reached by a free one.
const MAX_POSITIONS: usize = 7;

impl Articulation {
    /// Returns unit impulses at a world point of a body along three world directions. They act about the
    /// body's origin, in the base's axes; the fourth is zero.
    #[inline(always)]
    pub(in crate::dynamics) fn wrenches(
        &self,
        body: usize,
        point: DVec3,
        directions: [DVec3; 3],
    ) -> Spatials<4> {
        let base_from_world = DMat3::from_quat(self.state.base.rotation).transpose();
        let arm =
            base_from_world * (point - self.state.base.translation) - self.scratch.passes.bodies[body].origin;
        let mut wrenches = Spatials::ZERO;
        for (k, direction) in directions.into_iter().enumerate() {
            let direction = base_from_world * direction;
            wrenches.set(k, Spatial::new(arm.cross(direction), direction));
        }
        wrenches
    }

    /// Returns unit torque impulses about three world directions, in the base's axes; the fourth is zero.
    pub(in crate::dynamics) fn torques(&self, directions: [DVec3; 3]) -> Spatials<4> {
        let mut torques = Spatials::ZERO;
        for (k, direction) in directions.into_iter().enumerate() {
            torques.set(k, self.torque(direction));
        }
        torques
    }

    /// Returns the acceleration of a world point of a body with constant velocities, world, m/s².
    pub(in crate::dynamics) fn arc(&self, body: usize, point: DVec3) -> DVec3 {
        let world_from_base = DMat3::from_quat(self.state.base.rotation);
        let point = world_from_base.transpose() * (point - self.state.base.translation);
        world_from_base * arc(&self.tree, &self.scratch.passes.bodies, body, point)
    }

    /// Returns a unit torque impulse on a body about a world direction, in the base's axes.
    pub(in crate::dynamics) fn torque(&self, direction: DVec3) -> Spatial {
        Spatial::new(self.state.base.rotation.inverse() * direction, DVec3::ZERO)
    }

    /// Adds J for three impulses on a body about its origin, in the base's axes, to a side's J.
    #[inline(always)]
    pub(in crate::dynamics) fn add_wrench_rows(
        &self,
        body: usize,
        wrenches: &Spatials<4>,
        side: &Side,
        jacobian: &mut [f64],
    ) {
        let (q, bodies) = (&self.state.positions, &self.scratch.passes.bodies);
        project_onto(&self.tree, q, bodies, (body, wrenches), side, jacobian);
    }

    /// Writes M^-1 J' for an impulse on a body about its origin, in the base's axes.
    pub(in crate::dynamics) fn wrench_response(
        &mut self,
        body: usize,
        wrench: Spatial,
        response: &mut [f64],
    ) {
        respond_to_force(
            &self.tree,
            &self.state.positions,
            (body, wrench),
            &mut self.scratch.passes,
            response,
        );
    }

    /// Adds M^-1 J' for three impulses on a body about its origin, in the base's axes, to three lists of all
    /// velocities. `rhs` is memory with an entry for each body.
    pub(in crate::dynamics) fn add_wrench_responses(
        &self,
        body: usize,
        wrenches: &Spatials<4>,
        rhs: &mut [MultiRhs<4>],
        sums: &mut [f64],
    ) {
        let (tree, q, scratch) = (&*self.tree, &self.state.positions, &self.scratch.passes);
        let rhs = &mut rhs[..tree.bodies.len()];
        Arch::new().dispatch(MultiRhsSolve::of_wrenches(tree, q, (body, wrenches), scratch, rhs, sums));
    }

    /// Writes M^-1 J' for the six unit impulses on a body about its origin, in the base's axes; not for
    /// single bodies.
    pub(in crate::dynamics) fn unit_wrench_responses(&mut self, body: usize, responses: &mut [f64]) {
        respond_to_unit_forces(&self.tree, &self.state.positions, body, &mut self.scratch.passes, responses);
    }

    /// Returns its pose and inertia if it is one free body that only its own inertia resists.
    pub(in crate::dynamics) fn placed_body(&self) -> Option<PlacedBody> {
        let is_stiffened = self.scratch.stiffening != Symmetric::ZERO;
        if is_stiffened { None } else { PlacedBody::new(&self.tree, &self.scratch.passes) }
    }

    /// Returns the centre of mass of a single free body, and its moment of inertia about it, world; `None`
    /// for other robots.
    pub(in crate::dynamics) fn free_moment(&self) -> Option<(DVec3, Symmetric)> {
        let (center, moment) = self.scratch.free_body.as_ref()?.about_own_center();
        let at = &self.scratch.passes.bodies[0];
        Some((at.origin + at.rotation * center, moment.turned(&at.rotation)))
    }

    /// Adds a moment, world, to a single free body's resistance to turning impulses, until velocities are
    /// [computed](Self::start) again.
    pub(in crate::dynamics) fn add_turning_resistance(&mut self, moment: Symmetric) {
        let StepScratch { passes, stiffening, .. } = &mut self.scratch;
        if let ([at], [factors]) = (&mut passes.bodies[..], &mut passes.free[..]) {
            at.articulated.moment += moment + *stiffening * -1.0;
            *factors = Ldlt6::new(&at.articulated);
            *stiffening = moment;
        }
    }

    /// Returns `world_from_body` of a body after these velocities have moved it for `h` seconds.
    pub(in crate::dynamics) fn pose_after(&self, body: usize, velocities: &[f64], h: f64) -> DPose3 {
        let mut base_from_body = Placement::IDENTITY;
        let mut next = Some(body);
        while let Some(body) = next {
            let body = &self.tree.bodies[body];
            let mut q = [0.0; MAX_POSITIONS];
            let own = &self.state.positions[body.position..][..body.joint_type.positions()];
            q[..own.len()].copy_from_slice(own);
            advance_joint(body.joint_type, &mut q, &velocities[body.velocity..], h);
            base_from_body = joint_placement(body, &q).then(&base_from_body);
            next = body.parent;
        }
        let Placement { rotation, origin } = base_from_body;
        let rotation = self.state.base.rotation * DQuat::from_mat3(&rotation);
        DPose3::from_parts(self.state.base.transform_point(origin), rotation.normalize())
    }

    /// Adds the initial impulses of the rows of joints to `velocities`.
    pub(in crate::dynamics) fn prepare_rows(&mut self, velocities: &mut [f64]) {
        prepare(
            &self.tree,
            &self.state.positions,
            &mut self.scratch.constraints,
            &mut self.scratch.passes,
            velocities,
        );
    }

    /// Sweeps once through the rows of joints. Returns the largest change of a velocity.
    pub(in crate::dynamics) fn sweep_rows(&mut self, velocities: &mut [f64]) -> f64 {
        sweep(&mut self.scratch.constraints, velocities)
    }

    /// Writes M^-1 J' for an impulse of a size at the joint of a body.
    pub(in crate::dynamics) fn joint_response(&mut self, joint: (usize, f64), response: &mut [f64]) {
        respond(&self.tree, &self.state.positions, &[joint], &mut self.scratch.passes, response);
    }

    /// Returns the rows of joints and their responses.
    pub(in crate::dynamics) fn constraints_mut(&mut self) -> &mut Constraints {
        &mut self.scratch.constraints
    }

    /// Writes the inertia that impulses act on, from this step's passes; see [`implicit_inertia`].
    pub(in crate::dynamics) fn write_implicit_inertia(
        &self,
        composite: &mut Vec<Rigid>,
        matrix: &mut [f64],
    ) -> bool {
        if !implicit_inertia(&self.tree, &self.state.positions, &self.scratch.passes, composite, matrix) {
            return false;
        }
        if self.scratch.stiffening != Symmetric::ZERO {
            // Angular velocities are in the body's own axes.
            let own_from_base = self.scratch.passes.bodies[0].rotation.transpose();
            let own = self.scratch.stiffening.turned(&own_from_base).matrix();
            for (i, row) in own.to_cols_array_2d().into_iter().enumerate() {
                for (j, value) in row.into_iter().enumerate() {
                    matrix[6 * (3 + i) + 3 + j] += value;
                }
            }
        }
        true
    }

    /// Stores the impulses of the rows of joints for the next step.
    pub(in crate::dynamics) fn store_impulses(&mut self) {
        self.judge_rows();
        self.state.impulses.keep(&self.scratch.constraints.rows);
    }

    /// Returns the largest part of `step`, at most 1, that leads no joint past a limit without a row. The
    /// joints move with `goes` plus this part for `h` seconds.
    pub(in crate::dynamics) fn part_within_limits(&self, goes: &[f64], step: &[f64], h: f64) -> f64 {
        let rows = &self.scratch.constraints.rows;
        let mut part = 1.0f64;
        for body in &self.tree.bodies {
            if !matches!(body.joint_type, JointType::Revolute | JointType::Prismatic) {
                continue;
            }
            let (dof, limits) = (body.velocity, &self.state.axes[body.velocity].settings.limits);
            let at = self.state.positions[body.position] + h * goes[dof];
            for (limit, key, sign) in
                [(limits.lower, RowKey::Lower(dof), -1.0), (limits.upper, RowKey::Upper(dof), 1.0)]
            {
                let Some(limit) = limit else { continue };
                let (room, way) = ((limit - at) * sign, h * step[dof] * sign);
                if way > room && room > 0.0 && !rows.iter().any(|row| row.key == key) {
                    part = part.min(room / way);
                }
            }
        }
        part
    }
}

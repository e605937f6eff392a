//! Inertia that impulses of a step act on, for all copies, as
//! [`implicit_inertia`](crate::dynamics::implicit_inertia) writes it for one.

use glamx::DVec3;
use pulp::Simd;

use super::foot_solver::FootSolver;
use super::robot::LaneRobot;
use crate::dynamics::articulated::{along, part_mut};
use crate::dynamics::implicit_inertia::LOCKED;
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::lane::vectors::{Spatial, Vector};
use crate::dynamics::real::{MaskOf as _, MatrixOf as _, Real as _};

impl<S: Simd> LaneRobot<S> {
    /// Writes the inertia in the order of [`TreeCholesky`](super::tree_cholesky::TreeCholesky). Returns the
    /// lanes in which there is such a matrix.
    #[inline(always)]
    pub(super) fn write_implicit_inertia(&mut self) -> Mask<S> {
        let (first, n) = (self.first, self.bodies.len());
        for at in &mut self.bodies {
            at.composite = at.inertia.turned(&at.rotation);
        }
        for i in (0..n).rev() {
            let Some(parent) = self.tree.bodies[i].parent else { continue };
            let lifted = self.bodies[i].composite.shifted(self.bodies[i].reach);
            self.bodies[parent].composite += lifted;
        }
        let zero = self.occupied.splat(0.0);
        let still = Vector::zero(zero);
        if first > 0 {
            let rotation = self.root.rotation();
            let own_from_parent = super::free::Quaternion { vector: -rotation.vector, w: rotation.w };
            let at = self.bodies[0].rotation;
            for (k, axis) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                let axis = Vector::broadcast(self.simd, axis);
                let linear = Spatial { angular: still, linear: at.times(own_from_parent.times(axis)) };
                let angular = Spatial { angular: at.times(axis), linear: still };
                for (row, column) in [(k, linear), (k + 3, angular)] {
                    let force = self.bodies[0].composite.times(column);
                    self.write_root_columns(row, row + 1, force);
                }
            }
        }
        let offset = self.tree.root_velocities();
        for i in first..n {
            let joint_type = self.tree.bodies[i].joint_type;
            let at = &self.bodies[i];
            let mut column = Spatial { angular: still, linear: still };
            *part_mut(joint_type, &mut column) = at.rotation.z;
            let row = offset + i - first;
            let mut force = at.composite.times(column);
            let diagonal = {
                let row = &self.feet.solver.matrix.rows[row];
                row.at + row.ancestors.len()
            };
            let (mut next, mut index) = (Some(i), diagonal + 1);
            while let Some(j) = next.filter(|j| *j >= first) {
                let (joint_type, at) = (self.tree.bodies[j].joint_type, &self.bodies[j]);
                index -= 1;
                self.feet.solver.inertia[index] = along(joint_type, force, at.rotation.z);
                force = force.force_from(at.reach);
                next = self.tree.bodies[j].parent;
            }
            if first > 0 {
                self.write_root_columns(row, 6, force);
            }
            let at = &self.bodies[i];
            let own = zero.splat(1.0) / at.inverse_d - along(joint_type, at.column, at.rotation.z);
            let added = zero.lt(at.inverse_d).select(own, zero.splat(LOCKED));
            self.feet.solver.inertia[diagonal] += added;
        }
        self.factors.is_regular()
    }

    /// Writes the effect of a force on the root on its first `count` velocities into a row.
    #[inline(always)]
    fn write_root_columns(&mut self, row: usize, count: usize, force: Spatial<S>) {
        let (linear, angular) = self.root_velocities(force);
        let six: [Lanes<S>; 6] = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
        let FootSolver { inertia, matrix, .. } = &mut self.feet.solver;
        inertia[matrix.rows[row].at..][..count].copy_from_slice(&six[..count]);
    }
}

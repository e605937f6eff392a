//! Mobility of a point of a robot.

use std::sync::Arc;

use glamx::{DMat3, DVec3};

use super::Articulation;
use crate::dynamics::articulated::InertiaPass;
use crate::dynamics::constraint::respond_to_force;
use crate::dynamics::integrator::Integrator;
use crate::dynamics::kinematics::update_kinematics;

impl Articulation {
    /// Returns the velocity, m/s, that an impulse of 1 N s along each of the world's axes gives to a point of
    /// a body. Each column is one axis; point and velocity are in world axes. The matrix is J M^-1 J',
    /// symmetric and without negative eigenvalues. Its inverse is the pseudo kinetic energy matrix of Khatib
    /// ("A unified approach for motion and force control of robot manipulators", 1987). M belongs to a step
    /// of `h` seconds: it includes the actuators' laws of the last step.
    ///
    /// Costs three backward and forward passes over the robot, and the memory of one list of velocities. Call
    /// it between steps.
    pub fn mobility(&mut self, body: usize, point: DVec3, h: f64, integrator: Integrator) -> DMat3 {
        let tree = Arc::clone(&self.tree);
        self.update_kinematics();
        let pass = InertiaPass {
            tree: &tree,
            axes: &self.state.axes,
            drives: &self.state.drives,
            external: &self.state.external,
            positions: &self.state.positions,
            half_velocities: &self.state.half_velocities,
            h,
            integrator,
            scratch: &mut self.scratch.passes,
        };
        pass.run();
        // All responses are computed from the gathered data before any of them is used.
        let mut responses = vec![0.0; 3 * tree.velocity_count];
        let size = tree.velocity_count.max(1);
        let wrenches = self.wrenches(body, point, [DVec3::X, DVec3::Y, DVec3::Z]);
        for (k, response) in responses.chunks_exact_mut(size).enumerate() {
            let push = (body, wrenches.get(k));
            respond_to_force(&tree, &self.state.positions, push, &mut self.scratch.passes, response);
        }
        let mut columns = [DVec3::ZERO; 3];
        for (column, response) in columns.iter_mut().zip(responses.chunks_exact(size)) {
            update_kinematics(&tree, &self.state.positions, response, &mut self.scratch.passes.bodies);
            let motion = self.body_motion(body);
            *column = motion.linear + motion.angular.cross(point - motion.pose.translation);
        }
        self.update_kinematics();
        DMat3::from_cols(columns[0], columns[1], columns[2])
    }
}

//! What copies of a world need beside commands: to begin from a kept state again and again, and targets at each step
//! without a search for names.

use std::sync::Arc;

use super::targets::actuator_for;
use crate::dynamics::Tree;
use crate::simulation::command::Target;
use crate::simulation::saved::Saved;
use crate::simulation::{PhysicsSettings, Simulation, WorldLimits};

/// Of the first robot of a copy.
const FIRST_VERSION: u64 = 1;

impl Simulation {
    /// A world in a kept state. It has no claims and keeps no states.
    pub(crate) fn copy_of(saved: &Saved) -> Self {
        let limits = WorldLimits { robots: saved.robot_count(), saved_states: 0 };
        let mut copy = Self::new(PhysicsSettings::default(), limits);
        copy.next_version = FIRST_VERSION + saved.robot_count() as u64;
        copy.begin_from(saved, &[]);
        copy.lay_out();
        copy
    }

    /// Puts a world that is a copy of a kept state back to that state. Robots for which there is a tree have that one in the place
    /// of their own: one that moves as theirs does, with other masses.
    pub(crate) fn begin_from(&mut self, saved: &Saved, trees: &[Option<Arc<Tree>>]) {
        let (state, mut robots) = saved.with_versions(FIRST_VERSION);
        for (robot, tree) in robots.iter_mut().zip(trees) {
            if let Some(tree) = tree {
                robot.tree = Arc::clone(tree);
                robot.version = self.take_version();
            }
        }
        self.go_back(state, robots);
        self.events.clear();
    }

    /// Gives an axis a target, as `Command::SetTargets` does where no trajectory moves the joint; beyond a limit it is clamped.
    /// The body is one that takes targets.
    pub(crate) fn set_axis_target(&mut self, robot: usize, body: usize, target: &Target) {
        let robot = &mut self.entities[robot].body;
        let (actuator, _beyond) = actuator_for(robot, body, target);
        let dof = robot.tree().bodies[body].velocity;
        robot.set_actuator(dof, actuator);
    }

    /// Position and velocity of the axis of a body that turns or slides.
    pub(crate) fn axis_state(&self, robot: usize, body: usize) -> (f64, f64) {
        let robot = &self.entities[robot].body;
        let velocity = robot.tree().bodies[body].velocity;
        (robot.tree().place_of_axis(body, robot.positions()), robot.velocities()[velocity])
    }
}

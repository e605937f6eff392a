//! A robot as its description says that it begins: see [`simd_model::setup`].

use simd_model::RobotModel;
use simd_model::setup::{DriveMode, JointSetup, Spring};

use super::Entity;
use super::joints::is_actuated;
use crate::collision::Groups;
use crate::dynamics::{Actuator, Axis, Mode, Tree};

/// The body of each joint of one axis of which something is said.
fn bodies<'m>(model: &'m RobotModel, tree: &Tree) -> impl Iterator<Item = (&'m JointSetup, usize)> {
    let body = |setup: &'m JointSetup| {
        let mut bodies = tree.joints.get(setup.joint)?.clone();
        let body = bodies.next().filter(|_| bodies.next().is_none())?;
        is_actuated(model, tree, body).then_some((setup, body))
    };
    model.setup.joints.iter().filter_map(body).collect::<Vec<_>>().into_iter()
}

/// Writes rotor inertias and springs into the settings of axes.
pub(super) fn set_axes(model: &RobotModel, tree: &Tree, axes: &mut [Axis]) {
    for (setup, body) in bodies(model, tree) {
        let settings = &mut axes[tree.bodies[body].velocity].settings;
        let Spring { stiffness, rest } = setup.spring.unwrap_or_default();
        (settings.armature, settings.spring_stiffness, settings.spring_rest) =
            (setup.armature, stiffness, rest);
    }
}

/// First positions by index of the position.
pub(super) fn positions(model: &RobotModel, tree: &Tree) -> Vec<(usize, f64)> {
    let position = |(setup, body): (&JointSetup, usize)| Some((tree.bodies[body].position, setup.position?));
    bodies(model, tree).filter_map(position).collect()
}

/// The groups of each link.
pub(super) fn groups(model: &RobotModel) -> Vec<Groups> {
    let mut groups = vec![Groups::default(); model.links.len()];
    for said in &model.setup.groups {
        if let Some(slot) = groups.get_mut(said.link) {
            *slot = Groups { group: said.group, mask: said.mask };
        }
    }
    groups
}

impl Entity {
    /// Has actuators do what the description says, unless none of the robot is to be driven.
    pub(super) fn begin_as_described(&mut self, passive: bool) {
        let model = std::sync::Arc::clone(&self.model);
        let tree = std::sync::Arc::clone(self.body.tree());
        for (setup, body) in bodies(&model, &tree) {
            let actuator = &mut self.body.axes_mut()[tree.bodies[body].velocity].actuator;
            *actuator = match setup.mode.filter(|_| !passive) {
                None => continue,
                Some(DriveMode::Passive) => Actuator { mode: Mode::Passive, ..Actuator::default() },
                Some(DriveMode::Velocity) => {
                    Actuator { mode: Mode::Velocity, damping: setup.damping, ..Actuator::default() }
                }
                Some(DriveMode::Effort) => Actuator { mode: Mode::Effort, ..Actuator::default() },
            };
        }
        self.use_described_gains();
    }

    /// Puts the description's gains in the place of those that follow from inertia.
    pub(in crate::simulation) fn use_described_gains(&mut self) {
        let model = std::sync::Arc::clone(&self.model);
        let tree = std::sync::Arc::clone(self.body.tree());
        for (setup, body) in bodies(&model, &tree) {
            let settings = &mut self.body.axes_mut()[tree.bodies[body].velocity].settings;
            let Some(stiffness) = setup.stiffness else { continue };
            settings.default_stiffness = stiffness;
            settings.default_damping = setup.damping.unwrap_or(0.0);
        }
    }
}

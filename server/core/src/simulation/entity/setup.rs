//! Initial setup of a robot from its description: see [`simd_model::setup`].

use simd_model::RobotModel;
use simd_model::setup::{DriveMode, JointSetup, Spring};

use super::Entity;
use super::joints::is_actuated;
use crate::collision::Groups;
use crate::dynamics::tree::JointType;
use crate::dynamics::{Actuator, Axis, Mode, Tree};
use crate::simulation::settings::SetpointProfiles;

/// Returns the bodies of joints with a setup: of joints of one axis, and the three of ball joints.
fn bodies<'m>(model: &'m RobotModel, tree: &Tree) -> Vec<(&'m JointSetup, usize)> {
    let of = |setup: &'m JointSetup| {
        let bodies = tree.joints.get(setup.joint).cloned().unwrap_or_default();
        let is_one = bodies.len() == 1;
        let bodies = bodies.filter(move |body| is_one || is_ball(tree, *body));
        bodies
            .filter(|body| is_actuated(model, tree, *body))
            .map(move |body| (setup, body))
            .collect::<Vec<_>>()
    };
    model.setup.joints.iter().flat_map(of).collect()
}

fn is_ball(tree: &Tree, body: usize) -> bool {
    matches!(tree.bodies[body].joint_type, JointType::Spherical { .. })
}

/// Copies rotor inertias, springs and compensations of gravity to the settings of axes.
pub(super) fn set_axes(model: &RobotModel, tree: &Tree, axes: &mut [Axis]) {
    for (setup, body) in bodies(model, tree) {
        let settings = &mut axes[tree.bodies[body].velocity].settings;
        let Spring { stiffness, rest } = setup.spring.unwrap_or_default();
        (settings.armature, settings.spring_stiffness, settings.spring_rest) =
            (setup.armature, stiffness, rest);
        settings.gravity_compensation = setup.gravity_compensation;
    }
}

/// Returns the initial positions by index of the position.
pub(super) fn positions(model: &RobotModel, tree: &Tree) -> Vec<(usize, f64)> {
    let bodies = bodies(model, tree).into_iter().filter(|(_, body)| !is_ball(tree, *body));
    bodies.filter_map(|(setup, body)| Some((tree.bodies[body].position, setup.position?))).collect()
}

/// Returns the groups of each link.
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
    /// Starts actuators as described, unless the robot is passive.
    pub(super) fn begin_as_described(&mut self, passive: bool) {
        let model = std::sync::Arc::clone(&self.model);
        let tree = std::sync::Arc::clone(self.body.tree());
        for (setup, body) in bodies(&model, &tree) {
            let actuator = &mut self.body.axes_mut()[tree.bodies[body].velocity].actuator;
            *actuator = match setup.mode.filter(|_| !passive) {
                None => continue,
                Some(DriveMode::Passive) => Actuator { mode: Mode::Passive, ..Actuator::default() },
                Some(DriveMode::Velocity) => Actuator { mode: Mode::Velocity, ..Actuator::default() },
                Some(DriveMode::Effort) => Actuator { mode: Mode::Effort, ..Actuator::default() },
            };
        }
        self.use_described_gains();
    }

    /// Replaces the gains derived from inertia by the description's, which hold for all modes.
    pub(in crate::simulation) fn use_described_gains(&mut self) {
        let model = std::sync::Arc::clone(&self.model);
        let tree = std::sync::Arc::clone(self.body.tree());
        for (setup, body) in bodies(&model, &tree) {
            let settings = &mut self.body.axes_mut()[tree.bodies[body].velocity].settings;
            let damping = setup.damping.filter(|damping| *damping > 0.0);
            settings.velocity_damping = damping;
            match (setup.stiffness, damping) {
                (Some(stiffness), _) => {
                    settings.default_stiffness = stiffness;
                    settings.default_damping = damping.unwrap_or(0.0);
                }
                // The damping is critical for this stiffness.
                (None, Some(damping)) => {
                    settings.default_stiffness = damping * damping / (4.0 * settings.composite_inertia);
                    settings.default_damping = damping;
                }
                (None, None) => {}
            }
        }
    }

    /// Chooses the joints whose position targets act at once.
    pub(in crate::simulation) fn choose_profiles(&mut self, profiles: SetpointProfiles) {
        let model = std::sync::Arc::clone(&self.model);
        let tree = std::sync::Arc::clone(self.body.tree());
        let is_direct = profiles == SetpointProfiles::None;
        self.body.axes_mut().iter_mut().for_each(|axis| axis.settings.is_direct = is_direct);
        if profiles != SetpointProfiles::Undescribed {
            return;
        }
        for (setup, body) in bodies(&model, &tree) {
            let is_described = setup.stiffness.is_some() || setup.damping.is_some();
            self.body.axes_mut()[tree.bodies[body].velocity].settings.is_direct = is_described;
        }
    }
}

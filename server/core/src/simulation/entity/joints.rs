//! Names and indices of a robot's joints and links, and the joints that take targets.

use std::ops::Range;

use simd_model::RobotModel;
use simd_model::robot::JointKind;

use super::Entity;
use crate::dynamics::Tree;
use crate::dynamics::tree::JointType;
use crate::simulation::check;
use crate::simulation::error::Error;

impl Entity {
    /// Returns the index of a joint in the model.
    pub(in crate::simulation) fn joint(&self, joint: &str) -> Result<usize, Error> {
        self.model.joints.iter().position(|known| known.name == joint).ok_or_else(|| Error::JointNotFound {
            robot: self.state.name.clone(),
            joint: joint.to_owned(),
            known: self.model.joints.iter().map(|joint| joint.name.clone()).collect(),
        })
    }

    /// Returns the index of a link in the model.
    pub(in crate::simulation) fn link(&self, link: &str) -> Result<usize, Error> {
        self.model.links.iter().position(|known| known.name == link).ok_or_else(|| Error::LinkNotFound {
            robot: self.state.name.clone(),
            link: link.to_owned(),
            known: self.model.links.iter().map(|link| link.name.clone()).collect(),
        })
    }

    /// Returns whether a joint is a ball joint.
    pub(in crate::simulation) fn is_spherical(&self, joint: usize) -> bool {
        self.model.joints[joint].kind == JointKind::Spherical
    }

    /// Returns the body of an axis of a joint with one axis or, if planar or spherical, three.
    pub(in crate::simulation) fn axis_body(&self, joint: usize, axis: u32) -> Result<usize, Error> {
        let name = &self.model.joints[joint].name;
        let bodies = self.body.tree().joints[joint].clone();
        if matches!(self.model.joints[joint].kind, JointKind::Fixed | JointKind::Floating) {
            return Err(Error::JointNotActuated {
                robot: self.state.name.clone(),
                joint: name.clone(),
                why: match self.model.joints[joint].kind {
                    JointKind::Fixed => "is fixed".into(),
                    _ => "is floating".into(),
                },
            });
        }
        let last = bodies.len().saturating_sub(1);
        bodies
            .clone()
            .nth(axis as usize)
            .ok_or_else(|| check::refuse("axis", axis, format!("the joint has axes 0 to {last}")))
    }

    /// Returns the body of an axis that takes targets.
    pub(in crate::simulation) fn actuated_body(&self, joint: usize, axis: u32) -> Result<usize, Error> {
        let index = self.axis_body(joint, axis)?;
        if let Some(mimic) = self.model.joints[joint].mimic {
            return Err(Error::JointNotActuated {
                robot: self.state.name.clone(),
                joint: self.model.joints[joint].name.clone(),
                why: format!("follows joint {:?}", self.model.joints[mimic.joint].name),
            });
        }
        Ok(index)
    }

    /// Returns the bodies that take targets, with their joints.
    pub(in crate::simulation) fn actuated(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let tree = self.body.tree();
        (0..tree.bodies.len())
            .filter(|&index| is_actuated(&self.model, tree, index))
            .filter_map(|index| Some((tree.bodies[index].joint?, index)))
    }

    /// Returns the ranges of each joint of the model within the robot's joint positions and velocities.
    pub(in crate::simulation) fn joint_ranges(&self) -> (Vec<Range<usize>>, Vec<Range<usize>>) {
        let tree = self.body.tree();
        let (mut position, mut velocity) = (0, 0);
        tree.joints
            .iter()
            .map(|bodies| {
                let (p, v) = (position, velocity);
                for body in &tree.bodies[bodies.clone()] {
                    position += body.joint_type.positions();
                    velocity += body.joint_type.velocities();
                }
                (p..position, v..velocity)
            })
            .unzip()
    }
}

/// Returns whether a body's axis takes targets.
pub(super) fn is_actuated(model: &RobotModel, tree: &Tree, index: usize) -> bool {
    let body = &tree.bodies[index];
    let follows = |joint: usize| model.joints[joint].mimic.is_some();
    !matches!(body.joint_type, JointType::Free { .. }) && body.joint.is_some_and(|joint| !follows(joint))
}

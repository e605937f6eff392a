//! What commands set of a robot and steps leave alone: settings of joints, claims, surfaces. It is
//! shared with every published state and replaced only where a command changed it.

use std::sync::Arc;

use simd_model::robot::JointLimits;

use super::entity::Entity;
use crate::collision::{Groups, LinkPair, Surface};

/// Settings of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotSettings {
    /// One for each joint of the model, in its order.
    pub joints: Vec<JointSettings>,
    /// One for each link of the model, in its order; `None` where it has no collider.
    pub surfaces: Vec<Option<Surface>>,
    /// Its links touch each other.
    pub self_collision: bool,
    /// One for each link of the model, in its order.
    pub groups: Vec<Groups>,
    /// Who holds a claim on all of it.
    pub claimed_by: Option<Arc<str>>,
    /// Its own links that were switched off or on, in order.
    pub collision_pairs: Arc<Vec<LinkPair>>,
}

/// Settings of a joint; of a planar joint's three axes those of the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointSettings {
    /// In force.
    pub limits: JointLimits,
    /// N m s/rad or N s/m.
    pub damping: f64,
    /// N m or N.
    pub friction: f64,
    /// kg m^2 or kg.
    pub armature: f64,
    /// Of a spring beside the actuator, N m/rad or N/m, and where it pulls nowhere, rad or m. Stiffness 0: there is none.
    pub spring: (f64, f64),
    /// Stiffness and damping of targets that give none.
    pub default_gains: (f64, f64),
    /// Its actuator holds the weight of what hangs on it.
    pub gravity_compensation: bool,
    /// Who holds a claim on it.
    pub claimed_by: Option<Arc<str>>,
}

impl Entity {
    /// As they are now.
    pub(super) fn robot_settings(&self) -> RobotSettings {
        RobotSettings {
            joints: (0..self.model.joints.len()).map(|joint| self.joint_settings(joint)).collect(),
            surfaces: (0..self.model.links.len()).map(|link| self.colliders.surface(link)).collect(),
            self_collision: self.state.contact_settings.self_collision,
            groups: self.state.groups.clone(),
            claimed_by: self.claims.whole.as_ref().map(|claim| Arc::clone(&claim.holder)),
            collision_pairs: Arc::clone(&self.state.collision_pairs),
        }
    }

    fn joint_settings(&self, joint: usize) -> JointSettings {
        let tree = self.body.tree();
        let mut bodies = tree.bodies[tree.joints[joint].clone()].iter();
        let axis = bodies.find(|body| body.joint_type.velocities() == 1);
        let settings = axis.map(|body| self.body.axes()[body.velocity].settings.clone()).unwrap_or_default();
        JointSettings {
            limits: settings.limits,
            damping: settings.damping,
            friction: settings.friction,
            armature: settings.armature,
            spring: (settings.spring_stiffness, settings.spring_rest),
            default_gains: (settings.default_stiffness, settings.default_damping),
            gravity_compensation: settings.gravity_compensation,
            claimed_by: self.claims.of_joint(joint).map(|claim| Arc::clone(&claim.holder)),
        }
    }
}

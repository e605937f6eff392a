//! Settings of a robot that commands change and steps do not: settings of joints, claims, surfaces. They are
//! shared with every published state and replaced only when a command changed them.

use std::sync::Arc;

use simd_model::robot::JointLimits;

use super::entity::Entity;
use crate::collision::{Groups, LinkPair, Surface};
use crate::dynamics::link_damping::LinkDamping;

/// Settings of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotSettings {
    /// Settings of each joint of the model, in its order.
    pub joints: Vec<JointSettings>,
    /// Surface of each link of the model, in its order; `None` if it has no collider.
    pub surfaces: Vec<Option<Surface>>,
    /// Whether its links touch each other.
    pub self_collision: bool,
    /// It does not sleep, even if the world lets bodies sleep.
    pub stays_awake: bool,
    /// One for each link of the model, in its order.
    pub groups: Vec<Groups>,
    /// Damping of each link of the model, in its order; empty without any.
    pub link_damping: Vec<LinkDamping>,
    /// Holder of a claim on the whole robot.
    pub claimed_by: Option<Arc<str>>,
    /// Enabled and disabled pairs of the robot's links, in order.
    pub collision_pairs: Arc<Vec<LinkPair>>,
}

/// Settings of a joint; for a planar joint those of its first axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointSettings {
    /// Limits in force.
    pub limits: JointLimits,
    /// Damping, N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction, N m or N.
    pub friction: f64,
    /// Armature, kg m^2 or kg.
    pub armature: f64,
    /// Stiffness of a spring in addition to the actuator, N m/rad or N/m, and its rest position, rad or m.
    /// Stiffness 0 means that there is none.
    pub spring: (f64, f64),
    /// Stiffness and damping of targets that have none.
    pub default_gains: (f64, f64),
    /// Whether its actuator holds the weight of its load.
    pub gravity_compensation: bool,
    /// Whether its setpoint follows a velocity profile on its way to a position target.
    pub profile: bool,
    /// Holder of a claim on it.
    pub claimed_by: Option<Arc<str>>,
}

impl Entity {
    /// Returns the present settings.
    pub(super) fn robot_settings(&self) -> RobotSettings {
        RobotSettings {
            joints: (0..self.model.joints.len()).map(|joint| self.joint_settings(joint)).collect(),
            surfaces: (0..self.model.links.len()).map(|link| self.colliders.surface(link)).collect(),
            self_collision: self.state.contact_settings.self_collision,
            stays_awake: self.state.contact_settings.stays_awake,
            groups: self.state.groups.clone(),
            link_damping: self.state.link_damping.clone(),
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
            profile: !settings.is_direct,
            gravity_compensation: settings.gravity_compensation,
            claimed_by: self.claims.of_joint(joint).map(|claim| Arc::clone(&claim.holder)),
        }
    }
}

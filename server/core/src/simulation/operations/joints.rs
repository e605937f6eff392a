//! Resets and settings of joints.

use std::sync::Arc;

use simd_model::robot::JointLimits;

use crate::dynamics::spherical::write_orientation;
use crate::dynamics::tree::JointType;
use crate::dynamics::{Actuator, Mode};
use crate::simulation::command::{JointProperties, JointReset, RobotReset, SphericalReset};
use crate::simulation::entity::{Entity, apply_mimic_velocities, apply_mimics};
use crate::simulation::error::Error;
use crate::simulation::{Reply, Simulation, check};

impl Simulation {
    pub(in crate::simulation) fn reset_joints(&mut self, robots: &[RobotReset]) -> Result<Reply, Error> {
        /// A robot, a joint, the location of its numbers, and the numbers.
        type Put = (usize, usize, (usize, usize), NewState);
        let mut puts: Vec<Put> = Vec::new();
        let mut whole = Vec::new();
        for (robot, reset) in robots.iter().enumerate() {
            let robot_index = self.robot_index(&reset.robot)?;
            let entity = &self.entities[robot_index];
            if reset.joints.is_empty() {
                whole.push(robot_index);
            }
            for (number, joint) in reset.joints.iter().enumerate() {
                let name = &joint.joint;
                let within = |error: Error| {
                    error
                        .within(|| format!("robots[{robot}].joints[{number}]"))
                        .of(|| format!("joint {name:?}"))
                };
                let index = entity.joint(name)?;
                let body = entity.axis_body(index, joint.axis).map_err(within)?;
                let body = &entity.body.tree().bodies[body];
                let new_state = new_state(joint, entity.is_spherical(index)).map_err(within)?;
                puts.push((robot_index, index, (body.position, body.velocity), new_state));
            }
        }
        for &robot_index in &whole {
            self.cancel_trajectories(robot_index, None, "a reset of the joints");
            let entity = &mut self.entities[robot_index];
            let (p, v) = (entity.body.tree().root_positions(), entity.body.tree().root_velocities());
            entity.body.positions_mut()[p..].copy_from_slice(&entity.state.spawned.positions[p..]);
            entity.body.velocities_mut()[v..].fill(0.0);
        }
        for &(robot_index, joint, (position, velocity), new_state) in &puts {
            self.cancel_trajectories(robot_index, Some(&[joint]), "a reset of the joints");
            let body = &mut self.entities[robot_index].body;
            match new_state {
                NewState::Axis(q, qd) => {
                    body.positions_mut()[position] = q;
                    body.velocities_mut()[velocity] = qd;
                }
                NewState::Ball(SphericalReset { orientation, angular_velocity }) => {
                    write_orientation(&mut body.positions_mut()[position..], orientation);
                    let velocities = &mut body.velocities_mut()[velocity..velocity + 3];
                    velocities.copy_from_slice(&angular_velocity.to_array());
                }
            }
        }
        let mut touched: Vec<usize> = whole.into_iter().chain(puts.iter().map(|put| put.0)).collect();
        touched.sort_unstable();
        touched.dedup();
        for robot_index in touched {
            self.entities[robot_index].settle_after_reset();
            self.wake_around(robot_index);
            self.contacts.forget(robot_index);
            self.constraints.forget_motion(Some(robot_index));
        }
        Ok(Reply::Done)
    }

    pub(in crate::simulation) fn set_joint_properties(
        &mut self,
        robot: &str,
        joints: &[JointProperties],
    ) -> Result<Reply, Error> {
        let robot_index = self.robot_index(robot)?;
        let entity = &mut self.entities[robot_index];
        let mut accepted = Vec::new();
        for (number, properties) in joints.iter().enumerate() {
            let name = &properties.joint;
            let within =
                |error: Error| error.within(|| format!("joints[{number}]")).of(|| format!("joint {name:?}"));
            let index = entity.joint(name)?;
            entity.axis_body(index, 0)?;
            check_properties(properties).map_err(within)?;
            let has_range = |limits: &JointLimits| limits.lower.is_some() || limits.upper.is_some();
            let is_ball = entity.is_spherical(index);
            if is_ball && properties.limits.as_ref().is_some_and(has_range) {
                let expected = "a spherical joint has no limits of its position";
                return Err(within(check::refuse("limits", "a range", expected)));
            }
            if is_ball && properties.spring.is_some_and(|(_, rest)| rest != 0.0) {
                let expected = "the spring of a spherical joint rests at the orientation 0 0 0 1";
                return Err(within(check::refuse("spring.rest", "a rest", expected)));
            }
            let has_one_axis = entity.body.tree().joints[index].len() == 1;
            if properties.spring.is_some() && !is_ball && !has_one_axis {
                let expected = "only a joint of one axis and a spherical joint can have one";
                return Err(within(check::refuse("spring", "a spring", expected)));
            }
            accepted.push((index, properties));
        }
        for (index, properties) in accepted {
            for body in entity.body.tree().joints[index].clone() {
                let velocity = entity.body.tree().bodies[body].velocity;
                change(&mut entity.body.axes_mut()[velocity].settings, properties);
            }
        }
        self.settings_changed(robot_index);
        Ok(Reply::Done)
    }
}

impl Entity {
    /// Updates the robot after its positions were set: followers follow, holding joints hold the new
    /// position, and the next step starts without history.
    pub(in crate::simulation) fn settle_after_reset(&mut self) {
        let tree = Arc::clone(self.body.tree());
        apply_mimics(&tree, self.body.positions_mut());
        apply_mimic_velocities(&tree, self.body.velocities_mut());
        self.settle_setpoints();
        self.body.forget_last_step();
        self.state.disabled = None;
        self.state.teleported = true;
        self.update_external_forces();
    }

    /// Moves setpoints to the joints' positions.
    pub(in crate::simulation) fn settle_setpoints(&mut self) {
        let tree = Arc::clone(self.body.tree());
        for (index, body) in tree.bodies.iter().enumerate() {
            if matches!(body.joint_type, JointType::Free { .. }) {
                continue;
            }
            let position = tree.position_of_axis(index, self.body.positions());
            let velocity = self.body.velocities()[body.velocity];
            let actuator = &mut self.body.axes_mut()[body.velocity].actuator;
            match actuator.mode {
                Mode::Hold => *actuator = Actuator::hold(position, velocity),
                Mode::Position => (actuator.setpoint, actuator.setpoint_velocity) = (position, velocity),
                Mode::None | Mode::Passive | Mode::Velocity | Mode::Effort => {}
            }
        }
    }
}

/// New state of a joint.
#[derive(Clone, Copy)]
enum NewState {
    /// Position and velocity of an axis.
    Axis(f64, f64),
    /// State of a ball joint.
    Ball(SphericalReset),
}

/// Returns the requested state, validated.
fn new_state(joint: &JointReset, is_spherical: bool) -> Result<NewState, Error> {
    match (joint.spherical, is_spherical) {
        (None, false) => {
            let position = check::moderate("position", joint.position)?;
            Ok(NewState::Axis(position, check::moderate("velocity", joint.velocity)?))
        }
        (Some(_), true) if joint.axis != 0 => {
            Err(check::refuse("axis", joint.axis, "a spherical joint is set as a whole: it must be 0"))
        }
        (Some(reset), true) => {
            let orientation = check::orientation("spherical.orientation", reset.orientation)?;
            for (axis, value) in ["x", "y", "z"].into_iter().zip(reset.angular_velocity.to_array()) {
                check::moderate(&format!("spherical.angular_velocity.{axis}"), value)?;
            }
            Ok(NewState::Ball(SphericalReset { orientation, ..reset }))
        }
        (None, true) => Err(check::refuse(
            "position",
            joint.position,
            "a spherical joint is set to an orientation: give `spherical`",
        )),
        (Some(_), false) => {
            Err(check::refuse("spherical", "an orientation", "the joint is not spherical: give a position"))
        }
    }
}

/// Checks the given settings.
fn check_properties(properties: &JointProperties) -> Result<(), Error> {
    let JointProperties {
        joint: _,
        damping,
        friction,
        armature,
        spring,
        limits,
        default_gains,
        gravity_compensation: _,
        profile: _,
    } = properties;
    check::optional_at_least_zero("damping", *damping)?;
    check::optional_at_least_zero("friction", *friction)?;
    check::optional_at_least_zero("armature", *armature)?;
    if let Some((stiffness, rest)) = *spring {
        check::gain("spring.stiffness", Some(stiffness))?;
        check::moderate("spring.rest", rest)?;
    }
    let (stiffness, damping) = default_gains.unzip();
    check::gain("default_gains.stiffness", stiffness)?;
    check::gain("default_gains.damping", damping)?;
    limits.as_ref().map_or(Ok(()), check::limits)
}

/// Writes the given settings.
fn change(settings: &mut crate::dynamics::actuator::AxisSettings, properties: &JointProperties) {
    let JointProperties {
        joint: _,
        damping,
        friction,
        armature,
        spring,
        limits,
        default_gains,
        gravity_compensation,
        profile,
    } = properties;
    if let Some(damping) = damping {
        settings.damping = *damping;
    }
    if let Some(friction) = friction {
        settings.friction = *friction;
    }
    if let Some(armature) = armature {
        settings.composite_inertia += armature - settings.armature;
        settings.armature = *armature;
    }
    if let Some(spring) = spring {
        (settings.spring_stiffness, settings.spring_rest) = *spring;
    }
    if let Some(limits) = limits {
        settings.limits = *limits;
    }
    if let Some((stiffness, damping)) = default_gains {
        (settings.default_stiffness, settings.default_damping) = (*stiffness, *damping);
        // Gains of a description hold for all modes, until there are others.
        settings.velocity_damping = settings.velocity_damping.and(Some(*damping).filter(|gain| *gain > 0.0));
    }
    if let Some(compensated) = gravity_compensation {
        settings.gravity_compensation = *compensated;
    }
    if let Some(profile) = profile {
        settings.is_direct = !*profile;
    }
}

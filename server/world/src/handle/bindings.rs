//! Sliders that are bound to joints: their bindings, and the targets that their moves set.

use std::sync::Arc;

use simd_core::Error;
use simd_core::simulation::command::{Command, JointTarget, RobotTargets, SetTargets, Target};
use simd_model::robot::JointKind;

use super::parameters::checked_change;
use super::{CallError, NameTaken, Parameter, ParameterChange, ParameterKind, SimHandle};

/// Quantity of a joint that a slider sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundQuantity {
    /// Position, rad or m.
    Position,
    /// Velocity, rad/s or m/s.
    Velocity,
    /// Effort, N m or N.
    Effort,
}

/// A joint whose target a slider sets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JointBinding {
    /// Name of the robot.
    pub robot: String,
    /// Name of the joint.
    pub joint: String,
    /// Axis of a planar joint: 0 x, 1 y, 2 angle. Otherwise 0.
    pub axis: u32,
    /// Quantity of the slider's value.
    pub quantity: BoundQuantity,
}

impl JointBinding {
    fn target(&self, value: f64) -> JointTarget {
        let target = match self.quantity {
            BoundQuantity::Position => Target::position(value),
            BoundQuantity::Velocity => Target::velocity(value),
            BoundQuantity::Effort => Target::Effort(value),
        };
        JointTarget { joint: self.joint.clone(), axis: self.axis, target }
    }
}

impl SimHandle {
    /// Adds a slider that sets the target of a joint each time it is moved.
    ///
    /// # Errors
    /// As [`add_parameter`](Self::add_parameter). Also if the robot or the joint does not exist, the joint
    /// has no actuator, or the parameter is a button.
    pub fn add_bound_slider(
        &self,
        name: &str,
        kind: ParameterKind,
        binding: JointBinding,
        taken: NameTaken,
    ) -> Result<Parameter, CallError> {
        if !matches!(kind, ParameterKind::Slider { .. }) {
            return Err(CallError::InvalidValue {
                element: "parameter.joint".into(),
                value: "of a button".into(),
                expected: "it must be a slider that sets a joint's target".into(),
            });
        }
        self.check_robots(Some(&[&binding.robot]))?;
        self.check_binding(&binding)?;
        self.put_up(name, kind, Some(Arc::new(binding)), taken)
    }

    /// Moves sliders and presses buttons: all or none. Before that, it sets the targets of joints bound to
    /// the sliders. Returns the named parameters as they are now.
    ///
    /// # Errors
    /// As [`set_parameters`](Self::set_parameters), and if the world refuses the targets; then nothing is
    /// moved.
    pub async fn move_parameters(&self, changes: &[ParameterChange]) -> Result<Vec<Parameter>, CallError> {
        let robots = self.bound_targets(changes)?;
        if !robots.is_empty() {
            let source = Some(self.target_source());
            self.command(Command::SetTargets(SetTargets { robots, source, ..SetTargets::default() })).await?;
        }
        self.set_parameters(changes)
    }

    /// Returns the targets of the sliders that these changes move, in the order of the changes. Each change
    /// is checked.
    fn bound_targets(&self, changes: &[ParameterChange]) -> Result<Vec<RobotTargets>, CallError> {
        let list = self.parameters();
        let mut robots: Vec<RobotTargets> = Vec::new();
        for (index, change) in changes.iter().enumerate() {
            let parameter = list.find(change.name())?;
            checked_change(parameter, change, index)?;
            let (Some(binding), ParameterChange::Move { value, .. }) = (&parameter.binding, change) else {
                continue;
            };
            let robot = robots.iter().position(|robot| robot.robot == binding.robot).unwrap_or_else(|| {
                robots.push(RobotTargets { robot: binding.robot.clone(), ..RobotTargets::default() });
                robots.len() - 1
            });
            robots[robot].joints.push(binding.target(*value));
        }
        Ok(robots)
    }

    fn check_binding(&self, binding: &JointBinding) -> Result<(), CallError> {
        let newest = self.newest();
        let JointBinding { robot, joint, axis, quantity: _ } = binding;
        let Some((_, entity)) = newest.state.entity(robot) else {
            let known = newest.state.world.entities.iter().map(|entity| entity.name.clone()).collect();
            return Err(Error::RobotNotFound { robot: robot.clone(), known }.into());
        };
        let joints = &entity.model.joints;
        let (robot, joint) = (robot.clone(), joint.clone());
        let Some(found) = joints.iter().find(|known| known.name == joint) else {
            let known = joints.iter().map(|joint| joint.name.clone()).collect();
            return Err(Error::JointNotFound { robot, joint, known }.into());
        };
        let why = match (found.kind, found.mimic) {
            (JointKind::Fixed, _) => Some("is fixed"),
            (JointKind::Floating, _) => Some("is floating"),
            (_, Some(_)) => Some("follows another joint"),
            _ => None,
        };
        if let Some(why) = why {
            return Err(Error::JointNotActuated { robot, joint, why: why.into() }.into());
        }
        let axes = if found.kind == JointKind::Planar { 3 } else { 1 };
        if *axis >= axes {
            return Err(CallError::InvalidValue {
                element: "parameter.joint.axis".into(),
                value: axis.to_string(),
                expected: format!("it must be below {axes} for joint {joint:?}"),
            });
        }
        Ok(())
    }
}

//! Answers of the parameter service.

use simd_proto::v1;

use super::stamp;
use simd_world::handle::{BoundQuantity, JointBinding, Parameter, ParameterKind, Published};

/// Converts a slider or a button.
pub fn parameter(parameter: &Parameter) -> v1::Parameter {
    let kind = match parameter.kind {
        ParameterKind::Slider { minimum, maximum, value } => {
            v1::parameter::Kind::Slider(v1::Slider { minimum, maximum, value })
        }
        ParameterKind::Button { presses } => v1::parameter::Kind::Button(v1::Button { presses }),
    };
    let Parameter { name, version, owner, binding, kind: _ } = parameter;
    v1::Parameter {
        name: name.to_string(),
        kind: Some(kind),
        version: *version,
        owner: owner.to_string(),
        joint: binding.as_deref().map(joint),
    }
}

fn joint(binding: &JointBinding) -> v1::JointBinding {
    let mode = match binding.quantity {
        BoundQuantity::Position => v1::JointMode::Position,
        BoundQuantity::Velocity => v1::JointMode::Velocity,
        BoundQuantity::Effort => v1::JointMode::Effort,
    };
    let JointBinding { robot, joint, axis, quantity: _ } = binding;
    v1::JointBinding { robot: robot.clone(), joint: joint.clone(), axis: *axis, mode: mode.into() }
}

/// Converts a list of parameters, as it was at this state of the world.
pub fn list<'a>(
    version: u64,
    parameters: impl IntoIterator<Item = &'a Parameter>,
    newest: &Published,
) -> v1::ParameterList {
    v1::ParameterList {
        version,
        parameters: parameters.into_iter().map(parameter).collect(),
        stamp: Some(stamp::published(newest)),
    }
}

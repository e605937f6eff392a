//! Answers of the parameter service.

use simd_proto::v1;

use super::stamp;
use crate::handle::{Parameter, ParameterKind, Published};

/// A slider or a button.
pub fn parameter(parameter: &Parameter) -> v1::Parameter {
    let kind = match parameter.kind {
        ParameterKind::Slider { minimum, maximum, value } => {
            v1::parameter::Kind::Slider(v1::Slider { minimum, maximum, value })
        }
        ParameterKind::Button { presses } => v1::parameter::Kind::Button(v1::Button { presses }),
    };
    let Parameter { name, version, owner, kind: _ } = parameter;
    v1::Parameter { name: name.to_string(), kind: Some(kind), version: *version, owner: owner.to_string() }
}

/// Some of a list, as it was beside this state of the world.
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

//! Requests of the parameter service.

use std::time::Duration;

use simd_proto::v1;

use crate::convert::field::{BadField, Path};
use simd_world::handle::{BoundQuantity, JointBinding, NameTaken, ParameterChange, ParameterKind};

/// Request to add a parameter.
#[derive(Debug)]
pub struct Added {
    /// Name of the parameter.
    pub name: String,
    /// Kind of the parameter.
    pub kind: ParameterKind,
    /// Joint that the parameter is bound to.
    pub binding: Option<JointBinding>,
    /// Policy if the name is taken.
    pub taken: NameTaken,
}

/// Parses a parameter to add.
pub fn add(request: v1::AddParameterRequest) -> Result<Added, BadField> {
    let at = Path::ROOT.field("parameter");
    let parameter = at.given(request.parameter)?;
    let name = parameter.name;
    let kind = match at.field("kind").given(parameter.kind)? {
        v1::parameter::Kind::Slider(slider) => {
            let v1::Slider { minimum, maximum, value } = slider;
            ParameterKind::Slider { minimum, maximum, value }
        }
        v1::parameter::Kind::Button(button) => ParameterKind::Button { presses: button.presses },
    };
    let binding = parameter.joint.map(|joint| binding(&at.field("joint"), joint)).transpose()?;
    let taken = match Path::ROOT.field("name_taken").known(request.name_taken)? {
        v1::NameTakenPolicy::Unspecified | v1::NameTakenPolicy::Refuse => NameTaken::Refuse,
        v1::NameTakenPolicy::Replace => NameTaken::Replace,
        v1::NameTakenPolicy::Rename => NameTaken::Rename,
    };
    Ok(Added { name, kind, binding, taken })
}

fn binding(at: &Path<'_>, given: v1::JointBinding) -> Result<JointBinding, BadField> {
    let v1::JointBinding { robot, joint, axis, mode } = given;
    let mode_at = at.field("mode");
    let quantity = match mode_at.known(mode)? {
        v1::JointMode::Unspecified | v1::JointMode::Position => BoundQuantity::Position,
        v1::JointMode::Velocity => BoundQuantity::Velocity,
        v1::JointMode::Effort => BoundQuantity::Effort,
        mode @ (v1::JointMode::Passive | v1::JointMode::Hold | v1::JointMode::None) => {
            return Err(mode_at.refuse(mode.as_str_name(), "it must be POSITION, VELOCITY or EFFORT"));
        }
    };
    let (robot, joint) = (at.field("robot").name(robot)?, at.field("joint").name(joint)?);
    Ok(JointBinding { robot, joint, axis, quantity })
}

/// Parses new values of sliders, and buttons to press.
pub fn changes(given: Vec<v1::ParameterChange>) -> Result<Vec<ParameterChange>, BadField> {
    if given.is_empty() {
        return Err(Path::ROOT.field("changes").refuse("empty", "it must name at least one parameter"));
    }
    Path::ROOT.each_once("changes", given.iter().map(|change| &change.name))?;
    given
        .into_iter()
        .enumerate()
        .map(|(index, given)| {
            let at = Path::ROOT.item("changes", index);
            let name = at.field("name").name(given.name)?;
            match at.field("change").given(given.change)? {
                v1::parameter_change::Change::Value(value) => Ok(ParameterChange::Move { name, value }),
                v1::parameter_change::Change::Presses(0) => {
                    Err(at.field("presses").refuse(0, "it must be at least 1"))
                }
                v1::parameter_change::Change::Presses(times) => Ok(ParameterChange::Press { name, times }),
            }
        })
        .collect()
}

/// Parses names of parameters; an empty list means all.
pub fn names(given: Vec<String>) -> Result<Vec<String>, BadField> {
    Path::ROOT.each_once("names", &given)?;
    let named = |(index, name)| Path::ROOT.item("names", index).name(name);
    given.into_iter().enumerate().map(named).collect()
}

/// Returns the longest wait of NextParameters for another version.
pub fn next_timeout(seconds: f64) -> Result<Duration, BadField> {
    Path::ROOT.field("timeout").seconds(seconds, 0.0..=60.0, 1.0)
}

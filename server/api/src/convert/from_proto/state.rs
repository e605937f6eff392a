//! Requests for joint states over time: selected joints, frequency of messages, waits.

use std::time::Duration;

use simd_core::simulation::command::JointSelection;
use simd_proto::v1;

use crate::convert::field::{BadField, Path};

/// Wall seconds above any daemon's life; keeps arithmetic on times in range.
const MAX_WAIT: f64 = 1e9;

/// Time at which a Control request is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// As soon as there is a newer state.
    NewerState,
    /// At once.
    None,
}

/// Parses a selection of joints. A robot or a joint named twice is refused, so that no answer is larger than
/// the world.
pub fn selections(given: Vec<v1::JointSelection>) -> Result<Vec<JointSelection>, BadField> {
    let mut out = Vec::with_capacity(given.len());
    for (index, selection) in given.into_iter().enumerate() {
        let at = Path::ROOT.item("selections", index);
        let robot = at.field("robot").name(selection.robot)?;
        let joints = selection
            .joints
            .into_iter()
            .enumerate()
            .map(|(index, joint)| at.item("joints", index).name(joint))
            .collect::<Result<Vec<_>, _>>()?;
        at.each_once("joints", &joints)?;
        out.push(JointSelection { robot, joints });
    }
    Path::ROOT.each_once("selections", out.iter().map(|selection| &selection.robot))?;
    Ok(out)
}

/// Parses when to answer.
pub fn wait(number: i32) -> Result<Wait, BadField> {
    Ok(match Path::ROOT.field("wait").known(number)? {
        v1::ControlWait::Unspecified | v1::ControlWait::NewerState => Wait::NewerState,
        v1::ControlWait::None => Wait::None,
    })
}

/// Returns the longest wait of Control for a newer state; `None` means no limit.
pub fn control_timeout(seconds: f64) -> Result<Option<Duration>, BadField> {
    let timeout = Path::ROOT.field("timeout").seconds(seconds, 0.0..=MAX_WAIT, 0.0)?;
    Ok((!timeout.is_zero()).then_some(timeout))
}

/// Returns the longest wait of NextJointStates for a newer state.
pub fn next_timeout(seconds: f64) -> Result<Duration, BadField> {
    Path::ROOT.field("timeout").seconds(seconds, 0.0..=60.0, 1.0)
}

/// Returns the time between two states of WatchJointStates.
pub fn period(rate: f64) -> Result<Duration, BadField> {
    let at = Path::ROOT.field("rate");
    let rate = if rate == 0.0 { 30.0 } else { at.within(rate, 0.1..=1000.0)? };
    Ok(Duration::from_secs_f64(1.0 / rate))
}

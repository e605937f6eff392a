//! Requests that change joints: targets, resets, properties, claims.

use std::time::Duration;

use simd_core::Command;
use simd_core::simulation::command::{
    JointProperties, JointReset, JointSelection, JointTarget, RobotReset, RobotTargets, SetTargets, Target,
    WholeTarget,
};
use simd_model::robot::JointLimits;
use simd_proto::v1;

use super::state;
use crate::convert::field::{BadField, Path};

/// Targets, and the claim that they are said to be set with: whether their sender holds it is not known here.
#[derive(Debug)]
pub struct Claimed {
    /// Without a claim.
    pub targets: SetTargets,
    /// As the request has it; empty for none.
    pub claim: String,
}

/// Targets for joints of one or several robots.
pub fn set_targets(
    robots: Vec<v1::RobotTargets>,
    limit_policy: i32,
    claim: String,
) -> Result<Claimed, BadField> {
    let refuse_beyond_limits = match Path::ROOT.field("limit_policy").known(limit_policy)? {
        v1::LimitPolicy::Unspecified | v1::LimitPolicy::Clamp => false,
        v1::LimitPolicy::Refuse => true,
    };
    let robots = robots
        .into_iter()
        .enumerate()
        .map(|(index, robot)| robot_targets(&Path::ROOT.item("robots", index), robot))
        .collect::<Result<_, _>>()?;
    let claim = Path::ROOT.field("claim").short(claim)?;
    Ok(Claimed { targets: SetTargets { robots, refuse_beyond_limits, ..SetTargets::default() }, claim })
}

/// Targets of a request that is about nothing else.
pub fn set_joint_targets(request: v1::SetJointTargetsRequest) -> Result<Claimed, BadField> {
    if request.robots.is_empty() {
        return Err(Path::ROOT.field("robots").refuse("empty", "it must name at least one robot"));
    }
    set_targets(request.robots, request.limit_policy, request.claim)
}

fn robot_targets(at: &Path<'_>, given: v1::RobotTargets) -> Result<RobotTargets, BadField> {
    let robot = at.field("robot").name(given.robot)?;
    let whole = given.whole.map(|whole| whole_target(&at.field("whole"), whole)).transpose()?;
    let joints = given
        .joints
        .into_iter()
        .enumerate()
        .map(|(index, target)| joint_target(&at.item("joints", index), target))
        .collect::<Result<Vec<_>, _>>()?;
    at.each_once("joints", joints.iter().map(|target| (&target.joint, target.axis)))?;
    Ok(RobotTargets { robot, layout_version: given.layout_version, whole, joints })
}

fn whole_target(at: &Path<'_>, whole: v1::WholeRobotTarget) -> Result<WholeTarget, BadField> {
    for (index, value) in whole.values.iter().enumerate() {
        at.item("values", index).finite(*value)?;
    }
    let mode_at = at.field("mode");
    let target = match mode_at.known(whole.mode)? {
        v1::JointMode::Position => return Ok(WholeTarget::Position(whole.values)),
        v1::JointMode::Velocity => return Ok(WholeTarget::Velocity(whole.values)),
        v1::JointMode::Effort => return Ok(WholeTarget::Effort(whole.values)),
        v1::JointMode::Passive => WholeTarget::Passive,
        v1::JointMode::Hold => WholeTarget::Hold,
        mode @ (v1::JointMode::Unspecified | v1::JointMode::None) => {
            let expected = "it must be POSITION, VELOCITY, EFFORT, PASSIVE or HOLD";
            return Err(mode_at.refuse(mode.as_str_name(), expected));
        }
    };
    if whole.values.is_empty() {
        Ok(target)
    } else {
        let count = format!("{} values", whole.values.len());
        Err(at.field("values").refuse(count, "it must be empty for PASSIVE and HOLD"))
    }
}

fn joint_target(at: &Path<'_>, given: v1::JointTarget) -> Result<JointTarget, BadField> {
    let joint = at.field("joint").name(given.joint)?;
    let axis = axis(at, given.axis)?;
    let given = at.field("target").given(given.target)?;
    let target = target(at, given).map_err(|bad| bad.of_joint(&joint))?;
    Ok(JointTarget { joint, axis, target })
}

fn target(at: &Path<'_>, given: v1::joint_target::Target) -> Result<Target, BadField> {
    Ok(match given {
        v1::joint_target::Target::Position(target) => position_target(&at.field("position"), &target)?,
        v1::joint_target::Target::Velocity(target) => velocity_target(&at.field("velocity"), &target)?,
        v1::joint_target::Target::Effort(target) => {
            let at = at.field("effort");
            Target::Effort(at.field("effort").finite(target.effort)?)
        }
        v1::joint_target::Target::Passive(v1::PassiveTarget {}) => Target::Passive,
        v1::joint_target::Target::Hold(v1::HoldTarget {}) => Target::Hold,
    })
}

fn position_target(at: &Path<'_>, given: &v1::PositionTarget) -> Result<Target, BadField> {
    Ok(Target::Position {
        position: at.field("position").finite(given.position)?,
        velocity: at.field("velocity").finite(given.velocity)?,
        stiffness: optional_at_least_zero(at, "stiffness", given.stiffness)?,
        damping: optional_at_least_zero(at, "damping", given.damping)?,
        feed_forward: at.field("feed_forward_effort").finite(given.feed_forward_effort)?,
        max_effort: optional_at_least_zero(at, "max_effort", given.max_effort)?,
        max_velocity: optional_at_least_zero(at, "max_velocity", given.max_velocity)?,
    })
}

fn velocity_target(at: &Path<'_>, given: &v1::VelocityTarget) -> Result<Target, BadField> {
    Ok(Target::Velocity {
        velocity: at.field("velocity").finite(given.velocity)?,
        damping: optional_at_least_zero(at, "damping", given.damping)?,
        feed_forward: at.field("feed_forward_effort").finite(given.feed_forward_effort)?,
        max_effort: optional_at_least_zero(at, "max_effort", given.max_effort)?,
    })
}

fn axis(at: &Path<'_>, axis: u32) -> Result<u32, BadField> {
    if axis > 2 {
        return Err(at.field("axis").refuse(axis, "it must be 0 (x), 1 (y) or 2 (angle)"));
    }
    Ok(axis)
}

fn optional_at_least_zero(at: &Path<'_>, name: &str, value: Option<f64>) -> Result<Option<f64>, BadField> {
    value.map(|value| at.field(name).at_least_zero(value)).transpose()
}

/// Joints to be put at a position and a rate.
pub fn reset_joints(request: v1::ResetJointsRequest) -> Result<Command, BadField> {
    if request.robots.is_empty() {
        return Err(Path::ROOT.field("robots").refuse("empty", "it must name at least one robot"));
    }
    let robots = request
        .robots
        .into_iter()
        .enumerate()
        .map(|(index, robot)| robot_reset(&Path::ROOT.item("robots", index), robot))
        .collect::<Result<_, _>>()?;
    Ok(Command::ResetJoints { robots })
}

fn robot_reset(at: &Path<'_>, given: v1::RobotReset) -> Result<RobotReset, BadField> {
    let robot = at.field("robot").name(given.robot)?;
    let mut joints = Vec::with_capacity(given.joints.len());
    for (index, reset) in given.joints.into_iter().enumerate() {
        let at = at.item("joints", index);
        let joint = at.field("joint").name(reset.joint)?;
        let finite = |name, value| at.field(name).finite(value).map_err(|bad| bad.of_joint(&joint));
        let (position, velocity) = (finite("position", reset.position)?, finite("velocity", reset.velocity)?);
        joints.push(JointReset { axis: axis(&at, reset.axis)?, joint, position, velocity });
    }
    at.each_once("joints", joints.iter().map(|reset| (&reset.joint, reset.axis)))?;
    Ok(RobotReset { robot, joints })
}

/// New settings of joints.
pub fn set_joint_properties(request: v1::SetJointPropertiesRequest) -> Result<Command, BadField> {
    let robot = Path::ROOT.field("robot").name(request.robot)?;
    if request.joints.is_empty() {
        return Err(Path::ROOT.field("joints").refuse("empty", "it must name at least one joint"));
    }
    let joints = request
        .joints
        .into_iter()
        .enumerate()
        .map(|(index, given)| joint_properties(&Path::ROOT.item("joints", index), given))
        .collect::<Result<Vec<_>, _>>()?;
    Path::ROOT.each_once("joints", joints.iter().map(|properties| &properties.joint))?;
    Ok(Command::SetJointProperties { robot, joints })
}

fn joint_properties(at: &Path<'_>, given: v1::JointProperties) -> Result<JointProperties, BadField> {
    let joint = at.field("joint").name(given.joint)?;
    let default_gains = match given.default_gains {
        None => None,
        Some(gains) => {
            let at = at.field("default_gains");
            Some((
                at.field("stiffness").at_least_zero(gains.stiffness)?,
                at.field("damping").at_least_zero(gains.damping)?,
            ))
        }
    };
    Ok(JointProperties {
        joint,
        damping: optional_at_least_zero(at, "damping", given.damping)?,
        friction: optional_at_least_zero(at, "friction", given.friction)?,
        armature: optional_at_least_zero(at, "armature", given.armature)?,
        limits: given.limits.map(|given| limits(&at.field("limits"), &given)).transpose()?,
        default_gains,
    })
}

fn limits(at: &Path<'_>, given: &v1::JointLimits) -> Result<JointLimits, BadField> {
    let finite = |name, value: Option<f64>| value.map(|value| at.field(name).finite(value)).transpose();
    let limits = JointLimits {
        lower: finite("lower", given.lower)?,
        upper: finite("upper", given.upper)?,
        effort: optional_at_least_zero(at, "effort", given.effort)?,
        velocity: optional_at_least_zero(at, "velocity", given.velocity)?,
    };
    match (limits.lower, limits.upper) {
        (Some(lower), Some(upper)) if lower > upper => {
            Err(at.field("lower").refuse(lower, format!("it must be at most the upper limit, {upper}")))
        }
        _ => Ok(limits),
    }
}

/// Which joints are claimed, by whom, for how long.
pub fn claim_joints(
    request: v1::ClaimJointsRequest,
) -> Result<(Vec<JointSelection>, String, Duration), BadField> {
    if request.selections.is_empty() {
        return Err(Path::ROOT.field("selections").refuse("empty", "it must name at least one robot"));
    }
    let selections = state::selections(request.selections)?;
    let holder = Path::ROOT.field("holder").name(request.holder)?;
    let lease = Path::ROOT.field("lease").seconds(request.lease, 0.1..=3600.0, 10.0)?;
    Ok((selections, holder, lease))
}

/// A claim that must be named.
pub fn claim(request: &v1::ReleaseJointsRequest) -> Result<String, BadField> {
    Path::ROOT.field("claim").name(request.claim.clone())
}

/// The robot whose joints are asked for.
pub fn layout_of(request: v1::GetJointLayoutRequest) -> Result<String, BadField> {
    Path::ROOT.field("robot").name(request.robot)
}

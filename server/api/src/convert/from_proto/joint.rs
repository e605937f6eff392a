//! Requests that change joints: targets, resets, properties, claims.

use std::sync::Arc;
use std::time::Duration;

use glamx::DQuat;
use simd_core::Command;
use simd_core::simulation::command::{
    Begin, ClaimId, ClaimRequest, FollowTrajectory, JointProperties, JointReset, JointTarget, RobotReset,
    RobotTargets, SetTargets, SphericalReset, Target, Tolerance, TrajectoryPoint, WholeTarget,
};
use simd_model::robot::JointLimits;
use simd_proto::v1;

use super::{geometry, state};
use crate::convert::field::{BadField, Path};

/// Parses targets for joints of one or several robots.
pub fn set_targets(robots: Vec<v1::RobotTargets>, limit_policy: i32) -> Result<SetTargets, BadField> {
    let refuse_beyond_limits = match Path::ROOT.field("limit_policy").known(limit_policy)? {
        v1::LimitPolicy::Unspecified | v1::LimitPolicy::Clamp => false,
        v1::LimitPolicy::Refuse => true,
    };
    let robots = robots
        .into_iter()
        .enumerate()
        .map(|(index, robot)| robot_targets(&Path::ROOT.item("robots", index), robot))
        .collect::<Result<_, _>>()?;
    Ok(SetTargets { robots, refuse_beyond_limits, ..SetTargets::default() })
}

/// Parses the targets of a request that carries only targets.
pub fn set_joint_targets(request: v1::SetJointTargetsRequest) -> Result<SetTargets, BadField> {
    if request.robots.is_empty() {
        return Err(Path::ROOT.field("robots").refuse("empty", "it must name at least one robot"));
    }
    set_targets(request.robots, request.limit_policy)
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
    let target = target(at, at.field("target").given(given.target)?)?;
    Ok(JointTarget { joint, axis: given.axis, target })
}

fn target(at: &Path<'_>, given: v1::joint_target::Target) -> Result<Target, BadField> {
    Ok(match given {
        v1::joint_target::Target::Position(v1::PositionTarget {
            position,
            velocity,
            stiffness,
            damping,
            feed_forward_effort: feed_forward,
            max_effort,
            max_velocity,
        }) => Target::Position {
            position,
            velocity,
            stiffness,
            damping,
            feed_forward,
            max_effort,
            max_velocity,
        },
        v1::joint_target::Target::Velocity(v1::VelocityTarget {
            velocity,
            damping,
            feed_forward_effort: feed_forward,
            max_effort,
        }) => Target::Velocity { velocity, damping, feed_forward, max_effort },
        v1::joint_target::Target::Servo(v1::ServoTarget {
            position,
            rate,
            velocity,
            slip,
            damping,
            feed_forward_effort: feed_forward,
            max_effort,
            max_velocity,
        }) => {
            Target::Servo { position, rate, velocity, slip, damping, feed_forward, max_effort, max_velocity }
        }
        v1::joint_target::Target::Effort(v1::EffortTarget { effort }) => Target::Effort(effort),
        v1::joint_target::Target::Passive(v1::PassiveTarget {}) => Target::Passive,
        v1::joint_target::Target::Hold(v1::HoldTarget {}) => Target::Hold,
        v1::joint_target::Target::SphericalPosition(v1::SphericalPositionTarget {
            orientation,
            angular_velocity,
            stiffness,
            damping,
            feed_forward_torque,
            max_effort,
            max_velocity,
        }) => Target::Orientation {
            orientation: orientation_of(&at.field("spherical_position"), orientation)?,
            velocity: geometry::vector_or_zero(angular_velocity),
            stiffness,
            damping,
            feed_forward: geometry::vector_or_zero(feed_forward_torque),
            max_effort,
            max_velocity,
        },
        v1::joint_target::Target::SphericalVelocity(v1::SphericalVelocityTarget {
            angular_velocity,
            damping,
            feed_forward_torque,
            max_effort,
        }) => Target::AngularVelocity {
            velocity: geometry::vector_or_zero(angular_velocity),
            damping,
            feed_forward: geometry::vector_or_zero(feed_forward_torque),
            max_effort,
        },
        v1::joint_target::Target::SphericalEffort(v1::SphericalEffortTarget { torque }) => {
            Target::Torque(geometry::vector_or_zero(torque))
        }
    })
}

/// Parses the orientation of a spherical joint, which must be given.
fn orientation_of(at: &Path<'_>, given: Option<v1::Quaternion>) -> Result<DQuat, BadField> {
    let at = at.field("orientation");
    geometry::rotation(&at, at.given(given)?)
}

/// Parses a trajectory for joints of one robot.
pub fn follow_trajectory(request: v1::FollowTrajectoryRequest) -> Result<FollowTrajectory, BadField> {
    let v1::FollowTrajectoryRequest {
        robot,
        joints,
        points,
        queued,
        delay,
        path_tolerances,
        goal_tolerances,
        goal_time_tolerance,
        request_id: _,
        claim: _,
    } = request;
    let joints = joints
        .into_iter()
        .enumerate()
        .map(|(index, joint)| Path::ROOT.item("joints", index).name(joint))
        .collect::<Result<Vec<_>, _>>()?;
    let begin = match (queued, delay) {
        (true, 0.0) => Begin::Queued,
        (true, _) => {
            return Err(Path::ROOT.field("delay").refuse(delay, "it must be 0 if queued is given"));
        }
        (false, 0.0) => Begin::Now,
        (false, delay) => Begin::After(delay),
    };
    let mut tolerances = vec![[Tolerance::default(); 2]; joints.len()];
    for (kind, (field, given)) in
        [("path_tolerances", path_tolerances), ("goal_tolerances", goal_tolerances)].into_iter().enumerate()
    {
        for (index, v1::TrajectoryTolerance { joint, position, velocity }) in given.into_iter().enumerate() {
            let Some(known) = joints.iter().position(|known| *known == joint) else {
                let at = Path::ROOT.item(field, index);
                return Err(at.field("joint").refuse(format!("{joint:?}"), "it must be one of joints"));
            };
            tolerances[known][kind] = Tolerance { position, velocity };
        }
    }
    let points = points.into_iter().map(|point| {
        let v1::TrajectoryPoint { time, positions, velocities, accelerations, efforts } = point;
        TrajectoryPoint { time, positions, velocities, accelerations, efforts }
    });
    Ok(FollowTrajectory {
        robot: Path::ROOT.field("robot").name(robot)?,
        joints,
        points: Arc::new(points.collect()),
        begin,
        tolerances,
        goal_time_tolerance,
        source: None,
    })
}

/// Returns the robot whose trajectories are requested, or `None` for all robots.
pub fn trajectories_of(request: v1::ListTrajectoriesRequest) -> Result<Option<String>, BadField> {
    let v1::ListTrajectoriesRequest { robot } = request;
    if robot.is_empty() { Ok(None) } else { Path::ROOT.field("robot").name(robot).map(Some) }
}

/// Parses the cancellation of one or all trajectories of a robot.
pub fn cancel_trajectory(request: v1::CancelTrajectoryRequest) -> Result<Command, BadField> {
    let robot = Path::ROOT.field("robot").name(request.robot)?;
    Ok(Command::CancelTrajectory { robot, id: request.id })
}

/// Parses new positions and velocities of joints.
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
        let v1::JointReset { axis, position, velocity, spherical, joint: _ } = reset;
        let spherical = spherical.map(|given| spherical_reset(&at.field("spherical"), given)).transpose()?;
        joints.push(JointReset { axis, joint, position, velocity, spherical });
    }
    at.each_once("joints", joints.iter().map(|reset| (&reset.joint, reset.axis)))?;
    Ok(RobotReset { robot, joints })
}

fn spherical_reset(at: &Path<'_>, given: v1::SphericalReset) -> Result<SphericalReset, BadField> {
    let v1::SphericalReset { orientation, angular_velocity } = given;
    let angular_velocity = geometry::vector_or_zero(angular_velocity);
    Ok(SphericalReset { orientation: orientation_of(at, orientation)?, angular_velocity })
}

/// Parses new settings of joints.
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
    let v1::JointProperties {
        joint,
        damping,
        friction,
        armature,
        limits,
        default_gains,
        gravity_compensation,
        spring,
        profile,
    } = given;
    Ok(JointProperties {
        joint: at.field("joint").name(joint)?,
        damping,
        friction,
        armature,
        spring: spring.map(|v1::JointSpring { stiffness, rest }| (stiffness, rest)),
        limits: limits.map(|v1::JointLimits { lower, upper, effort, velocity }| JointLimits {
            lower,
            upper,
            effort,
            velocity,
        }),
        default_gains: default_gains.map(|v1::JointGains { stiffness, damping }| (stiffness, damping)),
        gravity_compensation,
        profile,
    })
}

/// Returns the claimed joints, the holder and the lease. The claim has no id yet.
pub fn claim_joints(request: v1::ClaimJointsRequest) -> Result<(ClaimRequest, Duration), BadField> {
    if request.selections.is_empty() && !request.world {
        let expected = "it must name at least one robot if the world is not claimed";
        return Err(Path::ROOT.field("selections").refuse("empty", expected));
    }
    let joints = state::selections(request.selections)?;
    let holder = Path::ROOT.field("holder").name(request.holder)?;
    let seconds = if request.lease == 0.0 { 10.0 } else { request.lease };
    let lease = Duration::try_from_secs_f64(seconds)
        .map_err(|_error| Path::ROOT.field("lease").refuse(seconds, "it must be a number of seconds"))?;
    let (world, priority, take_over) = (request.world, request.priority, request.take_over);
    Ok((ClaimRequest { claim: ClaimId::default(), holder, joints, world, priority, take_over }, lease))
}

/// Returns the claim to release, which must be named.
pub fn claim(request: &v1::ReleaseJointsRequest) -> Result<String, BadField> {
    Path::ROOT.field("claim").name(request.claim.clone())
}

/// Returns the robot whose joints are requested.
pub fn layout_of(request: v1::GetJointLayoutRequest) -> Result<String, BadField> {
    Path::ROOT.field("robot").name(request.robot)
}

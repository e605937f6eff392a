//! Answers about joints: their properties, and clamped targets.

use simd_core::simulation::command::Clamped;
use simd_core::simulation::joint_status::JointStatus;
use simd_core::simulation::obstructions::Obstruction;
use simd_core::simulation::published_state::{
    Begin, EntityLayout, Flags, Mode, PublishedState, TrajectoryState,
};
use simd_model::robot::{Joint, JointKind, JointLimits};
use simd_proto::v1;

use super::geometry::{self, vector};
use super::simulation::count;

/// Converts the joints of the robot at an index of a published state. `status` has one entry for each joint
/// of the robot's model.
pub fn layout(
    state: &PublishedState,
    robot_index: usize,
    entity: &EntityLayout,
    status: &[JointStatus],
) -> v1::JointLayout {
    let world_from_link = state.link_poses(robot_index).unwrap_or_default();
    let blocked = obstructions(state, robot_index, None);
    let joints = entity
        .model
        .joints
        .iter()
        .zip(status)
        .enumerate()
        .map(|(index, (joint, status))| {
            let mut info = joint_info(entity, index, joint, status);
            info.obstruction = blocked.iter().find(|found| found.joint == info.name).cloned();
            info.world_from_joint = world_from_link.get(joint.child).copied().map(geometry::pose);
            info
        })
        .collect();
    v1::JointLayout {
        robot: entity.name.clone(),
        layout_version: entity.version,
        joints,
        position_count: count(entity.positions.len()),
        velocity_count: count(entity.velocities.len()),
    }
}

fn joint_info(entity: &EntityLayout, index: usize, joint: &Joint, status: &JointStatus) -> v1::JointInfo {
    let link = |index: usize| entity.model.links.get(index).map(|l| l.name.clone()).unwrap_or_default();
    let positions = entity.joint_positions.get(index).cloned().unwrap_or_default();
    let velocities = entity.joint_velocities.get(index).cloned().unwrap_or_default();
    let name = |index: usize| entity.model.joints.get(index).map(|j| j.name.clone()).unwrap_or_default();
    let has_axis = !matches!(joint.kind, JointKind::Fixed | JointKind::Floating | JointKind::Spherical);
    v1::JointInfo {
        index: count(index),
        name: joint.name.clone(),
        r#type: joint_type(joint.kind).into(),
        axis: has_axis.then(|| vector(joint.axis)),
        parent_link: link(joint.parent),
        child_link: link(joint.child),
        parent_from_joint: Some(geometry::pose(joint.parent_from_joint)),
        world_from_joint: None,
        limits: Some(limits(&status.settings.limits)),
        damping: status.settings.damping,
        friction: status.settings.friction,
        armature: status.settings.armature,
        spring: spring(status.settings.spring),
        mimic: joint.mimic.map(|mimic| v1::JointMimic {
            joint: name(mimic.joint),
            multiplier: mimic.multiplier,
            offset: mimic.offset,
        }),
        mode: mode(status.mode).into(),
        gains: Some(gains(status.gains)),
        default_gains: Some(gains(status.settings.default_gains)),
        position_index: count(positions.start),
        position_count: count(positions.len()),
        velocity_index: count(velocities.start),
        velocity_count: count(velocities.len()),
        claimed_by: status.settings.claimed_by.as_deref().unwrap_or_default().to_owned(),
        gravity_compensation: status.settings.gravity_compensation,
        obstruction: None,
        profile: status.settings.profile,
        tendon: entity.model.setup.tendon(index).map(|tendon| v1::JointTendon {
            terms: tendon
                .terms
                .iter()
                .map(|(joint, factor)| v1::JointTendonTerm { joint: name(*joint), factor: *factor })
                .collect(),
            offset: tendon.offset,
        }),
    }
}

/// Converts trajectories of a robot, or of all robots.
pub fn trajectories(state: &PublishedState, robot: Option<usize>) -> Vec<v1::Trajectory> {
    let wanted = state.trajectories.iter().filter(|trajectory| robot.is_none_or(|it| it == trajectory.robot));
    wanted.filter_map(|trajectory| self::trajectory(state, trajectory)).collect()
}

fn trajectory(state: &PublishedState, trajectory: &TrajectoryState) -> Option<v1::Trajectory> {
    let TrajectoryState { robot, id, ref joints, begin, elapsed, duration } = *trajectory;
    let entity = state.world.entities.get(robot)?;
    let (status, delay) = match begin {
        Begin::Now => (v1::TrajectoryStatus::Active, 0.0),
        Begin::Queued => (v1::TrajectoryStatus::Queued, 0.0),
        Begin::After(delay) => (v1::TrajectoryStatus::Delayed, delay),
    };
    let (mut names, mut desired, mut actual) = (Vec::new(), Vec::new(), Vec::new());
    for &joint in state.trajectory_joints.get(joints.clone())? {
        names.push(entity.model.joints.get(joint)?.name.clone());
        if status == v1::TrajectoryStatus::Active {
            desired.push(
                *state.targets.get(entity.velocities.start + entity.joint_velocities.get(joint)?.start)?,
            );
            actual.push(
                *state.positions.get(entity.positions.start + entity.joint_positions.get(joint)?.start)?,
            );
        }
    }
    Some(v1::Trajectory {
        robot: entity.name.clone(),
        id,
        joints: names,
        status: status.into(),
        elapsed,
        duration,
        delay,
        desired,
        actual,
    })
}

fn joint_type(kind: JointKind) -> v1::JointType {
    match kind {
        JointKind::Revolute => v1::JointType::Revolute,
        JointKind::Continuous => v1::JointType::Continuous,
        JointKind::Prismatic => v1::JointType::Prismatic,
        JointKind::Fixed => v1::JointType::Fixed,
        JointKind::Floating => v1::JointType::Floating,
        JointKind::Planar => v1::JointType::Planar,
        JointKind::Spherical => v1::JointType::Spherical,
    }
}

fn limits(limits: &JointLimits) -> v1::JointLimits {
    v1::JointLimits {
        lower: limits.lower,
        upper: limits.upper,
        effort: limits.effort,
        velocity: limits.velocity,
    }
}

fn spring((stiffness, rest): (f64, f64)) -> Option<v1::JointSpring> {
    (stiffness > 0.0).then_some(v1::JointSpring { stiffness, rest })
}

fn gains((stiffness, damping): (f64, f64)) -> v1::JointGains {
    v1::JointGains { stiffness, damping }
}

/// Converts the mode of an actuator.
pub fn mode(mode: Mode) -> v1::JointMode {
    match mode {
        Mode::None => v1::JointMode::None,
        Mode::Passive => v1::JointMode::Passive,
        Mode::Position => v1::JointMode::Position,
        Mode::Velocity => v1::JointMode::Velocity,
        Mode::Effort => v1::JointMode::Effort,
        Mode::Hold => v1::JointMode::Hold,
    }
}

/// Returns a bit set of `JointFlag`.
pub fn flags(flags: Flags) -> u32 {
    let bit = |set: bool, flag: v1::JointFlag| if set { flag as u32 } else { 0 };
    bit(flags.saturated, v1::JointFlag::Saturated)
        | bit(flags.at_lower, v1::JointFlag::AtLowerLimit)
        | bit(flags.at_upper, v1::JointFlag::AtUpperLimit)
}

/// Converts the obstructions that keep joints of a robot from their targets, for all or some of its joints.
pub fn obstructions(
    state: &PublishedState,
    robot: usize,
    joints: Option<&[usize]>,
) -> Vec<v1::JointObstruction> {
    let wanted = |found: &Obstruction| joints.is_none_or(|joints| joints.contains(&found.joint));
    let named = |found: Obstruction| {
        let (entity, by) = (state.world.entities.get(robot)?, state.world.entities.get(found.by_robot)?);
        Some(v1::JointObstruction {
            joint: entity.model.joints.get(found.joint)?.name.clone(),
            link: entity.model.links.get(found.link)?.name.clone(),
            by_robot: by.name.clone(),
            by_link: found.by_link_name(&by.model),
            effort: found.effort,
        })
    };
    state.obstructions(robot).into_iter().filter(wanted).filter_map(named).collect()
}

/// Converts targets that were beyond a limit.
pub fn clamped(clamped: Vec<Clamped>) -> Vec<v1::ClampedTarget> {
    clamped
        .into_iter()
        .map(|Clamped { robot, joint, requested, applied }| v1::ClampedTarget {
            robot,
            joint,
            requested,
            applied,
        })
        .collect()
}

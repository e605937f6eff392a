//! A kept state of the world as what is in a file.

use std::collections::BTreeMap;

use glamx::DPose3;
use simd_core::collision::{MeshShapes, Surface};
use simd_core::dynamics::actuator::{Actuator, Axis, AxisSettings, Drive};
use simd_core::dynamics::constraint::Impulses;
use simd_core::simulation::command::WrenchDuration;
use simd_core::simulation::world_state::{ActiveWrench, BodyState, ContactState, RobotState, WorldState};
use simd_model::RobotModel;
use simd_model::robot::{JointLimits, Sha256};
use simd_proto::v1;

use super::joint::mode;

/// What a robot is made from.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Recipe {
    /// Of its URDF.
    pub description: Sha256,
    /// Of its mesh files, by URI.
    pub assets: BTreeMap<String, Sha256>,
    /// Bits of the factor that its lengths are multiplied by.
    pub scale: u64,
    /// What its collision meshes became.
    pub mesh_shapes: MeshShapes,
}

/// The content of a file; the recipes and robots are aligned, and the files are for all of them.
pub fn saved_state_file(
    name: &str,
    state: &WorldState,
    recipes: &[Recipe],
    files: Vec<Vec<u8>>,
) -> v1::SavedStateFile {
    let WorldState { step, sim_time, time_base, settings, robots, contacts, ignored_overlaps } = state;
    v1::SavedStateFile {
        name: name.to_owned(),
        step: *step,
        sim_time: *sim_time,
        time_base_step: time_base.0,
        time_base: time_base.1,
        gravity: settings.gravity.to_array().to_vec(),
        time_step: settings.time_step,
        substeps: settings.substeps,
        robots: robots.iter().zip(recipes).map(|(robot, recipe)| of_robot(robot, recipe)).collect(),
        contacts: Some(of_contacts(contacts)),
        merged: ignored_overlaps.iter().flat_map(|(robots, colliders)| pair(*robots, *colliders)).collect(),
        files,
    }
}

/// The names and kinds of a robot's links and joints, as one number.
pub fn layout(model: &RobotModel) -> Sha256 {
    let links = model.links.iter().map(|link| format!("link {:?}\n", link.name));
    let joints = model.joints.iter().map(|joint| {
        let follows = joint.mimic.map(|mimic| mimic.joint);
        format!("joint {:?} {:?} {} {} {follows:?}\n", joint.name, joint.kind, joint.parent, joint.child)
    });
    Sha256::of(links.chain(joints).collect::<String>().as_bytes())
}

fn of_robot(robot: &RobotState, recipe: &Recipe) -> v1::SavedStateRobot {
    let RobotState {
        name,
        loaded_at_start,
        model,
        shapes: _,
        fixed_base,
        contact_settings,
        surfaces,
        asleep,
        teleported,
        still_for,
        disabled,
        body,
        spawned,
        last_good,
        applied_wrenches,
        expired_wrenches,
    } = robot;
    let properties = contact_settings.links.iter().map(|asked| v1::LinkProperties {
        link: asked.link.clone(),
        friction: asked.material.friction,
        restitution: asked.material.restitution,
    });
    let left = asleep.iter().flatten();
    v1::SavedStateRobot {
        name: name.clone(),
        loaded_at_start: *loaded_at_start,
        description: recipe.description.to_string(),
        assets: recipe.assets.iter().map(|(uri, sha256)| (uri.clone(), sha256.to_string())).collect(),
        scale: f64::from_bits(recipe.scale),
        mesh_shapes: match recipe.mesh_shapes {
            MeshShapes::Hull => v1::MeshShapes::Hull,
            MeshShapes::Decomposition => v1::MeshShapes::Decomposition,
        }
        .into(),
        fixed_base: *fixed_base,
        self_collision: contact_settings.self_collision,
        link_properties: properties.collect(),
        layout: layout(model).to_string(),
        surfaces: surfaces
            .iter()
            .flat_map(|Surface { friction, restitution }| [*friction, *restitution])
            .collect(),
        asleep: asleep.is_some(),
        colliders: left.flat_map(|(place, margin)| pose(place).into_iter().chain([*margin])).collect(),
        was_put: *teleported,
        still_for: *still_for,
        disabled_reason: disabled.clone(),
        body: Some(of_body(body)),
        spawned: Some(of_body(spawned)),
        last_positions: last_good.0.clone(),
        last_rates: last_good.1.clone(),
        pushes: Some(of_pushes(applied_wrenches)),
        passed: Some(of_pushes(expired_wrenches)),
    }
}

fn of_body(state: &BodyState) -> v1::SavedStateBody {
    let BodyState {
        base,
        positions,
        velocities,
        velocities_before,
        has_stepped,
        axes,
        drives,
        efforts,
        external,
        impulses: Impulses { friction, mimic, lower, upper },
    } = state;
    let rows: Vec<(u32, [f64; 19], [f64; 7])> =
        axes.iter().zip(drives).map(|(axis, drive)| row(axis, drive)).collect();
    v1::SavedStateBody {
        base: pose(base).to_vec(),
        positions: positions.clone(),
        rates: velocities.clone(),
        rates_before: velocities_before.clone(),
        has_stepped: *has_stepped,
        modes: axes.iter().map(|axis| mode(axis.actuator.mode).into()).collect(),
        given: rows.iter().map(|(given, _, _)| *given).collect(),
        axes: rows.iter().flat_map(|(_, axis, _)| *axis).collect(),
        laws: rows.iter().flat_map(|(_, _, law)| *law).collect(),
        efforts: efforts.clone(),
        external: external
            .iter()
            .flat_map(|push| [push.angular, push.linear])
            .flat_map(|vector| vector.to_array())
            .collect(),
        friction_impulses: friction.clone(),
        mimic_impulses: mimic.clone(),
        lower_impulses: lower.clone(),
        upper_impulses: upper.clone(),
    }
}

/// An axis and the law of its actuator; which of their numbers are given, as bits.
fn row(axis: &Axis, drive: &Drive) -> (u32, [f64; 19], [f64; 7]) {
    let AxisSettings {
        damping,
        friction,
        armature,
        limits: JointLimits { lower, upper, effort, velocity },
        default_stiffness,
        default_damping,
        composite_inertia,
    } = axis.settings;
    let Actuator {
        mode: _,
        target,
        velocity: target_velocity,
        stiffness,
        damping: target_damping,
        feed_forward,
        max_effort,
        max_velocity,
        setpoint,
        setpoint_velocity,
    } = axis.actuator;
    let Drive {
        stiffness: kp,
        damping: kd,
        position,
        velocity: drive_velocity,
        feed_forward: ff,
        limit,
        saturated,
    } = *drive;
    let optional =
        [lower, upper, effort, velocity, stiffness, target_damping, max_effort, max_velocity, saturated];
    let bits = optional.iter().enumerate().map(|(bit, value)| u32::from(value.is_some()) << bit);
    let or_0 = |value: Option<f64>| value.unwrap_or(0.0);
    let row = [
        damping,
        friction,
        armature,
        or_0(lower),
        or_0(upper),
        or_0(effort),
        or_0(velocity),
        default_stiffness,
        default_damping,
        composite_inertia,
        target,
        target_velocity,
        or_0(stiffness),
        or_0(target_damping),
        feed_forward,
        or_0(max_effort),
        or_0(max_velocity),
        setpoint,
        setpoint_velocity,
    ];
    (bits.sum(), row, [kp, kd, position, drive_velocity, ff, limit, or_0(saturated)])
}

fn of_pushes(pushes: &[ActiveWrench]) -> v1::SavedStatePushes {
    let mut file = v1::SavedStatePushes::default();
    for push in pushes {
        let ActiveWrench { link, force, torque, in_link_axes, point, duration, suspended } = *push;
        let (persistent, timed, left) = match duration {
            WrenchDuration::NextStep => (false, false, 0.0),
            WrenchDuration::For(left) => (false, true, left),
            WrenchDuration::UntilCleared => (true, false, 0.0),
        };
        let flags = [in_link_axes, persistent, timed, suspended];
        file.links.push(place(link));
        file.flags.push(flags.iter().rev().fold(0, |bits, flag| bits << 1 | u32::from(*flag)));
        file.values.extend([force, torque, point].into_iter().flat_map(|vector| vector.to_array()));
        file.values.push(left);
    }
    file
}

fn of_contacts(contacts: &[ContactState]) -> v1::SavedStateContacts {
    let mut file = v1::SavedStateContacts::default();
    for contact in contacts {
        let ContactState { robots, colliders, on, point, normal, distance, surface, impulse, total } =
            *contact;
        file.pairs.extend(pair(robots, colliders));
        let vectors =
            |vectors: &[glamx::DVec3]| vectors.iter().flat_map(|v| v.to_array()).collect::<Vec<_>>();
        file.values.extend(vectors(&[on[0], on[1], point, normal]));
        file.values.extend([distance, surface.friction, surface.restitution]);
        file.values.extend(vectors(&[impulse, total]));
    }
    file
}

fn pair([a, b]: [usize; 2], [c, d]: [usize; 2]) -> [u32; 4] {
    [a, b, c, d].map(place)
}

/// A place in a list. Lists are far shorter than it can say.
fn place(index: usize) -> u32 {
    u32::try_from(index).unwrap_or(u32::MAX)
}

fn pose(pose: &DPose3) -> [f64; 7] {
    let [x, y, z] = pose.translation.to_array();
    let [i, j, k, w] = pose.rotation.to_array();
    [x, y, z, i, j, k, w]
}

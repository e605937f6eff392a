//! What is in a saved state's file as a state of the world. How long lists must be for a model, and which
//! numbers can be, is for the world to say.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::PhysicsSettings;
use simd_core::collision::{MeshShapes, Shapes, Surface};
use simd_core::dynamics::Mode;
use simd_core::dynamics::actuator::{Actuator, Axis, AxisSettings, Drive};
use simd_core::dynamics::constraint::Impulses;
use simd_core::dynamics::spatial::Spatial;
use simd_core::simulation::command::{ContactSettings, WrenchDuration};
use simd_core::simulation::world_state::{
    ActiveWrench, BodyState, ContactState, Pair, RobotState, WorldState,
};
use simd_model::RobotModel;
use simd_model::robot::JointLimits;
use simd_proto::v1;

use super::contact::link_properties;
use super::entity::{assets, sha256};
use crate::convert::field::{BadField, Path};
use crate::convert::to_proto::saved_state_file::{Recipe, layout};

/// Bytes of why a robot is out of the simulation: it is in what clients see.
const MOST_REASON: usize = 8192;

/// A robot that was made again.
pub type Made = (Arc<RobotModel>, Arc<Shapes>);

/// What each robot is to be made from.
pub fn recipes(file: &v1::SavedStateFile) -> Result<Vec<Recipe>, BadField> {
    let recipe = |(index, robot): (usize, &v1::SavedStateRobot)| {
        let at = Path::ROOT.item("robots", index);
        let made = || {
            let mesh_shapes = match at.field("mesh_shapes").known(robot.mesh_shapes)? {
                v1::MeshShapes::Unspecified | v1::MeshShapes::Hull => MeshShapes::Hull,
                v1::MeshShapes::Decomposition => MeshShapes::Decomposition,
            };
            Ok(Recipe {
                description: sha256(&at.field("description"), &robot.description)?,
                assets: assets(&at, robot.assets.clone())?,
                scale: robot.scale.to_bits(),
                mesh_shapes,
            })
        };
        made().map_err(|error| of(&robot.name, error))
    };
    file.robots.iter().enumerate().map(recipe).collect()
}

/// The state; one made robot for each in the file, in their order.
pub fn world_state(file: v1::SavedStateFile, made: Vec<Made>) -> Result<WorldState, BadField> {
    Path::ROOT.field("name").short(file.name)?;
    let gravity = rows::<3, f64>(&Path::ROOT.field("gravity"), &file.gravity)?;
    let [gravity] = gravity[..] else {
        return Err(Path::ROOT.field("gravity").refuse("not one vector", "it must be x y z"));
    };
    let robots = file.robots.into_iter().zip(made).enumerate().map(|(index, (robot, made))| {
        let name = robot.name.clone();
        state_of(&Path::ROOT.item("robots", index), robot, made).map_err(|error| of(&name, error))
    });
    Ok(WorldState {
        step: file.step,
        sim_time: file.sim_time,
        time_base: (file.time_base_step, file.time_base),
        settings: PhysicsSettings {
            gravity: DVec3::from_array(gravity),
            time_step: file.time_step,
            substeps: file.substeps,
        },
        robots: robots.collect::<Result<_, _>>()?,
        contacts: contacts(file.contacts.unwrap_or_default())?,
        ignored_overlaps: pairs(&Path::ROOT.field("merged"), &file.merged)?,
    })
}

fn of(robot: &str, error: BadField) -> BadField {
    BadField { of: format!(" (robot {:?})", robot.chars().take(80).collect::<String>()), ..error }
}

fn state_of(
    at: &Path<'_>,
    robot: v1::SavedStateRobot,
    (model, shapes): Made,
) -> Result<RobotState, BadField> {
    if layout(&model).to_string() != robot.layout {
        return Err(at.field("layout").refuse(
            "another one",
            "its description must give the links and joints that it gave where the state was saved: this \
             daemon reads it otherwise",
        ));
    }
    let reason = robot.disabled_reason.as_deref().unwrap_or_default().len();
    if reason > MOST_REASON {
        let expected = format!("it must have at most {MOST_REASON}");
        return Err(at.field("disabled_reason").refuse(format_args!("{reason} bytes long"), expected));
    }
    let surfaces = rows::<2, f64>(&at.field("surfaces"), &robot.surfaces)?;
    let surfaces = surfaces.into_iter().map(|[friction, restitution]| Surface { friction, restitution });
    let left = rows::<8, f64>(&at.field("colliders"), &robot.colliders)?;
    let left = left.into_iter().map(|[x, y, z, i, j, k, w, margin]| (pose([x, y, z, i, j, k, w]), margin));
    Ok(RobotState {
        name: robot.name,
        loaded_at_start: robot.loaded_at_start,
        model,
        shapes,
        fixed_base: robot.fixed_base,
        contact_settings: ContactSettings {
            self_collision: robot.self_collision,
            links: link_properties(at, "link_properties", robot.link_properties)?,
        },
        surfaces: surfaces.collect(),
        asleep: robot.asleep.then(|| left.collect()),
        teleported: robot.was_put,
        still_for: robot.still_for,
        disabled: robot.disabled_reason,
        body: body(&at.field("body"), robot.body)?,
        spawned: body(&at.field("spawned"), robot.spawned)?,
        last_good: (robot.last_positions, robot.last_rates),
        applied_wrenches: pushes(&at.field("pushes"), robot.pushes.unwrap_or_default())?,
        expired_wrenches: pushes(&at.field("passed"), robot.passed.unwrap_or_default())?,
    })
}

fn body(at: &Path<'_>, state: Option<v1::SavedStateBody>) -> Result<BodyState, BadField> {
    let state = at.given(state)?;
    let base = rows::<7, f64>(&at.field("base"), &state.base)?;
    let [base] = base[..] else {
        return Err(at.field("base").refuse("not one pose", "it must be x y z and a quaternion"));
    };
    let settings = rows::<19, f64>(&at.field("axes"), &state.axes)?;
    let laws = rows::<7, f64>(&at.field("laws"), &state.laws)?;
    let count = settings.len();
    for (name, there) in [("laws", laws.len()), ("modes", state.modes.len()), ("given", state.given.len())] {
        if there != count {
            let expected = format!("there must be {count}, as of axes");
            return Err(at.field(name).refuse(format_args!("{there} entries"), expected));
        }
    }
    let mut axes = Vec::with_capacity(count);
    let mut drives = Vec::with_capacity(count);
    for (((row, law), given), number) in settings.into_iter().zip(laws).zip(state.given).zip(state.modes) {
        let (axis, drive) = axis(row, law, given, mode(at.field("modes").known(number)?));
        axes.push(axis);
        drives.push(drive);
    }
    let external = rows::<6, f64>(&at.field("external"), &state.external)?;
    let external =
        external.into_iter().map(|[a, b, c, d, e, f]| Spatial::new(DVec3::new(a, b, c), DVec3::new(d, e, f)));
    Ok(BodyState {
        base: pose(base),
        positions: state.positions,
        velocities: state.rates,
        velocities_before: state.rates_before,
        has_stepped: state.has_stepped,
        axes,
        drives,
        efforts: state.efforts,
        external: external.collect(),
        impulses: Impulses {
            friction: state.friction_impulses,
            mimic: state.mimic_impulses,
            lower: state.lower_impulses,
            upper: state.upper_impulses,
        },
    })
}

fn axis(row: [f64; 19], law: [f64; 7], bits: u32, mode: Mode) -> (Axis, Drive) {
    let [
        damping,
        friction,
        armature,
        lower,
        upper,
        effort,
        velocity,
        default_stiffness,
        default_damping,
        composite_inertia,
        target,
        target_velocity,
        stiffness,
        target_damping,
        feed_forward,
        max_effort,
        max_velocity,
        setpoint,
        setpoint_velocity,
    ] = row;
    let [kp, kd, position, drive_velocity, ff, limit, saturated] = law;
    let given = |bit: u32, value: f64| (bits >> bit & 1 == 1).then_some(value);
    let settings = AxisSettings {
        damping,
        friction,
        armature,
        limits: JointLimits {
            lower: given(0, lower),
            upper: given(1, upper),
            effort: given(2, effort),
            velocity: given(3, velocity),
        },
        default_stiffness,
        default_damping,
        composite_inertia,
    };
    let actuator = Actuator {
        mode,
        target,
        velocity: target_velocity,
        stiffness: given(4, stiffness),
        damping: given(5, target_damping),
        feed_forward,
        max_effort: given(6, max_effort),
        max_velocity: given(7, max_velocity),
        setpoint,
        setpoint_velocity,
    };
    let drive = Drive {
        stiffness: kp,
        damping: kd,
        position,
        velocity: drive_velocity,
        feed_forward: ff,
        limit,
        saturated: given(8, saturated),
    };
    (Axis { settings, actuator }, drive)
}

fn mode(mode: v1::JointMode) -> Mode {
    match mode {
        v1::JointMode::Unspecified | v1::JointMode::None => Mode::None,
        v1::JointMode::Passive => Mode::Passive,
        v1::JointMode::Position => Mode::Position,
        v1::JointMode::Velocity => Mode::Velocity,
        v1::JointMode::Effort => Mode::Effort,
        v1::JointMode::Hold => Mode::Hold,
    }
}

fn pushes(at: &Path<'_>, file: v1::SavedStatePushes) -> Result<Vec<ActiveWrench>, BadField> {
    let values = rows::<10, f64>(&at.field("values"), &file.values)?;
    if file.links.len() != values.len() || file.flags.len() != values.len() {
        return Err(at.refuse("of lists of different lengths", "they must be aligned"));
    }
    let push = |((values, link), flags): (([f64; 10], u32), u32)| {
        let [a, b, c, d, e, f, x, y, z, left] = values;
        let is_set = |bit: u32| flags >> bit & 1 == 1;
        let duration = match (is_set(1), is_set(2)) {
            (true, _) => WrenchDuration::UntilCleared,
            (false, true) => WrenchDuration::For(left),
            (false, false) => WrenchDuration::NextStep,
        };
        ActiveWrench {
            link: index(link),
            force: DVec3::new(a, b, c),
            torque: DVec3::new(d, e, f),
            in_link_axes: is_set(0),
            point: DVec3::new(x, y, z),
            duration,
            suspended: is_set(3),
        }
    };
    Ok(values.into_iter().zip(file.links).zip(file.flags).map(push).collect())
}

fn contacts(file: v1::SavedStateContacts) -> Result<Vec<ContactState>, BadField> {
    let at = Path::ROOT.field("contacts");
    let pairs = pairs(&at.field("pairs"), &file.pairs)?;
    let values = rows::<21, f64>(&at.field("values"), &file.values)?;
    if pairs.len() != values.len() {
        return Err(at.refuse("of lists of different lengths", "they must be aligned"));
    }
    let contact = |((robots, colliders), row): (Pair, [f64; 21])| {
        let vector = |place: usize| DVec3::new(row[place], row[place + 1], row[place + 2]);
        ContactState {
            robots,
            colliders,
            on: [vector(0), vector(3)],
            point: vector(6),
            normal: vector(9),
            distance: row[12],
            surface: Surface { friction: row[13], restitution: row[14] },
            impulse: vector(15),
            total: vector(18),
        }
    };
    Ok(pairs.into_iter().zip(values).map(contact).collect())
}

fn pairs(at: &Path<'_>, numbers: &[u32]) -> Result<Vec<Pair>, BadField> {
    let pairs = rows::<4, u32>(at, numbers)?;
    Ok(pairs.into_iter().map(|row| row.map(index)).map(|[a, b, c, d]| ([a, b], [c, d])).collect())
}

fn index(number: u32) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

fn pose([x, y, z, i, j, k, w]: [f64; 7]) -> DPose3 {
    DPose3::from_parts(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w))
}

/// A list as rows of so many numbers.
fn rows<const N: usize, T: Copy>(at: &Path<'_>, numbers: &[T]) -> Result<Vec<[T; N]>, BadField> {
    let (rows, []) = numbers.as_chunks::<N>() else {
        let expected = format!("there must be {N} to an entry");
        return Err(at.refuse(format_args!("{} numbers", numbers.len()), expected));
    };
    Ok(rows.to_vec())
}

//! Saved states whose bytes are whole and whose numbers, lengths and indices are wrong: each is refused, or
//! is a world that can be stepped. A seed makes each run the same; `SIMD_MUTATIONS` asks for more of each
//! file.
#![cfg(test)]

use std::fs;
use std::path::Path;
use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::dynamics::actuator::{Actuator, Axis, AxisSettings, Drive};
use simd_core::dynamics::constraint::Impulses;
use simd_core::simulation::command::WrenchDuration;
use simd_core::simulation::world_state::{
    ActivePull, ActiveWrench, BodyState, Contact, RestPose, RobotState, Surface, WorldState,
};
use simd_fuzz_targets::saved_states;
use simd_model::robot::JointLimits;
use simd_world::loading::saved_state_file::{Content, open, seal_encoded};

const NUMBERS: &[f64] = &[
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    -1.0,
    0.0,
    -0.0,
    1e-300,
    1e12,
    1e60,
    1e150,
    1e300,
    f64::MAX,
];

fn vector(vector: &mut DVec3) -> [&mut f64; 3] {
    [&mut vector.x, &mut vector.y, &mut vector.z]
}

fn pose(pose: &mut DPose3) -> impl Iterator<Item = &mut f64> {
    let DQuat { x, y, z, w } = &mut pose.rotation;
    vector(&mut pose.translation).into_iter().chain([x, y, z, w])
}

fn of_axis(axis: &mut Axis) -> Vec<&mut f64> {
    let AxisSettings {
        damping,
        friction,
        armature,
        spring_stiffness,
        spring_rest,
        limits: JointLimits { lower, upper, effort, velocity },
        default_stiffness,
        default_damping,
        velocity_damping,
        is_direct: _,
        gravity_compensation: _,
        composite_inertia,
    } = &mut axis.settings;
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
        servo,
    } = &mut axis.actuator;
    let mut numbers =
        vec![damping, friction, armature, spring_stiffness, spring_rest, default_stiffness, default_damping];
    numbers.push(composite_inertia);
    numbers.extend([target, target_velocity, feed_forward, setpoint, setpoint_velocity]);
    let optional = [
        lower,
        upper,
        effort,
        velocity,
        velocity_damping,
        stiffness,
        target_damping,
        max_effort,
        max_velocity,
    ];
    numbers.extend(optional.into_iter().flatten());
    numbers.extend(servo.iter_mut().flat_map(|servo| [&mut servo.gain, &mut servo.slip]));
    numbers
}

fn of_body(body: &mut BodyState) -> Vec<&mut f64> {
    let BodyState {
        base,
        positions,
        velocities,
        half_velocities,
        changes,
        changes_before,
        history: _,
        axes,
        drives,
        efforts,
        external,
        external_before,
        has_external_changed: _,
        impulses: Impulses { friction, mimic, lower, upper },
    } = body;
    let mut numbers: Vec<&mut f64> = pose(base).collect();
    let moves = [positions, velocities, half_velocities, changes, changes_before];
    for list in moves.into_iter().chain([efforts, friction, mimic, lower, upper]) {
        numbers.extend(list);
    }
    numbers.extend(axes.iter_mut().flat_map(of_axis));
    for Drive { stiffness, damping, position, velocity, feed_forward, limit, saturated } in drives {
        numbers.extend([stiffness, damping, position, velocity, feed_forward, limit]);
        numbers.extend(saturated);
    }
    let forces = external.iter_mut().chain(external_before);
    numbers.extend(forces.flat_map(|force| [&mut force.angular, &mut force.linear]).flat_map(vector));
    numbers
}

fn of_wrench(wrench: &mut ActiveWrench) -> Vec<&mut f64> {
    let ActiveWrench { link: _, force, torque, in_link_axes: _, point, duration, suspended: _ } = wrench;
    let mut numbers: Vec<&mut f64> = [force, torque, point].into_iter().flat_map(vector).collect();
    if let WrenchDuration::For(seconds) = duration {
        numbers.push(seconds);
    }
    numbers
}

/// Returns all numbers of a robot.
fn of_robot(RobotState { entity, body }: &mut RobotState) -> Vec<&mut f64> {
    let mut numbers = of_body(body);
    numbers.extend(of_body(Arc::make_mut(&mut entity.spawned)));
    numbers.push(&mut entity.still_for);
    for surface in &mut entity.surfaces {
        let Surface { friction, restitution, rolling_friction, spinning_friction, stiffness, damping } =
            surface;
        numbers.extend([friction, restitution, rolling_friction, spinning_friction, stiffness, damping]);
    }
    for RestPose { world_from_shape, margin, drift } in &mut entity.rest_poses {
        numbers.extend(pose(world_from_shape));
        numbers.push(margin);
        numbers.extend(vector(drift));
    }
    numbers.extend(&mut entity.last_good.0);
    numbers.extend(&mut entity.last_good.1);
    let wrenches = entity.applied_wrenches.iter_mut().chain(&mut entity.expired_wrenches);
    numbers.extend(wrenches.flat_map(of_wrench));
    for pull in &mut entity.pulls {
        let ActivePull { link: _, point, target, stiffness, damping, max_force, remaining, force } = pull;
        numbers.extend([point, target, force].into_iter().flat_map(vector));
        numbers.extend([stiffness, damping, max_force, remaining]);
    }
    numbers
}

/// Returns all numbers except those of robots.
fn of_world(world: &mut WorldState) -> Vec<&mut f64> {
    let mut numbers = vec![&mut world.sim_time, &mut world.time_base.1, &mut world.settings.time_step];
    numbers.extend(vector(&mut world.settings.gravity));
    for contact in &mut world.contacts {
        let Contact {
            robots: _,
            index: _,
            point,
            impulse,
            turning_impulse,
            is_least: _,
            total,
            moved,
            wanders: _,
        } = contact;
        let [a, b] = &mut point.on;
        let vectors = [a, b, &mut point.position, &mut point.normal, impulse, turning_impulse, total, moved];
        numbers.extend(vectors.into_iter().flat_map(vector));
        let Surface { friction, restitution, rolling_friction, spinning_friction, stiffness, damping } =
            &mut point.surface;
        numbers.extend([&mut point.distance, friction, restitution, rolling_friction, spinning_friction]);
        numbers.extend([stiffness, damping]);
    }
    for constraint in &mut world.constraints {
        for end in &mut constraint.definition.ends {
            numbers.extend(pose(&mut end.frame));
        }
        numbers.extend([&mut constraint.definition.max_force, &mut constraint.definition.max_torque]);
        numbers.extend(constraint.impulses.iter_mut().flatten());
        numbers.extend(
            constraint.motion.iter_mut().flatten().flat_map(|of| of.predicted.iter_mut().chain(&mut of.bent)),
        );
        numbers.extend(vector(&mut constraint.reading.force));
    }
    numbers
}

/// Returns all indices.
fn indices(file: &mut Content) -> Vec<&mut usize> {
    let mut indices: Vec<&mut usize> = Vec::new();
    for contact in &mut file.world.contacts {
        indices.extend(contact.robots.iter_mut().chain(&mut contact.point.colliders));
    }
    for constraint in &mut file.world.constraints {
        for (robot, link) in constraint.definition.ends.iter_mut().filter_map(|end| end.link.as_mut()) {
            indices.extend([robot, link]);
        }
    }
    for (robots, colliders) in &mut file.world.ignored_overlaps {
        indices.extend(robots.iter_mut().chain(colliders));
    }
    for robot in &mut file.robots {
        let entity = &mut robot.state.entity;
        let wrenches = entity.applied_wrenches.iter_mut().chain(&mut entity.expired_wrenches);
        indices.extend(wrenches.map(|wrench| &mut wrench.link));
        indices.extend(entity.pulls.iter_mut().map(|pull| &mut pull.link));
    }
    indices
}

/// Makes a list of a robot, or of the world, longer or shorter.
fn resize(rng: &mut Rng, file: &mut Content) {
    let robots = file.robots.len();
    if robots == 0 || rng.u8(0..4) == 0 {
        return match rng.u8(0..3) {
            0 => cut(rng, &mut file.world.contacts),
            1 => cut(rng, &mut file.world.ignored_overlaps),
            _ => cut(rng, Arc::make_mut(&mut file.world.collision_pairs)),
        };
    }
    let RobotState { entity, body } = &mut file.robots[rng.usize(..robots)].state;
    let body = if rng.bool() { body } else { Arc::make_mut(&mut entity.spawned) };
    match rng.u8(0..21) {
        0 => cut(rng, &mut body.positions),
        1 => cut(rng, &mut body.velocities),
        2 => cut(rng, &mut body.half_velocities),
        3 => cut(rng, &mut body.axes),
        4 => cut(rng, &mut body.drives),
        5 => cut(rng, &mut body.efforts),
        6 => cut(rng, &mut body.external),
        7 => cut(rng, &mut body.impulses.friction),
        8 => cut(rng, &mut body.impulses.mimic),
        9 => cut(rng, &mut body.impulses.upper),
        10 => cut(rng, &mut entity.surfaces),
        11 => cut(rng, &mut entity.rest_poses),
        12 => cut(rng, &mut entity.last_good.0),
        13 => cut(rng, &mut entity.applied_wrenches),
        14 => cut(rng, &mut entity.groups),
        15 => cut(rng, Arc::make_mut(&mut entity.collision_pairs)),
        16 => cut(rng, &mut body.changes),
        17 => cut(rng, &mut body.changes_before),
        18 => cut(rng, &mut body.external_before),
        19 => cut(rng, &mut entity.pulls),
        _ => cut(rng, &mut entity.expired_wrenches),
    }
}

/// Takes some entries out of a list, or doubles some.
fn cut<T: Clone>(rng: &mut Rng, list: &mut Vec<T>) {
    let at = rng.usize(0..=list.len());
    let end = (at + rng.usize(0..20)).min(list.len());
    match rng.bool() {
        true => drop(list.drain(at..end)),
        false => list.extend_from_within(at..end),
    }
}

fn mutate(rng: &mut Rng, file: &mut Content) {
    for _ in 0..rng.usize(1..4) {
        match rng.u8(0..8) {
            0..4 => {
                let robots = file.robots.len();
                let mut numbers = match rng.usize(0..=robots) {
                    index if index < robots => of_robot(&mut file.robots[index].state),
                    _ => of_world(&mut file.world),
                };
                let index = rng.usize(..numbers.len());
                *numbers[index] = match rng.u8(0..3) {
                    0 => rng.f64() * 2.0 - 1.0,
                    _ => NUMBERS[rng.usize(..NUMBERS.len())],
                };
            }
            4 => resize(rng, file),
            5 => {
                let mut indices = indices(file);
                if !indices.is_empty() {
                    let index = rng.usize(..indices.len());
                    *indices[index] = *rng.choice(&[0, 1, 2, 511, usize::MAX]).unwrap();
                }
            }
            6 => {
                let WorldState { step, time_base, .. } = &mut file.world;
                (*step, time_base.0) =
                    *rng.choice(&[(*step, time_base.0), (0, 1), (u64::MAX, 0), (1 << 53, 1 << 53)]).unwrap();
                if let Some(robot) = rng.choice(&mut file.robots) {
                    robot.source.scale = NUMBERS[rng.usize(..NUMBERS.len())].to_bits();
                }
            }
            _ => {
                let count = file.robots.len();
                let Some(robot) = rng.choice(&mut file.robots) else { continue };
                let RobotState { entity, body } = &mut robot.state;
                match rng.u8(0..6) {
                    0 => entity.fixed_base ^= true,
                    1 => entity.asleep ^= true,
                    2 => *body = BodyState::clone(&entity.spawned),
                    3 => entity.disabled = Some("because".into()),
                    4 => entity.contact_settings.self_collision ^= true,
                    _ => {
                        let (a, b) = (rng.usize(..count), rng.usize(..count));
                        file.robots.swap(a, b);
                    }
                }
            }
        }
    }
}

#[test]
fn no_number_of_a_saved_state_breaks_a_promise() {
    let each: u32 = std::env::var("SIMD_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(400);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/saved_states");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let rng = &mut Rng::with_seed(7);
    let mut accepted = 0;
    for path in &paths {
        let file = open(&seal_encoded(&fs::read(path).unwrap()), 20).unwrap().content;
        for _ in 0..each {
            let mut mutated = file.clone();
            mutate(rng, &mut mutated);
            let bytes = mutated.encode();
            match std::panic::catch_unwind(|| saved_states(&bytes)) {
                Ok(stepped) => accepted += u32::from(stepped),
                Err(_panic) => {
                    let found = std::env::temp_dir().join("simd_saved_states_found");
                    fs::write(&found, &bytes).unwrap();
                    panic!("a saved state breaks on the bytes in {}", found.display());
                }
            }
        }
    }
    let all = each * u32::try_from(paths.len()).unwrap();
    println!("{accepted} of {all} were stepped");
    assert!(accepted > all / 10 && accepted < all * 9 / 10);
}

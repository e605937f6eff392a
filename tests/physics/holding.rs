//! Bodies held by friction keep their place, whatever the motion of their support.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, Simulation};
use simd_model::robot::Geometry;
use simd_tests::robots::from_text;
use simd_tests::scenes::*;
use simd_tests::world::at;

use crate::seeds::{held, seeds};

/// A disc of 20 kg with its top at z = 0, on joints that slide along x, y and z and turn about z.
const TABLE: &str = r#"<robot name="table">
<link name="world"/><link name="x"/><link name="y"/><link name="z"/>
<link name="top"><inertial><mass value="20"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 -0.05"/><geometry><cylinder radius="1" length="0.1"/></geometry></collision></link>
<joint name="x" type="prismatic"><parent link="world"/><child link="x"/><axis xyz="1 0 0"/>
<limit lower="-9" upper="9" effort="0" velocity="0"/></joint>
<joint name="y" type="prismatic"><parent link="x"/><child link="y"/><axis xyz="0 1 0"/>
<limit lower="-9" upper="9" effort="0" velocity="0"/></joint>
<joint name="z" type="prismatic"><parent link="y"/><child link="z"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9" effort="0" velocity="0"/></joint>
<joint name="turn" type="continuous"><parent link="z"/><child link="top"/><axis xyz="0 0 1"/></joint>
</robot>"#;

/// Returns a beam that turns about an axis in its middle, with two fingers 0.5 m from there that close along
/// y.
fn gripper(axis: &str) -> String {
    let finger = |name: &str, side: f64| {
        format!(
            r#"<link name="{name}"><inertial><mass value="0.05"/>
            <inertia ixx="5e-5" iyy="5e-5" izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><geometry><box size="0.03 0.01 0.05"/></geometry></collision></link>
            <joint name="{name}" type="prismatic"><parent link="beam"/><child link="{name}"/>
            <origin xyz="0.5 {y} 0"/><axis xyz="0 {toward} 0"/><limit lower="0" upper="0.05" effort="0" velocity="0"/>
            </joint>"#,
            y = 0.05 * side,
            toward = -side
        )
    };
    format!(
        r#"<robot name="gripper"><link name="world"/><link name="beam"><inertial><mass value="2"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="turn" type="continuous"><parent link="world"/><child link="beam"/><axis xyz="{axis}"/></joint>
        {}{}</robot>"#,
        finger("left", 1.0),
        finger("right", -1.0)
    )
}

/// Returns a fixed robot with driven joints.
fn driven(name: &str, urdf: &str, friction: f64) -> Spawn {
    let base = robot(name, &from_text(urdf), DPose3::IDENTITY, true);
    Spawn { passive: false, contact_settings: surface(friction, 0.0), ..base }
}

pub(crate) fn set_targets(world: &mut Simulation, robot: &str, targets: &[(&str, Target)]) {
    let joints = targets.iter().map(|(joint, target)| JointTarget {
        joint: (*joint).into(),
        axis: 0,
        target: *target,
    });
    let robots = vec![RobotTargets { robot: robot.into(), joints: joints.collect(), ..Default::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..Default::default() }));
}

fn empty(integrator: Integrator, time_step: f64) -> Simulation {
    let settings = PhysicsSettings { time_step, integrator, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits::default())
}

/// Returns the pose of the second robot in the axes of a link of the first one.
fn place(world: &Simulation, link: &str) -> DPose3 {
    let seen = look(world);
    let index = seen.world.entities[0].model.links.iter().position(|known| known.name == link).unwrap();
    seen.link_poses(0).unwrap()[index].inverse() * seen.roots[1].pose
}

/// Returns the distance that a body has moved over some steps relative to the link that carries it, metres.
fn creep(world: &mut Simulation, link: &str, steps: u32, mut drive: impl FnMut(&mut Simulation, u32)) -> f64 {
    let begin = place(world, link);
    for step in 0..steps {
        drive(world, step);
        world.step();
    }
    place(world, link).translation.distance(begin.translation)
}

/// m/s: 1e-4 m a minute.
const MAX_CREEP: f64 = 1e-4 / 60.0;

/// Friction 0.5 holds a box on a turntable up to w^2 r = 4.9 m/s^2. With vanishing tangent velocities it
/// would creep outwards by r w^2 h/2 a second, here 64 mm in a minute.
#[test]
fn a_box_on_a_turntable_keeps_its_place() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = empty(integrator, 1e-3);
        spawn(&mut world, driven("table", TABLE, 0.5));
        let body = robot("box", &cuboid(DVec3::new(0.05, 0.05, 0.02), 0.1), at(0.5, 0.0, 0.01), false);
        spawn(&mut world, Spawn { contact_settings: surface(0.5, 0.0), ..body });
        for step in 1..=2_000 {
            set_targets(&mut world, "table", &[("turn", Target::velocity(f64::from(step) * 1e-3))]);
            world.step();
        }
        let creep = creep(&mut world, "top", 20_000, |_, _| {});
        assert!(creep < 20.0 * MAX_CREEP, "{integrator:?}: {creep} m in 20 s");
    }
}

/// Returns a gripper that holds a box and turns about an axis at this speed.
fn gripper_world(integrator: Integrator, axis: &str, speed: f64) -> Simulation {
    let mut world = empty(integrator, 1e-3);
    spawn(&mut world, driven("gripper", &gripper(axis), 0.8));
    let pose = at(0.5, 0.0, 0.0);
    let body = robot("box", &cuboid(DVec3::splat(0.04), 0.1), pose, false);
    spawn(&mut world, Spawn { contact_settings: surface(0.8, 0.0), ..body });
    let close = |turn| [("left", Target::Effort(15.0)), ("right", Target::Effort(15.0)), ("turn", turn)];
    // The box is put back until the fingers hold it.
    for _ in 0..300 {
        set_targets(&mut world, "gripper", &close(Target::velocity(0.0)));
        let twist = Some((DVec3::ZERO, DVec3::ZERO));
        apply(&mut world, Command::SetEntityState { robot: "box".into(), pose: Some(pose), twist });
        world.step();
    }
    for step in 1..=3_000 {
        let turn = Target::velocity(speed * f64::from(step) / 3e3);
        set_targets(&mut world, "gripper", &close(turn));
        world.step();
    }
    world
}

/// Fingers that press with 15 N each hold 24 N along them by friction 0.8. A mass of 0.1 kg on 0.5 m at 3
/// rad/s needs 1.1 N.
#[test]
fn a_gripper_that_turns_keeps_what_it_holds() {
    for (axis, speed) in [("0 0 1", 3.0), ("0 1 0", 2.0)] {
        let mut world = gripper_world(Integrator::Leapfrog, axis, speed);
        let creep = creep(&mut world, "beam", 10_000, |_, _| {});
        assert!(creep < 10.0 * MAX_CREEP, "about {axis}: {creep} m in 10 s");
    }
}

/// Returns the distance that a body has moved on a table that shakes and turns by sines, with accelerations
/// that friction can hold, metres.
fn shaken(seed: u64, seconds: f64) -> f64 {
    let mut rng = Rng::with_seed(seed);
    let friction = 0.2 + 0.8 * rng.f64();
    let integrator = if rng.bool() { Integrator::Leapfrog } else { Integrator::Euler };
    let h = [1e-3, 5e-4][rng.usize(0..2)];
    let mut world = empty(integrator, h);
    spawn(&mut world, driven("table", TABLE, friction));
    let size = DVec3::new(rng.f64(), rng.f64(), 0.3 * rng.f64()) * 0.08 + 0.04;
    let shape = match rng.u8(0..3) {
        0 => cuboid(size, 0.5),
        1 => solid(&[(DPose3::IDENTITY, Geometry::Cylinder { radius: size.x, length: size.z })], 0.5),
        _ => {
            let mut lopsided = (*cuboid(size, 0.5)).clone();
            lopsided.links[0].inertial.center_of_mass = size * DVec3::new(0.2, -0.1, 0.1);
            Arc::new(lopsided)
        }
    };
    let (reach, angle) = (0.1 + 0.5 * rng.f64(), std::f64::consts::TAU * rng.f64());
    let spot = DVec3::new(reach * angle.cos(), reach * angle.sin(), size.z / 2.0);
    let pose = DPose3::from_parts(spot, DQuat::from_rotation_z(3.0 * rng.f64()));
    spawn(
        &mut world,
        Spawn { contact_settings: surface(friction, 0.0), ..robot("body", &shape, pose, false) },
    );
    // A quarter of the friction's maximum goes to the rotation, an eighth to each slide. A lift takes some of
    // the weight.
    let hold = 9.81 * friction;
    let turn = (0.25 * hold / (reach + 0.1)).sqrt();
    let slides = [0.125 * hold, 0.125 * hold, 1.0].map(|acceleration| {
        let rate = 3.0 + 9.0 * rng.f64();
        (acceleration / (rate * rate), rate)
    });
    let drive = |world: &mut Simulation, step: u32| {
        // The motion starts smoothly over the first second.
        let time = f64::from(step) * h;
        let part = time.min(1.0) * time.min(1.0) * (3.0 - 2.0 * time.min(1.0));
        let to = |(size, rate): (f64, f64)| Target::Position {
            position: part * size * (rate * time).sin(),
            velocity: part * size * rate * (rate * time).cos(),
            stiffness: None,
            damping: None,
            feed_forward: 0.0,
            max_effort: None,
            max_velocity: None,
        };
        let [x, y, z] = slides.map(to);
        let turn = Target::velocity(turn * part);
        set_targets(world, "table", &[("x", x), ("y", y), ("z", z), ("turn", turn)]);
    };
    let begin = (1.5 / h) as u32;
    (0..begin).for_each(|step| {
        drive(&mut world, step);
        world.step();
    });
    let start = place(&world, "top");
    let steps = (seconds / h) as u32;
    for step in 0..steps {
        drive(&mut world, begin + step);
        world.step();
    }
    place(&world, "top").translation.distance(start.translation)
}

/// A table that shakes and turns by sines, with accelerations that friction can hold, and a body anywhere on
/// it.
#[test]
fn bodies_within_friction_stay_on_a_table_that_shakes_and_turns() {
    let count = seeds("HELD_BODIES", 12);
    let (mut largest, mut failed) = (0.0f64, Vec::new());
    for seed in 0..count {
        let creep = shaken(seed, 5.0);
        let part = creep / (5.0 * MAX_CREEP);
        largest = largest.max(part);
        if part > 1.0 {
            println!("seed {seed}: {creep} m in 5 s");
            failed.push(seed);
        }
    }
    held("what friction holds stays where it is held", count, largest, &failed);
}

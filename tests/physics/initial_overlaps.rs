//! Initial overlaps that no contact force can resolve, which are ignored.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use fastrand::Rng;
use glamx::{DPose3, DVec3};
use simd_core::collision::Shapes;
use simd_core::simulation::Saved;
use simd_core::simulation::command::*;
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, JointKind, MeshAsset, Sha256};
use simd_tests::{robots, scenes};

use crate::chains::chain;
use crate::saved_state_files::through_a_file;
use crate::seeds::seeds;
use simd_tests::world::{apply, look, passive, run, world};

/// Returns a cube of 0.2 m and 1 kg that slides along x, on a base that is fixed.
fn slider() -> Arc<RobotModel> {
    let mut model = chain(1);
    model.joints[0].kind = JointKind::Prismatic;
    model.joints[0].axis = DVec3::X;
    model.links[1].collisions = vec![Collision {
        link_from_shape: DPose3::IDENTITY,
        geometry: Geometry::Box { size: DVec3::splat(0.2) },
        material: Default::default(),
    }];
    Arc::new(model)
}

fn spawn(world: &mut Simulation, name: &str, x: f64) {
    let model = slider();
    let spawn = Spawn {
        name: name.into(),
        pose: DPose3::from_translation(DVec3::X * x),
        passive: false,
        shapes: Arc::new(Shapes::new(&model)),
        ..passive(&model, false, &[])
    };
    apply(world, Command::Spawn(Box::new(spawn)));
}

fn go_to(world: &mut Simulation, robot: &str, position: f64) {
    let joints = vec![JointTarget { joint: "joint-1".into(), axis: 0, target: Target::position(position) }];
    let robots = vec![RobotTargets { robot: robot.into(), joints, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// To the bit as if the other were absent. Before this rule the arms of a test were thrown thousands of
/// radians away.
#[test]
fn robots_that_are_fixed_into_each_other_leave_each_other_alone() {
    let (mut alone, mut together) = (world(1e-3), world(1e-3));
    spawn(&mut alone, "first", 0.0);
    spawn(&mut together, "first", 0.0);
    spawn(&mut together, "second", 0.05);
    for world in [&mut alone, &mut together] {
        go_to(world, "first", 0.08);
        run(world, 0.5);
    }
    let (alone, together) = (look(&alone), look(&together));
    assert_eq!(alone.positions[0].to_bits(), together.positions[0].to_bits());
    // Gravity along the axis is zero except for rounding.
    assert!(together.positions[1].abs() < 1e-12, "{:?}", together.positions);
}

/// Once the second has moved away and come back, the first one stops it.
#[test]
fn they_touch_once_they_have_come_apart() {
    let mut world = world(1e-3);
    spawn(&mut world, "first", 0.0);
    spawn(&mut world, "second", 0.05);
    go_to(&mut world, "second", 0.5);
    run(&mut world, 1.0);
    assert!((look(&world).positions[1] - 0.5).abs() < 1e-3);
    go_to(&mut world, "second", 0.0);
    run(&mut world, 1.0);
    let seen = look(&world);
    // Equal springs: they meet half-way, a cube's length apart.
    let gap = 0.05 + seen.positions[1] - seen.positions[0];
    assert!((gap - 0.2).abs() < 1e-3 && seen.positions[0] < -0.05, "{:?}", seen.positions);
}

/// A crate that starts half inside the ground is free to move, and comes out.
#[test]
fn a_free_body_leaves_what_it_initially_overlaps() {
    let mut world = world(1e-3);
    spawn(&mut world, "fixed", 0.0);
    let mut model = chain(1);
    model.links.truncate(1);
    model.joints.clear();
    model.links[0].inertial = crate::chains::rod(0.2);
    model.links[0].collisions = slider().links[1].collisions.clone();
    let model = Arc::new(model);
    let free = Spawn {
        name: "free".into(),
        pose: DPose3::from_translation(DVec3::Z * 0.15),
        shapes: Arc::new(Shapes::new(&model)),
        ..passive(&model, true, &[])
    };
    apply(&mut world, Command::Spawn(Box::new(free)));
    let out = (0..1000).any(|_| {
        world.step();
        look(&world).roots[1].pose.translation.z > 0.199
    });
    assert!(out, "{:?}", look(&world).roots[1]);
}

/// The daemon must import its own exports: the pairs are in the order of their robots, even if the first one
/// collides with itself.
#[test]
fn a_robot_with_ignored_overlaps_is_imported_again() {
    let mut world = world(1e-3);
    let mut arm = chain(2);
    for joint in &mut arm.joints {
        joint.parent_from_joint = DPose3::from_translation(DVec3::X * 0.05);
    }
    for link in &mut arm.links {
        link.collisions = slider().links[1].collisions.clone();
    }
    let arm = Arc::new(arm);
    let contact_settings = ContactSettings { self_collision: true, ..ContactSettings::default() };
    scenes::spawn(
        &mut world,
        Spawn { contact_settings, ..scenes::robot("arm", &arm, DPose3::IDENTITY, true) },
    );
    let table = scenes::cuboid(DVec3::splat(0.3), 1.0);
    scenes::spawn(&mut world, scenes::robot("table", &table, DPose3::IDENTITY, true));
    world.step();
    apply(&mut world, Command::SaveState { name: "here".into() });
    let saved = through_a_file(&world, "here");
    let ignored = &saved.world_state().ignored_overlaps;
    assert!(ignored.contains(&([0, 0], [0, 2])) && ignored.contains(&([0, 1], [1, 0])), "{ignored:?}");
    assert_eq!(imported(saved).fingerprint(), world.fingerprint());
}

/// Returns a world that took over the state, which has no memory of the steps before.
fn imported(saved: Saved) -> Simulation {
    let mut other = world(1e-3);
    apply(&mut other, Command::ImportSavedState { name: "it".into(), saved });
    apply(&mut other, Command::RestoreState { name: "it".into() });
    other
}

fn any_shape(rng: &mut Rng) -> Geometry {
    let mut size = || 0.05 + 0.2 * rng.f64();
    let (radius, length) = (size() / 2.0, size());
    match rng.u8(0..5) {
        0 => Geometry::Sphere { radius },
        1 => Geometry::Cylinder { radius, length },
        2 => Geometry::Capsule { radius, length },
        3 => Geometry::Box { size: DVec3::new(length, radius, 0.1) },
        _ => {
            let vertices = (0..30).map(|_| any_vector(rng, 0.15)).collect();
            let triangles = vec![[0, 1, 2]];
            let asset = MeshAsset {
                sha256: Sha256([rng.u8(..); 32]),
                vertices,
                triangles,
                paints: Vec::new(),
                files: Vec::new(),
                grid: None,
            };
            Geometry::Mesh { uri: "any.stl".into(), scale: DVec3::ONE, asset: Some(Arc::new(asset)) }
        }
    }
}

fn any_vector(rng: &mut Rng, size: f64) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * 2.0 * size
}

/// Returns a chain of short links, each of one or two shapes.
fn any_arm(rng: &mut Rng) -> Arc<RobotModel> {
    let mut model = chain(rng.usize(1..6));
    for joint in &mut model.joints {
        joint.parent_from_joint = DPose3::from_translation(any_vector(rng, 0.15));
        joint.axis = any_vector(rng, 1.0).normalize_or(DVec3::Z);
        joint.limits.effort = Some(20.0);
    }
    for link in &mut model.links {
        let shapes = 0..rng.usize(1..3);
        let collision = |_| Collision {
            link_from_shape: DPose3::from_translation(any_vector(rng, 0.05)),
            geometry: any_shape(rng),
            material: Default::default(),
        };
        link.collisions = shapes.map(collision).collect();
    }
    Arc::new(model)
}

/// Arms and tables that overlap initially, move, and are added and deleted. The cache of pairs that are
/// ignored or separate saves time and changes nothing. A world that took over the state without it is equal
/// to the bit in each step. So is one that takes it over again sometimes.
#[test]
fn worlds_of_what_is_put_into_each_other_are_exported_and_run_on_to_the_bit() {
    let count = seeds("OVERLAPPING_WORLDS", 10) as usize;
    let (mut ignored, mut own, mut touched, mut parted) = (0, 0, 0, 0);
    for seed in 0..count as u64 {
        let rng = &mut Rng::with_seed(seed);
        let mut world = world(1e-3);
        let mut names = Vec::new();
        for i in 0..rng.usize(2..7) {
            let name = format!("arm-{i}");
            let pose = DPose3::from_translation(any_vector(rng, 0.1));
            let model = if rng.u8(0..4) == 0 { scenes::cuboid(DVec3::splat(0.3), 1.0) } else { any_arm(rng) };
            let contact_settings =
                ContactSettings { self_collision: rng.bool(), ..ContactSettings::default() };
            let fixed = rng.u8(0..6) > 0;
            let passive = rng.bool();
            scenes::spawn(
                &mut world,
                Spawn { contact_settings, passive, ..scenes::robot(&name, &model, pose, fixed) },
            );
            names.push(name);
        }
        if rng.bool() {
            let ground = scenes::plane(DVec3::Z);
            scenes::spawn(&mut world, scenes::robot("ground", &ground, DPose3::IDENTITY, true));
        }
        for round in 0..6 {
            let name = names[rng.usize(..names.len())].clone();
            let pose = Some(DPose3::from_translation(any_vector(rng, 0.2)));
            let joints =
                vec![JointTarget { joint: "joint-1".into(), axis: 0, target: Target::velocity(2.0) }];
            let robots = vec![RobotTargets { robot: name.clone(), joints, ..RobotTargets::default() }];
            let resets = vec![RobotReset { robot: name.clone(), joints: Vec::new() }];
            let command = match rng.u8(0..6) {
                0 => Command::SetEntityState { robot: name, pose, twist: None },
                1 | 2 => Command::SetTargets(SetTargets { robots, ..SetTargets::default() }),
                3 => Command::ResetJoints { robots: resets },
                4 if round > 2 => Command::Delete { robot: name },
                _ => Command::Reset(ResetScope { state: true, ..ResetScope::default() }),
            };
            let _either_way = world.apply(&command);
            (0..rng.usize(1..60)).for_each(|_| world.step());
            apply(&mut world, Command::SaveState { name: "here".into() });
            let saved = through_a_file(&world, "here");
            let state = saved.world_state();
            ignored += state.ignored_overlaps.len();
            own += state.ignored_overlaps.iter().filter(|(robots, _)| robots[0] == robots[1]).count();
            touched += state.contacts.len();
            let mut other = imported(saved.clone());
            for step in 0..120 {
                assert_eq!(
                    other.fingerprint(),
                    world.fingerprint(),
                    "seed {seed}, round {round}, step {step}"
                );
                world.step();
                other.step();
                if step % 7 == 0 {
                    apply(&mut other, Command::SaveState { name: "it".into() });
                    apply(&mut other, Command::RestoreState { name: "it".into() });
                }
            }
            apply(&mut world, Command::SaveState { name: "here".into() });
            parted += state
                .ignored_overlaps
                .len()
                .saturating_sub(through_a_file(&world, "here").world_state().ignored_overlaps.len());
        }
    }
    println!("{ignored} ignored, {own} of one robot, {touched} contacts, {parted} parted");
    assert!(ignored > 20 * count && own > 4 * count && touched > 20 * count && parted > 2 * count);
}

/// Neighbouring links of two arms at one place overlap by about a millimetre or less. To the bit, each arm
/// holds its pose as if it were alone, and moves so if all move alike.
#[test]
fn arms_at_one_place_leave_each_other_alone() {
    for urdf in ["seven_arm/urdf/seven_arm.urdf", "pybullet_data/kuka_iiwa/model.urdf"] {
        let (model, _) = robots::read(urdf);
        let arms = |count: usize| {
            let mut world = world(1e-3);
            for i in 0..count {
                let arm = scenes::robot(&format!("arm-{i}"), &model, DPose3::IDENTITY, true);
                scenes::spawn(&mut world, Spawn { passive: false, ..arm });
            }
            world
        };
        let (mut alone, mut together) = (arms(1), arms(6));
        for step in 0..300 {
            alone.step();
            together.step();
            let (one, all) = (look(&alone).positions, look(&together));
            assert!(all.contacts.is_empty(), "{urdf}, step {step}: {:?}", all.contacts[0]);
            let same = all.positions.chunks_exact(one.len()).all(|arm| arm == one);
            assert!(same, "{urdf}, step {step}");
        }
    }
}

/// Two hundred links in one place are twenty thousand pairs that overlap.
#[test]
fn a_step_of_a_robot_that_overlaps_itself_everywhere_can_be_interrupted() {
    let mut model = chain(200);
    for joint in &mut model.joints {
        joint.parent_from_joint = DPose3::IDENTITY;
    }
    for link in &mut model.links {
        link.collisions = slider().links[1].collisions.clone();
    }
    let model = Arc::new(model);
    let contact_settings = ContactSettings { self_collision: true, ..ContactSettings::default() };
    let shapes = Arc::new(Shapes::new(&model));
    let mut world = world(1e-3);
    let spawn = Spawn { shapes, contact_settings, ..passive(&model, true, &[]) };
    apply(&mut world, Command::Spawn(Box::new(spawn)));
    let before = world.fingerprint();
    let asked = AtomicU64::new(0);
    let interrupt = || asked.fetch_add(1, Relaxed) >= 20;
    assert!(!world.step_interruptible(&interrupt));
    assert_eq!((asked.into_inner(), world.fingerprint()), (21, before));
}

/// A cube that 20 N press some millimetres into a soft wall, deeper than an initial overlap can be. Setting a
/// filter to its present value leaves it there, to a millimetre. Without the contact it would pass through at
/// 1 m/s.
#[test]
fn pressed_bodies_still_touch_after_a_change_of_nothing() {
    let mut soft = scenes::surface(1.0, 0.0);
    for link in &mut soft.links {
        (link.material.contact_stiffness, link.material.contact_damping) = (Some(1e3), Some(100.0));
    }
    let mut model = (*slider()).clone();
    model.joints[0].damping = 20.0;
    let model = Arc::new(model);
    let mut world = world(1e-3);
    let arm = Spawn {
        name: "arm".into(),
        passive: false,
        shapes: Arc::new(Shapes::new(&model)),
        contact_settings: soft.clone(),
        ..passive(&model, false, &[])
    };
    apply(&mut world, Command::Spawn(Box::new(arm)));
    let place = DPose3::from_translation(DVec3::X * 0.3);
    let wall = scenes::robot("wall", &scenes::cuboid(DVec3::splat(0.2), 1.0), place, true);
    scenes::spawn(&mut world, Spawn { contact_settings: soft, ..wall });
    let joints = vec![JointTarget { joint: "joint-1".into(), axis: 0, target: Target::Effort(20.0) }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    run(&mut world, 3.0);
    let before = look(&world).positions[0];
    assert!((0.103..0.16).contains(&before), "{before}");
    let change =
        CollisionFilterChange { robot: "arm".into(), self_collision: Some(false), pairs: Vec::new() };
    apply(&mut world, Command::SetCollisionFilter(change));
    let groups = LinkProperties { collision_group: Some(1), ..LinkProperties::default() };
    apply(
        &mut world,
        Command::SetLinkProperties { robot: "arm".into(), links: vec![groups], stays_awake: None },
    );
    run(&mut world, 0.5);
    let after = look(&world).positions[0];
    assert!((after - before).abs() < 1e-3, "{before} {after}");
}

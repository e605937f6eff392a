//! What is put into each other where nothing can push it apart.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use simd_core::collision::Shapes;
use simd_core::simulation::command::*;
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, JointKind};

use crate::chains::chain;
use crate::world::{apply, look, passive, run, world};

/// A cube of 0.2 m and 1 kg that slides along x, on a base that is fixed.
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

/// To the bit as if the other were not there. Before this rule the arms of a test were thrown
/// thousands of radians away.
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
    // Gravity along the axis is zero but for rounding.
    assert!(together.positions[1].abs() < 1e-12, "{:?}", together.positions);
}

/// Once the second has driven away and come back, it is stopped by the first.
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

/// A crate that is put half into the ground is free to come out, and does.
#[test]
fn what_is_free_comes_out_of_what_it_was_put_into() {
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

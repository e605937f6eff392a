//! Constraint rows that act together: mimic, limits, dry friction, saturation.

use std::sync::Arc;

use simd_core::simulation::command::*;
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{JointKind, JointLimits, Mimic};

use crate::chains::chain;
use simd_tests::world::{apply, look, passive, run, world};

fn driven(model: RobotModel) -> Simulation {
    let mut world = world(1e-3);
    let spawn = Spawn { passive: false, ..passive(&Arc::new(model), false, &[]) };
    apply(&mut world, Command::Spawn(Box::new(spawn)));
    world
}

fn go_to(world: &mut Simulation, joint: &str, position: f64) {
    let target = Target::position(position);
    let joints = vec![JointTarget { joint: joint.into(), axis: 0, target }];
    let robots = vec![RobotTargets { robot: "robot".into(), joints, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// The requirement is 1e-4 rad, while moving and at rest, under gravity; followers are spawned at their
/// positions.
#[test]
fn a_joint_that_mimics_one_that_mimics_another_follows_both() {
    let mut model = chain(3);
    model.joints[1].mimic = Some(Mimic { joint: 0, multiplier: -0.5, offset: 0.1 });
    model.joints[2].mimic = Some(Mimic { joint: 1, multiplier: 2.0, offset: 0.0 });
    let mut world = driven(model);
    assert_eq!(look(&world).positions, [0.0, 0.1, 0.2]);
    go_to(&mut world, "joint-1", 0.8);
    for _ in 0..1000 {
        world.step();
        let q = look(&world).positions;
        assert!((q[1] - (-0.5 * q[0] + 0.1)).abs() < 1e-4, "{q:?}");
        assert!((q[2] - 2.0 * q[1]).abs() < 1e-4, "{q:?}");
    }
    assert!((look(&world).positions[0] - 0.8).abs() < 1e-3);
}

/// The actuator pushes against the stop with its limit, the stop holds.
#[test]
fn a_limit_wins_against_an_actuator_that_pulls_beyond_it() {
    let mut model = chain(2);
    model.joints[1].kind = JointKind::Revolute;
    model.joints[1].limits =
        JointLimits { lower: Some(-0.3), upper: Some(0.4), effort: Some(30.0), velocity: None };
    let mut world = driven(model);
    // An effort target is not clamped by position limits.
    let joints = vec![JointTarget { joint: "joint-2".into(), axis: 0, target: Target::Effort(30.0) }];
    let robots = vec![RobotTargets { robot: "robot".into(), joints, ..RobotTargets::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    run(&mut world, 2.0);
    for _ in 0..500 {
        world.step();
        let seen = look(&world);
        assert!((seen.positions[1] - 0.4).abs() < 1e-3 && seen.velocities[1].abs() < 1e-6, "{seen:?}");
        assert!(seen.flags[1].at_upper);
    }
}

/// Each joint's friction exceeds gravity's torque: nothing moves, not even slowly.
#[test]
fn a_chain_with_enough_friction_does_not_creep() {
    let mut model = chain(4);
    for (i, joint) in model.joints.iter_mut().enumerate() {
        // A chain of n rods stretched out weighs n^2 m g l / 2 on its joint.
        joint.friction = 1.05 * 9.81 * f64::from(4 - i as u32).powi(2) / 2.0;
    }
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(model), false, &[]))));
    // The first steps' sweeps find the impulses, which move it by micrometres; then it stays.
    let first = run(&mut world, 0.5).positions;
    let last = run(&mut world, 10.0).positions;
    assert!(first.iter().all(|q| q.abs() < 1e-5), "{first:?}");
    assert!(first.iter().zip(&last).all(|(a, b)| (a - b).abs() < 1e-9), "{first:?} {last:?}");
}

/// If the friction is just too small, the chain moves.
#[test]
fn a_chain_with_too_little_friction_moves() {
    let mut model = chain(4);
    for (i, joint) in model.joints.iter_mut().enumerate() {
        joint.friction = 0.95 * 9.81 * f64::from(4 - i as u32).powi(2) / 2.0;
    }
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(model), false, &[]))));
    assert!(run(&mut world, 2.0).positions[0] > 0.1);
}

/// A leader that is put somewhere with a velocity takes its follower along. If the follower were left at
/// rest, it would be jerked in the first step and slow the leader. With sliders of equal mass the leader
/// would keep half its velocity.
#[test]
fn a_mimic_joint_gets_the_velocity_of_its_leader_times_the_multiplier() {
    let mut model = chain(2);
    model.joints[1].mimic = Some(Mimic { joint: 0, multiplier: -2.0, offset: 0.1 });
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(model), false, &[]))));
    let joint =
        JointReset { joint: "joint-1".into(), axis: 0, position: 0.3, velocity: 1.5, ..Default::default() };
    let robots = vec![RobotReset { robot: "robot".into(), joints: vec![joint] }];
    apply(&mut world, Command::ResetJoints { robots });
    let seen = look(&world);
    assert_eq!((&seen.positions[..], &seen.velocities[..]), (&[0.3, -0.5][..], &[1.5, -3.0][..]));
}

//! Robots at the limits of number ranges.

use std::sync::Arc;

use simd_core::Command;
use simd_core::simulation::command::*;
use simd_model::robot::Inertial;

use crate::chains::{chain, rod};
use simd_tests::world::{apply, passive, run, world};

fn held(model: simd_model::RobotModel) -> simd_core::PublishedState {
    let mut world = world(1e-3);
    let spawn = Spawn { passive: false, ..passive(&Arc::new(model), false, &[]) };
    apply(&mut world, Command::Spawn(Box::new(spawn)));
    let seen = run(&mut world, 2.0);
    assert!(seen.roots[0].disabled.is_none());
    seen
}

/// Eight million kilograms on the tip of a chain of one-kilogram rods, and a milligram
/// on that: default gains hold them all.
#[test]
fn huge_mass_ratios_are_held() {
    let mut model = chain(4);
    model.links[3].inertial.mass = 8e6;
    model.links[4].inertial.mass = 1e-6;
    model.links[4].inertial.inertia *= 1e-6;
    let seen = held(model);
    assert!(seen.positions.iter().all(|q| q.abs() < 1e-3), "{:?}", seen.positions);
}

#[test]
fn massless_links_in_a_chain_are_held() {
    let mut model = chain(5);
    model.links[2].inertial = Inertial::ZERO;
    model.links[5].inertial = Inertial::ZERO;
    let seen = held(model);
    assert!(seen.positions.iter().all(|q| q.abs() < 2e-3), "{:?}", seen.positions);
}

/// A joint without inertia, damping and actuator has nothing to divide a force by: it keeps its velocity
/// instead of becoming infinite.
#[test]
fn a_passive_joint_without_inertia_is_left_alone() {
    let mut model = chain(2);
    model.links[2].inertial = Inertial::ZERO;
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(model), false, &[]))));
    let seen = run(&mut world, 1.0);
    assert!(seen.roots[0].disabled.is_none() && seen.positions[1].abs() < 1e-9, "{:?}", seen.positions);
}

/// A rotor at 3,000 rad/s (3 rad a step) on an arm: the arm stays finite, the rotor keeps its velocity.
#[test]
fn a_fast_spin_stays_finite() {
    let mut model = chain(2);
    model.joints[1].axis = glamx::DVec3::X;
    model.links[2].inertial = Inertial { center_of_mass: glamx::DVec3::ZERO, ..rod(0.2) };
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(model), false, &[]))));
    let joint = JointReset {
        joint: "joint-2".into(),
        axis: 0,
        position: 0.0,
        velocity: 3000.0,
        ..Default::default()
    };
    let robots = vec![RobotReset { robot: "robot".into(), joints: vec![joint] }];
    apply(&mut world, Command::ResetJoints { robots });
    let seen = run(&mut world, 5.0);
    assert!(seen.roots[0].disabled.is_none());
    assert!(seen.velocities[0].abs() < 20.0 && (seen.velocities[1] - 3000.0).abs() < 30.0, "{seen:?}");
}

/// Sixty rods, each on the tip of the previous one, held stretched out.
#[test]
fn a_long_chain_is_held() {
    let seen = held(chain(60));
    assert!(seen.positions.iter().all(|q| q.abs() < 2e-3), "{:?}", seen.positions);
}

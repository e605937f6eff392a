//! Free swings against Pinocchio's articulated-body algorithm, integrated by
//! Runge-Kutta until it no longer changes: an independent code and an exact answer.

use std::f64::consts::TAU;

use serde::Deserialize;
use simd_core::Command;
use simd_core::simulation::command::*;
use simd_model::robot::Limits;
use simd_tests::robots;

use crate::world::{apply, passive, run, world};

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    urdf: String,
    start: Vec<f64>,
    rates: Vec<f64>,
    damping: f64,
    seconds: f64,
    joints: Vec<String>,
    positions: Vec<f64>,
}

/// Semi-implicit Euler is of first order: a tenth of the time step leaves a tenth of
/// the error, here between a ninth and an eleventh.
#[test]
fn the_error_falls_in_proportion_to_the_time_step() {
    let text = include_str!("../reference/pinocchio.json");
    let reference: Reference = serde_json::from_str(text).unwrap();
    assert!(!reference.cases.is_empty());
    for case in &reference.cases {
        let [coarse, fine] = [1e-4, 1e-5].map(|time_step| error(case, time_step));
        println!("{:25} {coarse:.2e} at 0.1 ms, {fine:.2e} at 0.01 ms", case.name);
        assert!((9.0..11.0).contains(&(coarse / fine)), "{}: {coarse:e} {fine:e}", case.name);
        assert!(fine < 1e-3, "{}: {fine:e}", case.name);
    }
}

/// The largest difference of a joint's position, rad or m; turns do not count.
fn error(case: &Case, time_step: f64) -> f64 {
    let (model, _) = robots::read(&case.urdf);
    let mut world = world(time_step);
    apply(&mut world, Command::Spawn(Box::new(passive(&model, false, &[]))));
    let free = |joint: &String| JointProperties {
        joint: joint.clone(),
        damping: Some(case.damping),
        friction: Some(0.0),
        limits: Some(Limits::default()),
        ..JointProperties::default()
    };
    let joints = case.joints.iter().map(free).collect();
    apply(&mut world, Command::SetJointProperties { robot: "robot".into(), joints });
    let starts = case.joints.iter().zip(case.start.iter().zip(&case.rates));
    let joints = starts.map(|(joint, (&position, &velocity))| JointReset {
        joint: joint.clone(),
        axis: 0,
        position,
        velocity,
    });
    let robots = vec![RobotReset { robot: "robot".into(), joints: joints.collect() }];
    apply(&mut world, Command::ResetJoints { robots });
    let seen = run(&mut world, case.seconds);
    let layout = &seen.world.entities[0];
    let differences = case.joints.iter().zip(&case.positions).map(|(joint, expected)| {
        let index = layout.model.joints.iter().position(|known| &known.name == joint).unwrap();
        let difference = seen.positions[layout.joint_positions[index].start] - expected;
        (difference - TAU * (difference / TAU).round()).abs()
    });
    differences.fold(0.0, f64::max)
}

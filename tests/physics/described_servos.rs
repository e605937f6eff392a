//! Actuators that an MJCF describes act as MuJoCo's: a spring and a damper with a clamped force, on joints and on
//! fixed tendons.
//!
//! The figures are in `tests/reference/described.json`, with the script that made them. MuJoCo took steps of 10 us
//! there, so that the figures are the motion of the law itself.

use glamx::DVec3;
use serde::Deserialize;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, Simulation, simulation::WorldLimits};
use simd_tests::robots;
use simd_tests::world::{apply, look};

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    mjcf: String,
    targets: Vec<Asked>,
    joints: Vec<String>,
    times: Vec<f64>,
    /// By time, then by joint.
    positions: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct Asked {
    joint: String,
    kind: String,
    value: f64,
}

impl Asked {
    fn target(&self) -> Target {
        match self.kind.as_str() {
            "position" => Target::position(self.value),
            "velocity" => Target::velocity(self.value),
            _ => Target::Effort(self.value),
        }
    }
}

/// Returns the largest difference of a position, rad or m.
fn largest_error(case: &Case, integrator: Integrator, time_step: f64) -> f64 {
    let settings =
        PhysicsSettings { time_step, integrator, gravity: DVec3::ZERO, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits::default());
    for (number, described) in robots::described(&case.mjcf).into_iter().enumerate() {
        let spawn = Spawn {
            name: format!("robot_{number}"),
            passive: false,
            pose: described.pose,
            fixed_base: Some(described.fixed),
            ..simd_tests::world::passive(&described.model, false, &[])
        };
        apply(&mut world, Command::Spawn(Box::new(spawn)));
    }
    let state = look(&world);
    // Robot of a joint, and the index of its position in the world.
    let place = |name: &str| {
        let found = state.world.entities.iter().find_map(|entity| {
            let joint = entity.model.joints.iter().position(|joint| joint.name == name)?;
            Some((entity.name.clone(), entity.positions.start + entity.joint_positions[joint].start))
        });
        found.unwrap_or_else(|| panic!("no joint {name}"))
    };
    let robots = case.targets.iter().map(|asked| RobotTargets {
        robot: place(&asked.joint).0,
        joints: vec![JointTarget { joint: asked.joint.clone(), axis: 0, target: asked.target() }],
        ..RobotTargets::default()
    });
    let robots = robots.collect();
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    let places: Vec<usize> = case.joints.iter().map(|joint| place(joint).1).collect();
    let mut largest = 0.0_f64;
    let mut steps = 0;
    for (time, expected) in case.times.iter().zip(&case.positions) {
        while steps < (time / time_step).round() as u64 {
            world.step();
            steps += 1;
        }
        let seen = look(&world).positions;
        for (place, expected) in places.iter().zip(expected) {
            largest = largest.max((seen[*place] - expected).abs());
        }
    }
    largest
}

/// Leapfrog's error is of second order in the step. Euler's is of first order, and largest for the motor that
/// saturates, whose gains are stiff.
#[test]
fn described_actuators_move_their_joints_as_in_mujoco() {
    let text = include_str!("../reference/described.json");
    let reference: Reference = serde_json::from_str(text).unwrap();
    let mut failures = Vec::new();
    for case in &reference.cases {
        for (integrator, tolerance) in [(Integrator::Leapfrog, 5e-5), (Integrator::Euler, 1e-2)] {
            let error = largest_error(case, integrator, 1e-3);
            println!("{:55} {integrator:?} {error:.1e}", case.name);
            if error.is_nan() || error > tolerance {
                failures.push(format!("{} with {integrator:?}: {error:e}", case.name));
            }
        }
    }
    assert!(!reference.cases.is_empty() && failures.is_empty(), "{failures:#?}");
}

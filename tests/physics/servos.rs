//! Servos: the velocity after a substep is `velocity + rate (target - q) + slip free`, where `free` is the
//! velocity after it if no actuator acted. Bullet's joint motors have the same formula
//! (`btMultiBodyJointMotor`).

use std::sync::Arc;

use fastrand::Rng;
use simd_core::simulation::command::*;
use simd_core::{Command, Simulation};
use simd_model::robot::JointKind;
use simd_tests::scenes::{robot, spawn};
use simd_tests::world::{apply, euler, look};

use crate::chains::{chain, rod};

/// A servo without a limit of effort, and with a damper that leaves 1e-9 of a difference.
#[derive(Clone, Copy)]
struct Servo {
    position: f64,
    rate: f64,
    velocity: f64,
    slip: f64,
}

impl Servo {
    fn target(self, max_effort: Option<f64>, max_velocity: Option<f64>) -> Target {
        let Self { position, rate, velocity, slip } = self;
        let damping = Some(1e12);
        Target::Servo { position, rate, velocity, slip, damping, feed_forward: 0.0, max_effort, max_velocity }
    }
}

fn arm(rng: &mut Rng, joints: usize, time_step: f64) -> (Simulation, Vec<f64>) {
    let mut world = euler(time_step);
    let mut model = chain(joints);
    for link in &mut model.links[1..] {
        link.inertial = rod(0.3 + rng.f64());
    }
    let model = Arc::new(model);
    let spawned = Spawn { passive: true, ..robot("robot", &model, glamx::DPose3::IDENTITY, true) };
    spawn(&mut world, spawned);
    let joints: Vec<_> = (1..=joints)
        .map(|number| JointReset {
            joint: format!("joint-{number}"),
            position: rng.f64() - 0.5,
            velocity: 4.0 * (rng.f64() - 0.5),
            ..JointReset::default()
        })
        .collect();
    let positions = joints.iter().map(|joint| joint.position).collect();
    let robots = vec![RobotReset { robot: "robot".into(), joints }];
    apply(&mut world, Command::ResetJoints { robots });
    (world, positions)
}

fn drive(world: &mut Simulation, targets: impl Iterator<Item = Target>) {
    let joint = |(i, target)| JointTarget { joint: format!("joint-{}", i + 1), axis: 0, target };
    let joints = targets.enumerate().map(joint).collect();
    let robots = vec![RobotTargets { robot: "robot".into(), joints, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

#[test]
fn the_velocity_after_a_step_is_the_servos_formula_for_all_joints_of_an_arm_at_once() {
    for seed in 0..300 {
        let mut rng = Rng::with_seed(seed);
        let (joints, time_step) = (rng.usize(1..=5), 1e-3 * (1.0 + 9.0 * rng.f64()));
        let (mut free, _) = arm(&mut rng.clone(), joints, time_step);
        let (mut world, positions) = arm(&mut rng, joints, time_step);
        free.step();
        let free = look(&free).velocities;
        let servos: Vec<Servo> = (0..joints)
            .map(|_| Servo {
                position: rng.f64() - 0.5,
                rate: if rng.bool() { 0.0 } else { rng.f64() / time_step },
                velocity: rng.f64() - 0.5,
                slip: if rng.bool() { 0.0 } else { 2.0 * rng.f64() - 1.0 },
            })
            .collect();
        drive(&mut world, servos.iter().map(|servo| servo.target(None, Some(50.0))));
        world.step();
        let got = look(&world).velocities;
        for (i, servo) in servos.iter().enumerate() {
            let wanted = servo.velocity + servo.rate * (servo.position - positions[i]) + servo.slip * free[i];
            let wanted = wanted.clamp(-50.0, 50.0);
            let off = (got[i] - wanted).abs();
            assert!(off < 1e-5 * (1.0 + wanted.abs()), "seed {seed}, joint {i}: {} and not {wanted}", got[i]);
        }
    }
}

/// The impulse of a step is at most `max_effort` h, on the moment m l^2 / 3 of a rod about its end.
#[test]
fn a_servo_changes_the_free_velocity_by_no_more_than_its_effort_can() {
    for seed in 0..300 {
        let mut rng = Rng::with_seed(seed);
        let time_step = 1e-3 * (1.0 + 9.0 * rng.f64());
        let (mut free, length) = (arm(&mut rng.clone(), 1, time_step).0, 0.3 + rng.clone().f64());
        let (mut world, positions) = arm(&mut rng, 1, time_step);
        free.step();
        let (free, moment) = (look(&free).velocities[0], length * length / 3.0);
        let max_effort = 10f64.powf(4.0 * rng.f64() - 2.0);
        let servo =
            Servo { position: rng.f64() - 0.5, rate: 0.3 / time_step, velocity: 0.0, slip: rng.f64() };
        drive(&mut world, std::iter::once(servo.target(Some(max_effort), None)));
        world.step();
        let (got, most) = (look(&world).velocities[0], max_effort * time_step / moment);
        let asked = servo.rate * (servo.position - positions[0]) + servo.slip * free;
        let wanted = free + (asked - free).clamp(-most, most);
        assert!((got - wanted).abs() < 1e-5 * (1.0 + wanted.abs()), "seed {seed}: {got} and not {wanted}");
    }
}

/// Substeps compute the servo's velocity again: with `n` of them a joint that may move freely keeps
/// `(1 - rate h)^n` of its error.
#[test]
fn each_substep_computes_the_velocity_again() {
    for parts in [1, 2, 4, 10] {
        let mut rng = Rng::with_seed(7);
        let (mut world, positions) = arm(&mut rng, 1, 0.01);
        let physics = PhysicsChange { substeps: Some(parts), ..PhysicsChange::default() };
        apply(&mut world, Command::SetPhysics(physics));
        let rate = 0.1 / (0.01 / f64::from(parts));
        let servo = Servo { position: 0.4, rate, velocity: 0.0, slip: 0.0 };
        drive(&mut world, std::iter::once(servo.target(None, None)));
        world.step();
        let wanted = 0.4 + (positions[0] - 0.4) * 0.9f64.powi(parts as i32);
        let got = look(&world).positions[0];
        assert!((got - wanted).abs() < 1e-6, "{parts} substeps: {got} and not {wanted}");
    }
}

/// A limit stops the joint, and the position that is asked for stays where it was.
#[test]
fn a_servo_presses_against_a_limit_that_its_position_lies_beyond() {
    let mut model = chain(1);
    model.joints[0].kind = JointKind::Revolute;
    (model.joints[0].limits.lower, model.joints[0].limits.upper) = (Some(-0.2), Some(0.2));
    let mut world = euler(1e-3);
    spawn(&mut world, robot("robot", &model.into(), glamx::DPose3::IDENTITY, true));
    let servo = Servo { position: 1.0, rate: 100.0, velocity: 0.0, slip: 0.0 };
    drive(&mut world, std::iter::once(servo.target(Some(50.0), None)));
    for _ in 0..500 {
        world.step();
    }
    let seen = look(&world);
    assert_eq!(seen.targets[0], 1.0);
    assert!((seen.positions[0] - 0.2).abs() < 1e-3, "{} rad", seen.positions[0]);
    assert_eq!(seen.efforts[0], 50.0);
}

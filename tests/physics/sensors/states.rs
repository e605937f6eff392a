//! States of links, encoders and odometry; and when samples are taken.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::{CreateSensor, PhysicsChange, ResetScope};
use simd_core::simulation::measure::{Measurement, MotionMeasurement};
use simd_core::{Command, Simulation};
use simd_model::sensor::SensorKind;
use simd_tests::scenes::{apply, ball, robot, spawn, throw};

use super::{add, create, measured, sample};
use crate::chains::chain;
use simd_tests::world::{look, passive, world};

/// Returns a free ball with a twist.
fn flying(linear: DVec3, angular: DVec3) -> Simulation {
    let mut world = world(1e-3);
    let change = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    apply(&mut world, Command::SetPhysics(change));
    let pose = DPose3::from_parts(DVec3::new(1.0, 2.0, 3.0), DQuat::from_rotation_z(0.5));
    spawn(&mut world, robot("ball", &ball(0.1, 1.0), pose, false));
    throw(&mut world, "ball", linear, angular);
    world
}

/// The link's published state, at the sensor's place: v + w x r. To rounding.
#[test]
fn the_state_of_a_link_is_that_of_the_sensors_frame() {
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(2)), false, &[0.4, -0.9]))));
    let pose = DPose3::from_parts(DVec3::new(0.3, 0.1, -0.2), DQuat::from_rotation_x(0.6));
    add(&mut world, create("robot", "link-2", pose, SensorKind::LinkState));
    for _ in 0..300 {
        let state = measured(&mut world);
        let [Measurement::LinkState(MotionMeasurement { pose: seen, linear, angular })] = state[..] else {
            panic!("{state:?}");
        };
        let published = look(&world);
        let (link, twist) = (published.link_poses(0).unwrap()[2], published.link_twists(0).unwrap()[2]);
        let expected = link * pose;
        assert!((seen.translation - expected.translation).length() < 1e-12);
        assert!(seen.rotation.dot(expected.rotation).abs() > 1.0 - 1e-12);
        let reach = link.rotation * pose.translation;
        assert!((linear - (twist.0 + twist.1.cross(reach))).length() < 1e-9, "{linear}");
        assert!((angular - twist.1).length() < 1e-9);
    }
}

/// After a second at v and w, relative to the pose at the sensor's creation. The pose is turned by w, and
/// displaced by v in the initial axes.
#[test]
fn odometry_counts_from_where_it_began_in_the_sensors_axes() {
    let (linear, angular) = (DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.0, 0.8));
    let mut world = flying(linear, angular);
    (0..700).for_each(|_| world.step());
    let began = look(&world).link_poses(0).unwrap()[0];
    add(&mut world, create("ball", "body", DPose3::IDENTITY, SensorKind::Odometry));
    let mut last = None;
    (0..1_000).for_each(|_| last = measured(&mut world).pop());
    let Some(Measurement::Odometry(MotionMeasurement { pose, linear: forwards, angular: turning })) = last
    else {
        panic!("{last:?}");
    };
    let back = began.rotation.inverse();
    assert!((pose.translation - back * linear).length() < 1e-9, "{pose:?}");
    assert!((pose.rotation.to_scaled_axis() - angular).length() < 1e-9, "{pose:?}");
    let now = look(&world).link_poses(0).unwrap()[0].rotation.inverse();
    assert!((forwards - now * linear).length() < 1e-9, "{forwards}");
    assert!((turning - angular).length() < 1e-9, "{turning}");

    // A reset of the state puts it back, and counts from there.
    apply(&mut world, Command::Reset(ResetScope { state: true, ..ResetScope::default() }));
    let after = measured(&mut world);
    let [Measurement::Odometry(MotionMeasurement { pose, .. })] = after[..] else { panic!("{after:?}") };
    assert!(pose.translation.length() < 1e-12, "{pose:?}");
}

/// The position and the velocity that are published.
#[test]
fn an_encoder_shows_its_joint() {
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(2)), false, &[0.4, -0.9]))));
    add(&mut world, create("robot", "joint-2", DPose3::IDENTITY, SensorKind::Encoder { backlash: 0.0 }));
    for _ in 0..100 {
        let shown = measured(&mut world);
        let [Measurement::Encoder(encoder)] = shown[..] else { panic!("{shown:?}") };
        let state = look(&world);
        assert_eq!((encoder.position, encoder.velocity), (state.positions[1], state.velocities[1]));
    }
}

/// A rod that swings to and fro behind a gear with play. The encoder is half of the play behind the joint.
/// When the rod turns back, it stands still until the rod has crossed the play. An encoder sampled each tenth
/// step agrees with one of each step. No tolerance: a position only has half of the play added or subtracted.
#[test]
fn an_encoder_with_backlash_stands_still_while_its_joint_crosses_the_play() {
    let (start, half) = (0.4, 0.15);
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(1)), false, &[start]))));
    let kind = SensorKind::Encoder { backlash: 2.0 * half };
    let encoder = |rate| CreateSensor { rate, ..create("robot", "joint-1", DPose3::IDENTITY, kind) };
    add(&mut world, encoder(None));
    add(&mut world, encoder(Some(100.0)));
    // Position of the encoder when the rod turned back, and of the joint in the step before.
    let (mut held, mut before, mut was_rising) = (start, start, true);
    let (mut shaft, mut turns, mut stood) = (start, 0, 0);
    for step in 1..=5_000 {
        let shown = measured(&mut world);
        let state = look(&world);
        let (joint, velocity) = (state.positions[0], state.velocities[0]);
        let is_rising = joint > before;
        if is_rising != was_rising {
            (held, turns) = (shaft, turns + 1);
        }
        let last = shaft;
        shaft = if is_rising { held.max(joint - half) } else { held.min(joint + half) };
        stood += usize::from(shaft == last);
        (before, was_rising) = (joint, is_rising);
        let expected = (shaft, if shaft == last { 0.0 } else { velocity });
        assert_eq!(shown.len(), if step % 10 == 0 { 2 } else { 1 });
        for shown in shown {
            let Measurement::Encoder(encoder) = shown else { panic!("{shown:?}") };
            assert_eq!((encoder.position, encoder.velocity), expected, "step {step}, joint at {joint}");
        }
    }
    assert!(turns >= 4 && stood > 200, "{turns} {stood}");
    // Put back, it begins in the middle of its play once more.
    apply(&mut world, Command::Reset(ResetScope { state: true, ..ResetScope::default() }));
    let [Measurement::Encoder(encoder), ..] = measured(&mut world)[..] else { panic!("no reading") };
    assert_eq!((encoder.position, encoder.velocity), (start, 0.0));
}

/// Returns the steps in which a sensor of a rate takes samples.
fn steps(world: &mut Simulation, count: usize) -> Vec<u64> {
    let mut steps = Vec::new();
    for _ in 0..count {
        steps.extend(sample(world).iter().map(|reading| reading.at.step));
    }
    steps
}

/// Sample k is of the first step whose time is at least k / rate.
#[test]
fn samples_are_taken_by_the_first_step_that_reaches_their_time() {
    for (rate, expected) in [
        (Some(100.0), vec![10, 20, 30, 40]),
        (Some(300.0), vec![4, 7, 10, 14, 17, 20, 24, 27, 30, 34, 37, 40]),
        (Some(1e5), (1..=40).collect()),
        (Some(1000.0), (1..=40).collect()),
        (None, (1..=40).collect()),
        (Some(24.0), vec![]),
        (Some(25.0), vec![40]),
    ] {
        let mut world = flying(DVec3::ZERO, DVec3::ZERO);
        let imu = create("ball", "body", DPose3::IDENTITY, SensorKind::Imu);
        add(&mut world, CreateSensor { rate, ..imu });
        assert_eq!(steps(&mut world, 40), expected, "{rate:?}");
    }
}

/// In a hundred thousand steps of a millisecond there are as many samples as the rate requires: rounding does
/// not accumulate.
#[test]
fn no_sample_is_left_out_in_the_long_run() {
    let mut world = flying(DVec3::ZERO, DVec3::ZERO);
    let imu = create("ball", "body", DPose3::IDENTITY, SensorKind::Imu);
    add(&mut world, CreateSensor { rate: Some(130.0), ..imu });
    let mut due = Vec::new();
    for _ in 0..100_000 {
        world.step();
        due.clear();
        world.take_due_samples(&mut due);
        assert!(due.len() <= 1);
        if let Some(sample) = due.first() {
            assert_eq!(sample.sample, (sample.at.sim_time * 130.0 + 1e-6).floor() as u64);
        }
    }
}

/// Steps become ten times as long: sim time counts.
#[test]
fn samples_keep_their_rate_where_the_time_step_changes() {
    let mut world = flying(DVec3::ZERO, DVec3::ZERO);
    let imu = create("ball", "body", DPose3::IDENTITY, SensorKind::Imu);
    add(&mut world, CreateSensor { rate: Some(50.0), ..imu });
    assert_eq!(steps(&mut world, 30), [20]);
    let change = PhysicsChange { time_step: Some(0.01), ..PhysicsChange::default() };
    apply(&mut world, Command::SetPhysics(change));
    // 0.03 s at step 30; 0.04 s at step 31, 0.06 s at step 33.
    assert_eq!(steps(&mut world, 6), [31, 33, 35]);
}

#[test]
fn a_reset_of_time_counts_samples_again() {
    let mut world = flying(DVec3::ZERO, DVec3::ZERO);
    let imu = create("ball", "body", DPose3::IDENTITY, SensorKind::Imu);
    add(&mut world, CreateSensor { rate: Some(100.0), ..imu });
    assert_eq!(steps(&mut world, 25), [10, 20]);
    apply(&mut world, Command::Reset(ResetScope { time: true, ..ResetScope::default() }));
    let mut readings = Vec::new();
    (0..10).for_each(|_| readings.extend(sample(&mut world)));
    assert_eq!(readings.len(), 1);
    assert_eq!((readings[0].sample, readings[0].at.step), (1, 10));
}

//! Sensors compared with MuJoCo's. The scenes are an arm with a welded tool, a cart with a pole, and a flying
//! body. Others are rays of a turning head, and a resting box with a lid on it. `tests/reference/sensors.py`
//! made the figures; its output beside simd's is in docs/sensors.md.

use std::sync::Arc;

use glamx::DVec3;
use serde::Deserialize;
use simd_core::simulation::command::{JointReset, RobotReset};
use simd_core::simulation::measure::{Measurement, MotionMeasurement, SensorReading};
use simd_core::{Command, Simulation};
use simd_model::{LoadLimits, ReadOptions};
use simd_tests::robots::NoFiles;
use simd_tests::scenes::{apply, robot, spawn, throw};

use super::sample;
use simd_tests::world::euler;

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    time_step: f64,
    /// Something rests on something.
    touches: bool,
    joints: Vec<JointStart>,
    twists: Vec<TwistStart>,
    mjcf: String,
    readings: Vec<Expected>,
}

#[derive(Deserialize)]
struct JointStart {
    robot: String,
    joint: String,
    position: f64,
    velocity: f64,
}

#[derive(Deserialize)]
struct TwistStart {
    robot: String,
    linear: [f64; 3],
    angular: [f64; 3],
}

#[derive(Deserialize)]
struct Expected {
    step: u64,
    sensor: String,
    quantity: String,
    /// A quaternion is x y z w; a ray without a hit is -1.
    values: Vec<f64>,
}

/// Both codes do the same arithmetic in another order. For resting bodies, MuJoCo's solver is iterated and
/// simd's contacts hold to 1e-6.
#[test]
fn sensors_measure_what_mujocos_do() {
    let text = include_str!("../../reference/sensors.json");
    let reference: Reference = serde_json::from_str(text).unwrap();
    let mut failures = Vec::new();
    for case in &reference.cases {
        let (error, where_) = largest_error(case);
        println!("{:30} {error:.1e} {where_}", case.name);
        let tolerance = if case.touches { 1e-6 } else { 1e-9 };
        if error.is_nan() || error > tolerance {
            failures.push(format!("{}: {where_} is {error:e} off", case.name));
        }
    }
    assert!(reference.cases.len() > 5 && failures.is_empty(), "{failures:#?}");
}

fn loaded(case: &Case) -> Simulation {
    let translation =
        simd_model::translate(case.mjcf.as_bytes(), &NoFiles, &LoadLimits::default()).unwrap().unwrap();
    let mut world = euler(case.time_step);
    for translated in &translation.models {
        let (model, _) =
            simd_model::read(translated.urdf.as_bytes(), &NoFiles, &ReadOptions::default()).unwrap();
        let model = Arc::new(model);
        spawn(&mut world, robot(&translated.name, &model, translated.pose, translated.fixed));
    }
    for JointStart { robot, joint, position, velocity } in &case.joints {
        let joint = JointReset {
            joint: joint.clone(),
            position: *position,
            velocity: *velocity,
            ..Default::default()
        };
        let robots = vec![RobotReset { robot: robot.clone(), joints: vec![joint] }];
        apply(&mut world, Command::ResetJoints { robots });
    }
    for TwistStart { robot, linear, angular } in &case.twists {
        throw(&mut world, robot, DVec3::from_array(*linear), DVec3::from_array(*angular));
    }
    world
}

/// Returns the largest error of all quantities, relative to their size if that is above 1, and its quantity.
fn largest_error(case: &Case) -> (f64, String) {
    let mut world = loaded(case);
    let mut worst = (0.0, String::new());
    let last = case.readings.iter().map(|expected| expected.step).max().unwrap();
    for step in 1..=last {
        let readings = sample(&mut world);
        for expected in case.readings.iter().filter(|expected| expected.step == step) {
            let reading = readings.iter().find(|reading| reading.definition.name == expected.sensor).unwrap();
            let measured = part(reading, &expected.quantity);
            assert_eq!(measured.len(), expected.values.len(), "{}", expected.sensor);
            let error = difference(&measured, &expected.values, expected.quantity == "orientation");
            if error.is_nan() || error > worst.0 {
                worst = (error, format!("{} of {} after {step} steps", expected.quantity, expected.sensor));
            }
        }
    }
    worst
}

fn difference(measured: &[f64], expected: &[f64], is_quaternion: bool) -> f64 {
    let size = expected.iter().map(|value| value * value).sum::<f64>().sqrt().max(1.0);
    let largest = |sign: f64| {
        let errors = measured.iter().zip(expected).map(|(a, b)| (a - sign * b).abs());
        errors.fold(0.0, |most: f64, next| if next.is_nan() { next } else { most.max(next) })
    };
    // A quaternion and its negative are one turn.
    let error = if is_quaternion { largest(1.0).min(largest(-1.0)) } else { largest(1.0) };
    error / size
}

/// Returns a quantity of a reading.
fn part(reading: &SensorReading, quantity: &str) -> Vec<f64> {
    let of_motion = |motion: &MotionMeasurement| match quantity {
        "position" => motion.pose.translation.to_array().to_vec(),
        "orientation" => motion.pose.rotation.to_array().to_vec(),
        "linear_velocity" => motion.linear.to_array().to_vec(),
        "angular_velocity" => motion.angular.to_array().to_vec(),
        other => panic!("{other}"),
    };
    match (&reading.measurement, quantity) {
        (Measurement::Imu(imu), "linear_acceleration") => imu.linear_acceleration.to_array().to_vec(),
        (Measurement::Imu(imu), "angular_velocity") => imu.angular_velocity.to_array().to_vec(),
        (Measurement::ForceTorque(wrench), "force") => wrench.force.to_array().to_vec(),
        (Measurement::ForceTorque(wrench), "torque") => wrench.torque.to_array().to_vec(),
        (Measurement::Contact(contact), "normal_force") => vec![contact.normal_force],
        (Measurement::Range(range), "range") => vec![if range.is_finite() { *range } else { -1.0 }],
        (Measurement::Encoder(encoder), "position") => vec![encoder.position],
        (Measurement::Encoder(encoder), "velocity") => vec![encoder.velocity],
        (Measurement::LinkState(motion) | Measurement::Odometry(motion), _) => of_motion(motion),
        (other, quantity) => panic!("{quantity} of {other:?}"),
    }
}

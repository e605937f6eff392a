//! The seven-joint arm held against gravity.

use simd_core::Command;
use simd_core::simulation::command::*;
use simd_tests::robots;

use simd_tests::world::{apply, passive, run, world};

/// At rest the spring carries only gravity: target - q = gravity effort / stiffness, with the effort that
/// the actuator reports. 1e-9 rad is far above rounding (1e-13 here) and far below the error of a solver with
/// a tolerance.
#[test]
fn the_static_error_is_gravity_over_stiffness() {
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let mut world = world(1e-3);
    let bent = [0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4];
    let spawn = Spawn { passive: false, ..passive(&model, false, &bent) };
    apply(&mut world, Command::Spawn(Box::new(spawn)));
    let seen = run(&mut world, 3.0);
    let joints = seen.joint_status(0).unwrap();
    let moving =
        joints.iter().zip(&model.joints).filter(|(_, j)| j.kind != simd_model::robot::JointKind::Fixed);
    let mut largest = 0.0f64;
    for (i, (joint, _)) in moving.enumerate() {
        let error = bent[i] - seen.positions[i];
        assert!((error - seen.efforts[i] / joint.gains.0).abs() < 1e-9, "joint {i}");
        largest = largest.max(error.abs());
    }
    assert!(largest > 1e-6 && largest < 1e-3, "gravity bends the arm a little: {largest}");
}

/// From rest to rest with a quintic in a second. The spring lags by the acceleration over the square of its
/// 300 rad/s (5.8 A / 9e4, below 1e-4 rad). It sags by gravity, by less than 1 mrad in the test above; the
/// other joints' accelerations add as much again.
#[test]
fn a_trajectory_is_followed_within_milliradians_of_its_polynomial() {
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let mut world = world(1e-3);
    let start = [0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4];
    let goal = [-0.2, 0.4, 0.1, -0.6, -0.5, 0.3, 0.8];
    let spawn = Spawn { passive: false, ..passive(&model, false, &start) };
    apply(&mut world, Command::Spawn(Box::new(spawn)));
    let moving = model.joints.iter().filter(|joint| joint.kind != simd_model::robot::JointKind::Fixed);
    let point = TrajectoryPoint {
        time: 1.0,
        positions: goal.to_vec(),
        velocities: vec![0.0; 7],
        accelerations: vec![0.0; 7],
        efforts: Vec::new(),
    };
    let request = FollowTrajectory {
        robot: "robot".into(),
        joints: moving.map(|joint| joint.name.clone()).collect(),
        points: std::sync::Arc::new(vec![point]),
        ..FollowTrajectory::default()
    };
    apply(&mut world, Command::FollowTrajectory(request));
    let mut largest = 0.0f64;
    for step in 1..=1000 {
        let seen = run(&mut world, 1e-3);
        let u = f64::from(step) * 1e-3;
        let along = 10.0 * u.powi(3) - 15.0 * u.powi(4) + 6.0 * u.powi(5);
        for joint in 0..7 {
            let wanted = start[joint] + (goal[joint] - start[joint]) * along;
            largest = largest.max((seen.positions[joint] - wanted).abs());
        }
    }
    assert!(largest < 3e-3, "{largest}");
    let ended = world.take_events().into_iter().any(|event| {
        matches!(event.kind, simd_core::simulation::EventKind::TrajectoryEnded { end, .. }
            if end == simd_core::simulation::trajectory::TrajectoryEnd::Succeeded)
    });
    assert!(ended);
}

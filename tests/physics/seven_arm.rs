//! The seven-joint arm held against gravity.

use simd_core::Command;
use simd_core::simulation::command::*;
use simd_tests::robots;

use crate::world::{apply, passive, run, world};

/// At rest the spring carries gravity alone: target - q = gravity effort / stiffness,
/// where the effort is what the actuator reports. 1e-9 rad is far above rounding
/// (1e-13 here) and far below what a solver with a tolerance leaves.
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

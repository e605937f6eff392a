//! A floating joint inside a robot: six degrees of freedom, and no tie.

use std::sync::Arc;

use glamx::DVec3;
use simd_core::simulation::command::*;
use simd_core::{Command, PublishedState};
use simd_model::robot::JointKind;

use crate::chains::chain;
use simd_tests::world::{apply, look, passive, run, world};

/// Returns the centre of mass of link 2 in the world.
fn centre(seen: &PublishedState) -> DVec3 {
    let link = &seen.world.entities[0].model.links[2];
    seen.link_poses(0).unwrap()[2].transform_point(link.inertial.center_of_mass)
}

/// A rod on a floating joint, on an arm that turns at 2 rad/s: whatever the arm does, the rod's centre of
/// mass is thrown. It starts with the arm's speed there, and then only gravity acts. So x stays on its line
/// and z on its parabola, to first order in the step. The velocity is stored in the axes of an arm that
/// reaches 7 rad/s, hence the constant of 16 m/s.
#[test]
fn a_link_on_a_floating_joint_is_thrown_by_a_turning_arm() {
    let mut model = chain(2);
    model.joints[1].kind = JointKind::Floating;
    let model = Arc::new(model);
    let mut worst = Vec::new();
    for time_step in [1e-3, 1e-4] {
        let mut world = world(time_step);
        apply(&mut world, Command::Spawn(Box::new(passive(&model, false, &[]))));
        let joint = JointReset {
            joint: "joint-1".into(),
            axis: 0,
            position: 0.0,
            velocity: 2.0,
            ..Default::default()
        };
        let robots = vec![RobotReset { robot: "robot".into(), joints: vec![joint] }];
        apply(&mut world, Command::ResetJoints { robots });
        let start = centre(&look(&world));
        assert!((start - DVec3::new(1.5, 0.0, 0.0)).length() < 1e-12);
        // Turning about y at 2 rad/s, 1.5 m out along x.
        let velocity = DVec3::new(0.0, 0.0, -3.0);
        let seen = run(&mut world, 0.5);
        let thrown = start + velocity * 0.5 + DVec3::new(0.0, 0.0, -9.81) * (0.5 * 0.5 * 0.5);
        worst.push((centre(&seen) - thrown).length());
    }
    println!("{worst:?}");
    assert!(worst[1] < 2e-3 && worst[0] / worst[1] > 8.0, "{worst:?}");
}

//! Equality of joint responses to several impulses with single ones, and of one link's pose with the pose
//! among all.

use glamx::DMat3;
use pulp::{Scalar, Simd};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind, JointLimits, Link};

use super::*;
use crate::dynamics::constraint::{MultiRhsSolve, Row, Sums, respond, respond_to_joints};
use crate::dynamics::spatial::Spatial;

/// Returns a chain of links with branches and a joint of each kind.
fn robot(is_fixed: bool) -> Articulation {
    let link = |index: usize| Link {
        name: format!("link_{index}"),
        inertial: Inertial {
            mass: 1.0 + 0.3 * index as f64,
            center_of_mass: DVec3::new(0.1, -0.05 * index as f64, 0.02),
            inertia: DMat3::from_diagonal(DVec3::new(0.02, 0.03, 0.01 * (1.0 + index as f64))),
        },
        visuals: Vec::new(),
        collisions: Vec::new(),
    };
    let joint = |(index, (kind, parent)): (usize, (JointKind, usize))| Joint {
        name: format!("joint_{index}"),
        kind,
        parent,
        child: index + 1,
        parent_from_joint: DPose3::from_parts(
            DVec3::new(0.1, 0.2, -0.3 * index as f64),
            DQuat::from_rotation_x(0.4 * index as f64),
        ),
        axis: DVec3::new(0.6, 0.0, 0.8),
        limits: JointLimits::default(),
        damping: 0.1,
        friction: 0.0,
        mimic: None,
    };
    let joints = [
        (JointKind::Revolute, 0),
        (JointKind::Prismatic, 1),
        (JointKind::Spherical, 1),
        (JointKind::Floating, 2),
        (JointKind::Continuous, 4),
    ];
    let model = RobotModel {
        name: "robot".into(),
        links: (0..=joints.len()).map(link).collect(),
        joints: joints.into_iter().enumerate().map(joint).collect(),
        ..RobotModel::default()
    };
    let pose = DPose3::from_parts(DVec3::new(0.3, -0.2, 1.0), DQuat::from_rotation_y(0.7));
    let tree = Arc::new(Tree::new(&model, is_fixed));
    let mut positions = vec![0.3; tree.position_count - tree.root_positions()];
    for body in &tree.bodies {
        // Quaternions.
        let start = match body.joint_type {
            JointType::Free { .. } => body.position + 3,
            JointType::Spherical { axis: 0 } => body.position,
            _ => continue,
        };
        if let Some(start) = start.checked_sub(tree.root_positions()) {
            positions[start..start + 4].copy_from_slice(&[0.6, 0.0, 0.0, 0.8]);
        }
    }
    let mut robot = Articulation::new(tree, pose, Vec::new(), &positions);
    robot.update_kinematics();
    robot.start(DVec3::NEG_Z * 9.81, 1e-3, Integrator::Leapfrog);
    robot
}

/// Returns the responses to the six unit wrenches on a body, with these vectors.
fn responses<S: Simd>(simd: S, robot: &mut Articulation, body: usize) -> Vec<f64> {
    let mut out = vec![0.0; 6 * robot.tree.velocity_count];
    let scratch = &mut robot.scratch.passes;
    let q = &robot.state.positions;
    simd.vectorize(MultiRhsSolve::of_unit_forces(&robot.tree, q, body, scratch, &mut out));
    out
}

#[test]
fn responses_to_six_wrenches_are_those_to_each_and_the_same_bits_by_all_vectors() {
    for is_fixed in [false, true] {
        let mut robot = robot(is_fixed);
        let n = robot.tree.velocity_count;
        for body in 0..robot.tree.bodies.len() {
            let found = responses(Scalar, &mut robot, body);
            let mut alone = vec![0.0; 6 * n];
            for (k, alone) in alone.chunks_exact_mut(n).enumerate() {
                let mut wrench = Spatial::ZERO;
                match k {
                    0..3 => wrench.angular[k] = 1.0,
                    _ => wrench.linear[k - 3] = 1.0,
                }
                robot.wrench_response(body, wrench, alone);
            }
            let largest = alone.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            assert!(largest > 0.0, "{body}");
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12 * largest;
            assert!(found.iter().zip(&alone).all(near), "{body}: {found:?} {alone:?}");
            #[cfg(target_arch = "x86_64")]
            {
                let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                if let Some(simd) = pulp::x86::V3::try_new() {
                    assert_eq!(bits(&responses(simd, &mut robot, body)), bits(&found), "{body}");
                }
                if let Some(simd) = pulp::x86::V4::try_new() {
                    assert_eq!(bits(&responses(simd, &mut robot, body)), bits(&found), "{body}");
                }
            }
        }
    }
}

#[test]
fn responses_to_rows_of_joints_are_those_to_each() {
    let mut robot = robot(false);
    let n = robot.tree.velocity_count;
    let turns = |body: &Body| !matches!(body.joint_type, JointType::Free { .. });
    let joints: Vec<usize> =
        (0..robot.tree.bodies.len()).filter(|body| turns(&robot.tree.bodies[*body])).collect();
    for pair in joints.windows(2) {
        let joints = [(pair[0], 1.0), (pair[1], -0.7)];
        let velocity = |(body, factor): (usize, f64)| (robot.tree.bodies[body].velocity, factor);
        let row = Row { bodies: [pair[0], pair[1]], entries: joints.map(velocity), ..Row::default() };
        let (mut together, mut alone) = (vec![0.0; n], vec![0.0; n]);
        let (q, scratch) = (&robot.state.positions, &mut robot.scratch.passes);
        respond_to_joints(&robot.tree, q, (&[row], &Sums::default()), scratch, &mut together);
        respond(&robot.tree, q, &joints, scratch, &mut alone);
        let largest = alone.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        assert!(largest > 0.0 && together.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-12 * largest));
    }
}

#[test]
fn responses_to_three_wrenches_have_the_bits_of_those_to_each() {
    for is_fixed in [false, true] {
        let mut robot = robot(is_fixed);
        let n = robot.tree.velocity_count;
        let mut rhs = vec![MultiRhs::default(); robot.tree.bodies.len()];
        let axes = [DVec3::new(0.6, 0.0, 0.8), DVec3::Y, DVec3::new(0.8, 0.0, -0.6)];
        for body in 0..robot.tree.bodies.len() {
            let wrenches = robot.wrenches(body, DVec3::new(0.2, 0.5, -0.1), axes);
            let (mut together, mut alone) = (vec![0.0; 3 * n], vec![0.0; n]);
            robot.add_wrench_responses(body, &wrenches, &mut rhs, &mut together);
            assert!(together.iter().any(|value| *value != 0.0), "{body}");
            for (k, together) in together.chunks_exact(n).enumerate() {
                robot.wrench_response(body, wrenches.get(k), &mut alone);
                for (together, alone) in together.iter().zip(&alone) {
                    // An added zero has no sign.
                    assert_eq!(together.to_bits(), (0.0 + alone).to_bits(), "{body}, {k}");
                }
            }
        }
    }
}

#[test]
fn the_pose_of_one_link_is_that_among_those_of_all() {
    for is_fixed in [true, false] {
        let robot = robot(is_fixed);
        let (tree, q, root) = (robot.tree(), robot.positions(), robot.root_pose());
        let all = tree.link_poses(root, &q[tree.root_positions()..]);
        for (link, pose) in all.into_iter().enumerate() {
            assert_eq!(tree.link_pose(root, q, link), pose, "{is_fixed} {link}");
            let rotation = tree.link_rotation(root.rotation, q, link);
            assert!(rotation.angle_between(pose.rotation) < 1e-7, "{is_fixed} {link}: {rotation}");
        }
    }
}

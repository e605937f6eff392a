//! Inverse kinematics, checked by forward kinematics.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::dynamics::inverse_kinematics::{Goal, IkSolution, Movable, SolverOptions, inverse_kinematics};
use simd_core::dynamics::{Configuration, Tree};
use simd_model::RobotModel;
use simd_tests::robots;

/// Returns all joints of one axis, within limits that each has at most.
fn movables(model: &RobotModel, tree: &Tree) -> Vec<Movable> {
    let movable = |(index, body): (usize, &simd_core::dynamics::tree::Body)| {
        let joint = &model.joints[body.joint?];
        let limits = &joint.limits;
        (joint.mimic.is_none() && body.joint_type.positions() == 1).then(|| Movable {
            body: index,
            lower: limits.lower.unwrap_or(f64::NEG_INFINITY),
            upper: limits.upper.unwrap_or(f64::INFINITY),
        })
    };
    tree.bodies.iter().enumerate().filter_map(movable).collect()
}

const ALL: SolverOptions = SolverOptions { iterations: 100, tolerance: 1e-4 };

fn pose_of(tree: &Tree, root: DPose3, positions: &[f64], link: usize) -> DPose3 {
    tree.link_poses(root, positions)[link]
}

/// Returns how many goals were reached, which are poses of the robot itself, from joint positions at or near
/// zero. Forward kinematics checks the results.
fn reach(urdf: &str, with_orientation: bool, options: SolverOptions) -> (usize, u32) {
    let (model, _) = robots::read(urdf);
    let tree = Tree::new(&model, true);
    let movables = movables(&model, &tree);
    let rng = &mut Rng::with_seed(7);
    let root = DPose3::from_parts(DVec3::new(0.3, -0.2, 0.5), DQuat::from_rotation_z(0.7));
    let link = tree.links.len() - 1;
    let point = DVec3::new(0.02, -0.01, 0.05);
    let (mut reached, mut iterations) = (0, 0);
    for _ in 0..100 {
        let mut q = vec![0.0; tree.position_count];
        for movable in &movables {
            let (lower, upper) = (movable.lower.max(-3.0), movable.upper.min(3.0));
            q[tree.bodies[movable.body].position] = lower + (upper - lower) * rng.f64();
        }
        tree.apply_mimics(&mut q);
        let there = pose_of(&tree, root, &q, link);
        let position = there.transform_point(point);
        let goal = Goal { link, point, position, orientation: with_orientation.then_some(there.rotation) };
        let guess = Configuration::at(root, vec![0.0; tree.position_count]);
        let found = inverse_kinematics(&tree, &guess, &goal, &movables, options, &|| false);
        let pose = pose_of(&tree, root, &found.positions, link);
        let position_error = (pose.transform_point(point) - position).length();
        assert!((position_error - found.position_error).abs() < 1e-9, "{found:?}");
        if with_orientation {
            let angle = pose.rotation.angle_between(there.rotation);
            assert!((angle - found.orientation_error).abs() < 1e-6, "{angle} {found:?}");
        } else {
            assert_eq!(found.orientation_error, 0.0);
        }
        for movable in &movables {
            let position = found.positions[tree.bodies[movable.body].position];
            assert!(position >= movable.lower && position <= movable.upper, "{found:?}");
        }
        let size = position_error.hypot(found.orientation_error);
        assert_eq!(found.converged, size <= options.tolerance * (1.0 + 1e-6), "{found:?}");
        assert!(found.iterations <= options.iterations);
        reached += usize::from(found.converged);
        iterations += found.iterations;
    }
    println!("{urdf}: {reached} of 100, {iterations} iterations");
    (reached, iterations)
}

/// A thousand steps are the maximum that a client may ask for. A hundred are few for a pose near limits, from
/// a guess outside of them.
#[test]
fn inverse_kinematics_finds_what_can_be_reached() {
    let most = SolverOptions { iterations: 1000, ..ALL };
    let sharp = SolverOptions { iterations: 1000, tolerance: 1e-9 };
    let cases = [
        ("seven_arm/urdf/seven_arm.urdf", true, ALL, 85),
        ("seven_arm/urdf/seven_arm.urdf", false, ALL, 90),
        ("seven_arm/urdf/seven_arm.urdf", true, most, 98),
        ("pybullet_data/franka_panda/panda.urdf", true, ALL, 45),
        ("pybullet_data/franka_panda/panda.urdf", true, most, 98),
        ("pybullet_data/kuka_iiwa/model.urdf", true, sharp, 100),
    ];
    let reached = cases.map(|(urdf, turned, options, least)| (reach(urdf, turned, options).0, least));
    assert!(reached.iter().all(|(reached, least)| reached >= least), "{reached:?}");
}

fn seven_arm() -> (Arc<RobotModel>, Tree) {
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let tree = Tree::new(&model, true);
    (model, tree)
}

fn go(tree: &Tree, movables: &[Movable], position: DVec3, options: SolverOptions) -> IkSolution {
    let goal = Goal { link: tree.links.len() - 1, point: DVec3::ZERO, position, orientation: None };
    inverse_kinematics(
        tree,
        &Configuration::at(DPose3::IDENTITY, vec![0.0; 7]),
        &goal,
        movables,
        options,
        &|| false,
    )
}

#[test]
fn a_goal_out_of_reach_gets_about_the_nearest_there_is() {
    let (model, tree) = seven_arm();
    let movables = movables(&model, &tree);
    let far = DVec3::new(5.0, 4.0, 3.0);
    let found = go(&tree, &movables, far, SolverOptions { iterations: 1000, ..ALL });
    assert!(!found.converged);
    assert_eq!(found.iterations, 1000);
    // Stretched out towards it: no other place of the arm's joints is nearer by much. The
    // way to the very nearest is slow, since the distance that is left does not shrink.
    let rng = &mut Rng::with_seed(1);
    for _ in 0..2000 {
        let q: Vec<f64> = movables.iter().map(|m| m.lower + (m.upper - m.lower) * rng.f64()).collect();
        let error = (pose_of(&tree, DPose3::IDENTITY, &q, tree.links.len() - 1).translation - far).length();
        assert!(error > 0.99 * found.position_error, "{error} and {found:?}");
    }
    assert_eq!(go(&tree, &[], far, ALL).iterations, 0);
}

#[test]
fn only_the_joints_that_may_move_do_and_equal_questions_have_equal_answers() {
    let (model, tree) = seven_arm();
    let some: Vec<Movable> = movables(&model, &tree).into_iter().skip(1).step_by(2).collect();
    let goal = DVec3::new(0.2, 0.1, 0.7);
    let found = go(&tree, &some, goal, ALL);
    assert_eq!(found, go(&tree, &some, goal, ALL));
    for joint in [0, 2, 4, 6] {
        assert_eq!(found.positions[joint], 0.0);
    }
}

/// A gripper's second finger follows the first, and carries the requested link.
#[test]
fn joints_that_follow_others_are_moved_by_them() {
    let mut model = crate::chains::chain(3);
    model.joints[2].mimic = Some(simd_model::robot::Mimic { joint: 1, multiplier: -0.5, offset: 0.1 });
    let tree = Tree::new(&model, true);
    let movables = movables(&model, &tree);
    assert_eq!(movables.len(), 2);
    let mut q = vec![0.4, -0.7, 0.0];
    tree.apply_mimics(&mut q);
    let link = 3;
    let there = pose_of(&tree, DPose3::IDENTITY, &q, link);
    let goal = Goal { link, point: DVec3::X, position: there.transform_point(DVec3::X), orientation: None };
    let guess = Configuration::at(DPose3::IDENTITY, vec![0.3, -0.5, 0.0]);
    let found = inverse_kinematics(&tree, &guess, &goal, &movables, ALL, &|| false);
    assert!(found.converged, "{found:?}");
    assert!((found.positions[2] - (-0.5 * found.positions[1] + 0.1)).abs() < 1e-15, "{found:?}");
}

//! Kinematics and dynamics of a robot in the world, as a client computes with them.

use glamx::{DQuat, DVec3};
use simd_client::proto::{self, ErrorReason};
use simd_client::{Target, every_joint, joint_target};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::{arm, set, shoulder};

/// Returns a paused world with seven_arm as "seven", bent and moving.
async fn seven(via: Via) -> Daemon {
    let daemon = Daemon::paused_via(via).await;
    daemon.client.load(assets().join("seven_arm/urdf/seven_arm.urdf"), fixed("seven")).await.unwrap();
    let joint = |number: i32| proto::JointReset {
        joint: format!("joint_{number}"),
        position: 0.2 * f64::from(number) - 0.7,
        velocity: 0.1 * f64::from(number) - 0.3,
        ..Default::default()
    };
    daemon.client.reset_joints("seven", (1..=7).map(joint).collect()).await.unwrap();
    daemon
}

async fn last_link(daemon: &Daemon, robot: &str) -> String {
    daemon.client.robot_info(robot).await.unwrap().links.last().unwrap().name.clone()
}

fn jacobian_of(robot: &str, link: &str) -> proto::GetJacobianRequest {
    proto::GetJacobianRequest { robot: robot.into(), link: link.into(), ..Default::default() }
}

/// Rows times a vector.
fn product(rows: &[f64], vector: &[f64]) -> Vec<f64> {
    rows.chunks(vector.len()).map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum()).collect()
}

fn close(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

async fn link_states_are_the_link_poses_and_the_jacobian_times_the_velocities(via: Via) {
    let daemon = seven(via).await;
    let link = last_link(&daemon, "seven").await;
    let states = daemon.client.link_states(vec!["seven".into()]).await.unwrap().robots.remove(0);
    let poses = daemon.client.link_poses(&["seven"]).await.unwrap().robots.remove(0);
    assert_eq!((&states.poses, states.layout_version), (&poses.poses, poses.layout_version));

    let joints = daemon.client.joint_states(vec![every_joint("seven")]).await.unwrap();
    let jacobian = daemon.client.jacobian(jacobian_of("seven", &link)).await.unwrap();
    assert_eq!(jacobian.columns, 7);
    let velocities = &joints.robots[0].velocity;
    let twist = [product(&jacobian.linear, velocities), product(&jacobian.angular, velocities)].concat();
    assert!(close(&twist, states.twists.last_chunk::<6>().unwrap(), 1e-12), "{twist:?}");
    assert!(daemon.client.link_states(Vec::new()).await.unwrap().robots[0] == states);
}

/// Results for a given configuration are those of a robot in that configuration.
async fn a_given_configuration_stands_for_the_state(via: Via) {
    let daemon = seven(via).await;
    let link = last_link(&daemon, "seven").await;
    let here = daemon.client.joint_states(vec![every_joint("seven")]).await.unwrap().robots.remove(0);
    let here =
        proto::Configuration { positions: here.position, velocities: here.velocity, ..Default::default() };
    let there = proto::Configuration { positions: vec![0.1; 7], ..Default::default() };
    let matrix = async |configuration| {
        let request = proto::GetMassMatrixRequest { robot: "seven".into(), configuration };
        daemon.client.mass_matrix(request).await.unwrap().matrix
    };
    let jacobian = async |configuration| {
        let request = proto::GetJacobianRequest { configuration, ..jacobian_of("seven", &link) };
        daemon.client.jacobian(request).await.unwrap().linear
    };
    let efforts = async |configuration| {
        let request = proto::ComputeInverseDynamicsRequest {
            robot: "seven".into(),
            configuration,
            accelerations: vec![0.5; 7],
        };
        daemon.client.inverse_dynamics(request).await.unwrap().efforts
    };
    assert_eq!(matrix(None).await, matrix(Some(here.clone())).await);
    assert_eq!(jacobian(None).await, jacobian(Some(here.clone())).await);
    assert_eq!(efforts(None).await, efforts(Some(here)).await);
    let before = (matrix(Some(there.clone())).await, jacobian(Some(there.clone())).await);
    assert!(!close(&before.0, &matrix(None).await, 1e-6));
    let resets = (1..=7).map(|number| proto::JointReset {
        joint: format!("joint_{number}"),
        position: 0.1,
        ..Default::default()
    });
    daemon.client.reset_joints("seven", resets.collect()).await.unwrap();
    assert_eq!(before, (matrix(None).await, jacobian(None).await));
}

/// M qdd + bias, with the bias from inverse dynamics without acceleration, is inverse dynamics.
async fn the_mass_matrix_and_inverse_dynamics_agree_with_armature_and_damping(via: Via) {
    let daemon = seven(via).await;
    let joints = (1..=7).map(|number| proto::JointProperties {
        joint: format!("joint_{number}"),
        armature: Some(0.2),
        damping: Some(0.3),
        ..Default::default()
    });
    daemon.client.set_joint_properties("seven", joints.collect()).await.unwrap();
    let efforts = async |accelerations| {
        let request = proto::ComputeInverseDynamicsRequest {
            robot: "seven".into(),
            accelerations,
            ..Default::default()
        };
        daemon.client.inverse_dynamics(request).await.unwrap().efforts
    };
    let accelerations: Vec<f64> = (0..7).map(|i| 1.0 - 0.3 * f64::from(i)).collect();
    let request = proto::GetMassMatrixRequest { robot: "seven".into(), ..Default::default() };
    let matrix = daemon.client.mass_matrix(request).await.unwrap();
    assert_eq!((matrix.columns, matrix.matrix.len()), (7, 49));
    let (bias, all) = (efforts(Vec::new()).await, efforts(accelerations.clone()).await);
    let sum: Vec<f64> =
        product(&matrix.matrix, &accelerations).iter().zip(&bias).map(|(a, b)| a + b).collect();
    assert!(close(&sum, &all, 1e-12), "{sum:?} {all:?}");
}

/// With the efforts of inverse dynamics at rest, the arm keeps its position.
async fn the_efforts_of_inverse_dynamics_hold_the_arm_against_gravity(via: Via) {
    let daemon = arm(via).await;
    let reset = proto::JointReset { joint: "shoulder".into(), position: 0.6, ..Default::default() };
    daemon.client.reset_joints("arm", vec![reset]).await.unwrap();
    let request = proto::ComputeInverseDynamicsRequest { robot: "arm".into(), ..Default::default() };
    let effort = daemon.client.inverse_dynamics(request).await.unwrap().efforts[0];
    // The closed form of the torque that holds this arm.
    assert!((effort + 0.3255029 * (0.6f64 - 0.039919).cos()).abs() < 1e-6, "{effort}");
    set(&daemon, Target::Effort(effort)).await;
    daemon.pass(0.2).await;
    let seen = shoulder(&daemon).await;
    assert!((seen.position - 0.6).abs() < 1e-9 && seen.velocity.abs() < 1e-9, "{seen:?}");
}

/// A free box has the weight that gravity gives it, at any pose. The root's six entries come first.
async fn a_free_robot_has_the_six_of_its_root_in_front(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let request = proto::SpawnEntityRequest {
        pose: Some(proto::Pose {
            position: Some(proto::Vector3 { x: 1.0, y: 2.0, z: 3.0 }),
            orientation: Some(proto::Quaternion { x: 0.5, y: 0.5, z: -0.5, w: 0.5 }),
        }),
        base: proto::Base::Free.into(),
        ..fixed("seven")
    };
    daemon.client.load(assets().join("seven_arm/urdf/seven_arm.urdf"), request).await.unwrap();
    let mass = daemon.client.robot_info("seven").await.unwrap().mass;
    let request = proto::ComputeInverseDynamicsRequest { robot: "seven".into(), ..Default::default() };
    let efforts = daemon.client.inverse_dynamics(request).await.unwrap().efforts;
    assert_eq!(efforts.len(), 13);
    assert!(close(&efforts[..3], &[0.0, 0.0, mass * 9.81], 1e-9), "{efforts:?}");
    let request = proto::GetMassMatrixRequest { robot: "seven".into(), ..Default::default() };
    let matrix = daemon.client.mass_matrix(request).await.unwrap();
    assert_eq!(matrix.columns, 13);
    for axis in 0..3 {
        assert!((matrix.matrix[axis * 13 + axis] - mass).abs() < 1e-9);
    }
}

/// The positions are found, set as targets and held; the daemon reports the link at its goal.
async fn the_positions_of_inverse_kinematics_bring_the_link_to_its_goal(via: Via) {
    let daemon = seven(via).await;
    let link = last_link(&daemon, "seven").await;
    let there = daemon.client.link_states(vec!["seven".into()]).await.unwrap().robots.remove(0);
    let &[x, y, z, qx, qy, qz, qw] = there.poses.last_chunk::<7>().unwrap();
    let target = proto::Pose {
        position: Some(proto::Vector3 { x: x - 0.05, y: y + 0.04, z: z - 0.03 }),
        orientation: Some(proto::Quaternion { x: qx, y: qy, z: qz, w: qw }),
    };
    let request = proto::ComputeInverseKinematicsRequest {
        robot: "seven".into(),
        link,
        target: Some(target),
        ..Default::default()
    };
    let found = daemon.client.inverse_kinematics(request.clone()).await.unwrap();
    assert!(found.converged && found.position_error.hypot(found.orientation_error) <= 1e-4, "{found:?}");
    let again = daemon.client.inverse_kinematics(request).await.unwrap();
    assert_eq!(again, found, "equal questions have equal answers");

    let joints =
        (1..=7).map(|n| joint_target(format!("joint_{n}"), Target::position(found.positions[n - 1])));
    daemon.client.set_robot_targets("seven", joints).await.unwrap();
    daemon.pass(3.0).await;
    let now = daemon.client.link_states(vec!["seven".into()]).await.unwrap().robots.remove(0);
    let &[a, b, c, ax, ay, az, aw] = now.poses.last_chunk::<7>().unwrap();
    let off = DVec3::new(a - x + 0.05, b - y - 0.04, c - z + 0.03).length();
    let turned = DQuat::from_xyzw(ax, ay, az, aw).angle_between(DQuat::from_xyzw(qx, qy, qz, qw));
    // A position target settles within a milliradian a joint.
    assert!(off < 2e-3 && turned < 2e-3, "{off} {turned}");
}

async fn impossible_queries_are_refused_by_name(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let configuration = |positions: Vec<f64>| Some(proto::Configuration { positions, ..Default::default() });
    let ik = |change: fn(&mut proto::ComputeInverseKinematicsRequest)| {
        let position = Some(proto::Vector3 { x: 0.1, y: 0.0, z: 0.2 });
        let mut request = proto::ComputeInverseKinematicsRequest {
            robot: "arm".into(),
            link: "arm".into(),
            target: Some(proto::Pose { position, orientation: None }),
            ..Default::default()
        };
        change(&mut request);
        client.inverse_kinematics(request)
    };
    let mass_matrix = |positions| {
        let configuration = configuration(positions);
        client.mass_matrix(proto::GetMassMatrixRequest { robot: "arm".into(), configuration })
    };
    let dynamics = proto::ComputeInverseDynamicsRequest {
        robot: "arm".into(),
        accelerations: vec![0.0; 3],
        ..Default::default()
    };
    let twisted = proto::Configuration {
        positions: vec![0.0],
        root_twist: Some(proto::Twist {
            linear: Some(proto::Vector3 { x: 1.0, y: 0.0, z: 0.0 }),
            angular: None,
        }),
        ..Default::default()
    };
    let twisted = proto::GetMassMatrixRequest { robot: "arm".into(), configuration: Some(twisted) };
    use ErrorReason::*;
    for (error, reason, named) in [
        (client.link_states(vec!["leg".into()]).await.unwrap_err(), RobotNotFound, "leg"),
        (client.jacobian(jacobian_of("leg", "arm")).await.unwrap_err(), RobotNotFound, "leg"),
        (client.jacobian(jacobian_of("arm", "leg")).await.unwrap_err(), LinkNotFound, "leg"),
        (mass_matrix(vec![0.0; 2]).await.unwrap_err(), InvalidValue, "configuration.positions"),
        (mass_matrix(vec![1e300]).await.unwrap_err(), InvalidValue, "configuration.positions[0]"),
        (mass_matrix(vec![f64::NAN]).await.unwrap_err(), InvalidValue, "configuration.positions[0]"),
        (client.mass_matrix(twisted).await.unwrap_err(), InvalidValue, "configuration.root_twist"),
        (client.inverse_dynamics(dynamics).await.unwrap_err(), InvalidValue, "accelerations"),
        (ik(|it| it.target = None).await.unwrap_err(), InvalidValue, "target"),
        (
            ik(|it| it.target = Some(proto::Pose::default())).await.unwrap_err(),
            InvalidValue,
            "target.position",
        ),
        (ik(|it| it.joints = vec!["elbow".into()]).await.unwrap_err(), JointNotFound, "elbow"),
        (ik(|it| it.max_iterations = 1_001).await.unwrap_err(), InvalidValue, "max_iterations"),
        (ik(|it| it.tolerance = -1.0).await.unwrap_err(), InvalidValue, "tolerance"),
    ] {
        assert_eq!(error.reason(), Some(reason), "{error}");
        assert!(error.to_string().contains(named), "{error}");
    }
    // Out of reach is an answer.
    let far = ik(|it| it.target.as_mut().unwrap().position.as_mut().unwrap().x = 9.0).await.unwrap();
    assert!(!far.converged && far.position_error > 5.0, "{far:?}");
}

crate::over_every_transport![
    link_states_are_the_link_poses_and_the_jacobian_times_the_velocities,
    a_given_configuration_stands_for_the_state,
    the_mass_matrix_and_inverse_dynamics_agree_with_armature_and_damping,
    the_efforts_of_inverse_dynamics_hold_the_arm_against_gravity,
    a_free_robot_has_the_six_of_its_root_in_front,
    the_positions_of_inverse_kinematics_bring_the_link_to_its_goal,
    impossible_queries_are_refused_by_name,
];

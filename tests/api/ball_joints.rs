//! Ball joints as clients see and command them.

use glamx::{DQuat, DVec3};
use simd_client::proto::{self, ErrorReason, JointMode, JointType};
use simd_client::{JointReading, Target, every_joint, joint_target};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::over_every_transport;

const PLACE: [f64; 4] = [0.48, 0.0, 0.64, 0.6];

/// Returns a paused world with a pendulum on a ball joint.
async fn pendulum(via: Via) -> Daemon {
    let daemon = Daemon::paused_via(via).await;
    let urdf = assets().join("../reference/robots/ball_pendulum.urdf");
    daemon.client.load(urdf, fixed("pendulum")).await.unwrap();
    daemon
}

async fn ball(daemon: &Daemon) -> JointReading {
    daemon.client.read_joints(&every_joint("pendulum")).await.unwrap().joints.remove(0)
}

async fn set(daemon: &Daemon, target: Target) {
    daemon.client.set_robot_targets("pendulum", [joint_target("ball", target)]).await.unwrap();
}

fn put(orientation: [f64; 4], [x, y, z]: [f64; 3]) -> proto::JointReset {
    let angular_velocity = Some(proto::Vector3 { x, y, z });
    let [x, y, z, w] = orientation;
    let orientation = Some(proto::Quaternion { x, y, z, w });
    let spherical = Some(proto::SphericalReset { orientation, angular_velocity });
    proto::JointReset { joint: "ball".into(), spherical, ..Default::default() }
}

fn apart(a: &[f64], b: [f64; 4]) -> f64 {
    DQuat::from_slice(a).angle_between(DQuat::from_array(b))
}

async fn a_ball_joint_is_read_and_put_by_a_quaternion(via: Via) {
    let daemon = pendulum(via).await;
    let layout = daemon.client.joint_layout("pendulum").await.unwrap();
    assert_eq!((layout.position_count, layout.velocity_count), (4, 3));
    let info = &layout.joints[0];
    assert_eq!((info.r#type(), info.axis), (JointType::Spherical, None));
    assert_eq!((info.position_count, info.velocity_count), (4, 3));
    assert_eq!(ball(&daemon).await.position, [0.0, 0.0, 0.0, 1.0]);
    // Not a unit quaternion.
    daemon
        .client
        .reset_joints("pendulum", vec![put(PLACE.map(|part| 3.0 * part), [1.0, 2.0, 3.0])])
        .await
        .unwrap();
    let seen = ball(&daemon).await;
    assert!(apart(&seen.position, PLACE) < 1e-7);
    assert_eq!(seen.velocity, [1.0, 2.0, 3.0]);
    let poses = daemon.client.link_poses(&["pendulum"]).await.unwrap().robots.remove(0).poses;
    let joint = info.parent_from_joint.as_ref().unwrap().orientation.unwrap();
    let expected = DQuat::from_xyzw(joint.x, joint.y, joint.z, joint.w) * DQuat::from_array(PLACE);
    assert!(apart(&poses[10..14], expected.to_array()) < 1e-7, "{poses:?}");
}

async fn a_ball_joint_follows_its_targets(via: Via) {
    let daemon = pendulum(via).await;
    set(&daemon, Target::orientation(PLACE)).await;
    daemon.pass(0.5).await;
    let seen = ball(&daemon).await;
    assert_eq!(seen.mode, [JointMode::Position; 3]);
    assert!(apart(&seen.position, PLACE) < 5e-3, "{:?}", seen.position);
    // Axis times angle.
    let vector = DVec3::from_slice(&seen.target);
    assert!((vector.length() - 2.0 * 0.6f64.acos()).abs() < 1e-12, "{vector}");
    set(&daemon, Target::AngularVelocity { velocity: [0.0, 0.5, 1.0], damping: None, max_effort: None })
        .await;
    daemon.pass(0.2).await;
    let seen = ball(&daemon).await;
    let off = (DVec3::from_slice(&seen.velocity) - DVec3::new(0.0, 0.5, 1.0)).length();
    assert!(off < 2e-2 && seen.mode == [JointMode::Velocity; 3], "{seen:?}");
    set(&daemon, Target::Torque([0.1, 0.0, -0.2])).await;
    daemon.pass(0.01).await;
    assert_eq!(ball(&daemon).await.effort, [0.1, 0.0, -0.2]);
    set(&daemon, Target::Passive).await;
    assert_eq!(ball(&daemon).await.mode, [JointMode::Passive; 3]);
    set(&daemon, Target::Hold).await;
    assert_eq!(ball(&daemon).await.mode, [JointMode::Hold; 3]);
}

async fn values_that_do_not_fit_a_ball_joint_are_refused(via: Via) {
    let daemon = pendulum(via).await;
    for target in [Target::position(0.3), Target::velocity(0.3), Target::Effort(0.3)] {
        let target = joint_target("ball", target);
        let error = daemon.client.set_robot_targets("pendulum", [target]).await.unwrap_err();
        assert_eq!(error.reason(), Some(ErrorReason::InvalidValue), "{error}");
        assert!(error.to_string().contains("the joint is spherical"), "{error}");
    }
    let nan = joint_target("ball", Target::orientation([0.0, f64::NAN, 0.0, 1.0]));
    let error = daemon.client.set_robot_targets("pendulum", [nan]).await.unwrap_err();
    assert!(error.to_string().contains("robots[0].joints[0].spherical_position.orientation.y"), "{error}");
    let missing = proto::joint_target::Target::SphericalPosition(proto::SphericalPositionTarget::default());
    let missing = proto::JointTarget { joint: "ball".into(), axis: 0, target: Some(missing) };
    let error = daemon.client.set_robot_targets("pendulum", [missing]).await.unwrap_err();
    assert!(error.to_string().contains("orientation"), "{error}");
    let plain = proto::JointReset { joint: "ball".into(), position: 0.3, ..Default::default() };
    let error = daemon.client.reset_joints("pendulum", vec![plain]).await.unwrap_err();
    assert!(error.to_string().contains("set to an orientation"), "{error}");
    let arm = assets().join("seven_arm/urdf/seven_arm.urdf");
    daemon.client.load(arm, fixed("arm")).await.unwrap();
    let target = joint_target("joint_1", Target::orientation(PLACE));
    let error = daemon.client.set_robot_targets("arm", [target]).await.unwrap_err();
    assert!(error.to_string().contains("the joint is not spherical"), "{error}");
}

/// The Jacobian of a given configuration, whose quaternion has any length, and the result of inverse
/// kinematics.
async fn kinematics_turn_ball_joints(via: Via) {
    let daemon = pendulum(via).await;
    daemon.client.reset_joints("pendulum", vec![put(PLACE, [0.0; 3])]).await.unwrap();
    let there = daemon.client.link_poses(&["pendulum"]).await.unwrap().robots.remove(0).poses;
    let request = |configuration| proto::GetJacobianRequest {
        robot: "pendulum".into(),
        link: "bob".into(),
        point: Some(proto::Vector3 { x: 0.1, y: 0.2, z: 0.3 }),
        configuration,
    };
    let long =
        proto::Configuration { positions: PLACE.map(|part| 2.0 * part).to_vec(), ..Default::default() };
    let here = daemon.client.jacobian(request(None)).await.unwrap();
    let given = daemon.client.jacobian(request(Some(long))).await.unwrap();
    assert_eq!(here.columns, 3);
    assert!(here.linear.iter().zip(&given.linear).all(|(a, b)| (a - b).abs() < 1e-12));
    daemon.client.reset_joints("pendulum", vec![put([0.0, 0.0, 0.0, 1.0], [0.0; 3])]).await.unwrap();
    let [x, y, z, a, b, c, d] = *there.last_chunk::<7>().unwrap();
    let pose = proto::Pose {
        position: Some(proto::Vector3 { x, y, z }),
        orientation: Some(proto::Quaternion { x: a, y: b, z: c, w: d }),
    };
    let request = proto::ComputeInverseKinematicsRequest {
        robot: "pendulum".into(),
        link: "bob".into(),
        target: Some(pose),
        ..Default::default()
    };
    let found = daemon.client.inverse_kinematics(request).await.unwrap();
    assert!(found.converged && apart(&found.positions, PLACE) < 1e-3, "{found:?}");
}

async fn a_ball_joint_starts_at_an_orientation(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let urdf = assets().join("../reference/robots/ball_pendulum.urdf");
    // Not a unit quaternion.
    let [x, y, z, w] = PLACE.map(|part| 2.0 * part);
    let start = |joint: &str, w: f64| proto::SpawnEntityRequest {
        joint_orientations: [(joint.to_owned(), proto::Quaternion { x, y, z, w })].into(),
        ..fixed("pendulum")
    };
    for (request, phrase) in
        [(start("ball", f64::NAN), "joint_orientations[\"ball\"].w"), (start("hinge", w), "hinge")]
    {
        let error = daemon.client.load(&urdf, request).await.unwrap_err().to_string();
        assert!(error.contains(phrase), "{error}");
    }
    daemon.client.load(&urdf, start("ball", w)).await.unwrap();
    let seen = ball(&daemon).await;
    assert!(apart(&seen.position, PLACE) < 1e-7, "{:?}", seen.position);
    assert_eq!(seen.mode, [JointMode::Hold; 3]);
}

over_every_transport! {
    a_ball_joint_is_read_and_put_by_a_quaternion,
    a_ball_joint_starts_at_an_orientation,
    a_ball_joint_follows_its_targets,
    values_that_do_not_fit_a_ball_joint_are_refused,
    kinematics_turn_ball_joints,
}

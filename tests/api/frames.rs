//! Named frames of a description, sites of MJCF, wherever the name of a link is asked for.

use glamx::{DQuat, DVec3};
use simd_client::proto::{self, ConstraintKind, sensor, sensor_reading::Measurement};
use simd_client::{every_joint, every_sensor};
use simd_tests::daemon::{Daemon, Via};

use crate::over_every_transport;
use crate::sensors::only;

/// The grip is turned, and 0.3 m from the axis of the last joint.
const ARM: &str = "<mujoco model='arm'><compiler angle='radian'/><worldbody><body name='upper' pos='0 0 1'>\
    <joint name='j1' axis='0 1 0'/><geom size='.05' mass='1'/><site name='elbow' pos='0.5 0 0'/>\
    <body name='fore' pos='0.5 0 0'><joint name='j2' axis='0 1 0'/><geom size='.05' pos='.2 0 0' mass='1'/>\
    <site name='grip' pos='0.3 0 0.1' euler='0 0 1.5707963267948966'/></body></body></worldbody></mujoco>";

/// Returns a paused world with the arm, bent and moving.
async fn arm(via: Via) -> Daemon {
    let daemon = Daemon::paused_via(via).await;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.xml");
    std::fs::write(&file, ARM).unwrap();
    let request = proto::SpawnEntityRequest { name: "arm".into(), ..Default::default() };
    daemon.client.load(&file, request).await.unwrap();
    let reset = |joint: &str, position, velocity| proto::JointReset {
        joint: joint.into(),
        position,
        velocity,
        ..Default::default()
    };
    daemon.client.reset_joints("arm", vec![reset("j1", 0.3, 0.5), reset("j2", -0.8, 1.0)]).await.unwrap();
    daemon
}

/// Returns the grip's position, computed by hand: both joints turn about y.
fn grip(first: f64, second: f64) -> DVec3 {
    let about = DQuat::from_rotation_y;
    let fore = DVec3::new(0.0, 0.0, 1.0) + about(first) * DVec3::new(0.5, 0.0, 0.0);
    fore + about(first + second) * DVec3::new(0.3, 0.0, 0.1)
}

async fn pose_of(daemon: &Daemon, link: &str) -> (DVec3, DQuat) {
    let links = daemon.client.robot_info("arm").await.unwrap().links;
    let index = links.iter().position(|each| each.name == link).unwrap();
    let poses = daemon.client.link_poses(&["arm"]).await.unwrap().robots.remove(0).poses;
    let &[x, y, z, qx, qy, qz, qw] = poses[7 * index..].first_chunk::<7>().unwrap();
    (DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw))
}

async fn kinematics_of_a_site_are_those_of_its_place(via: Via) {
    let daemon = arm(via).await;
    let (position, rotation) = pose_of(&daemon, "grip").await;
    assert!((position - grip(0.3, -0.8)).length() < 1e-12, "{position}");
    let turned = DQuat::from_rotation_y(-0.5) * DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    assert!(rotation.angle_between(turned) < 1e-7, "{rotation}");

    let request =
        proto::GetJacobianRequest { robot: "arm".into(), link: "grip".into(), ..Default::default() };
    let jacobian = daemon.client.jacobian(request).await.unwrap();
    for (column, step) in [(0, [1e-6, 0.0]), (1, [0.0, 1e-6])] {
        let [a, b] = step;
        let slope = (grip(0.3 + a, -0.8 + b) - grip(0.3 - a, -0.8 - b)) / 2e-6;
        let found = DVec3::from_array([0, 1, 2].map(|row| jacobian.linear[2 * row + column]));
        assert!((found - slope).length() < 1e-8, "{found} {slope}");
    }

    let goal = grip(0.6, -1.1);
    let target =
        proto::Pose { position: Some(proto::Vector3 { x: goal.x, y: goal.y, z: goal.z }), orientation: None };
    let request = proto::ComputeInverseKinematicsRequest {
        robot: "arm".into(),
        link: "grip".into(),
        target: Some(target),
        tolerance: 1e-9,
        ..Default::default()
    };
    let found = daemon.client.inverse_kinematics(request).await.unwrap();
    assert!(found.converged && (grip(found.positions[0], found.positions[1]) - goal).length() < 1e-8);
}

async fn a_sensor_and_a_constraint_may_name_a_site(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let sensor = proto::Sensor {
        robot: "arm".into(),
        name: "at".into(),
        link: "grip".into(),
        kind: Some(sensor::Kind::LinkState(proto::LinkStateSensor {})),
        ..Default::default()
    };
    client.create_sensor(sensor).await.unwrap();
    let end = |link: &str| proto::ConstraintEnd {
        robot: if link.is_empty() { String::new() } else { "arm".into() },
        link: link.into(),
        ..Default::default()
    };
    let place = grip(0.3, -0.8);
    let at = proto::Pose {
        position: Some(proto::Vector3 { x: place.x, y: place.y, z: place.z }),
        orientation: None,
    };
    let hold = proto::CreateConstraintRequest {
        name: "hold".into(),
        kind: ConstraintKind::PointToPoint.into(),
        parent: Some(proto::ConstraintEnd { pose: Some(at), ..end("") }),
        child: Some(end("grip")),
        ..Default::default()
    };
    client.create_constraint(hold).await.unwrap();
    client.step(200).await.unwrap();
    let Some(Measurement::LinkState(measured)) =
        only(client.sensor_readings(vec![every_sensor("arm")]).await.unwrap()).measurement
    else {
        panic!("no link state")
    };
    let there = measured.pose.unwrap().position.unwrap();
    let off = (DVec3::new(there.x, there.y, there.z) - place).length();
    assert!(off < 1e-6, "the point at the site is held: {off}");
    let states = client.joint_states(vec![every_joint("arm")]).await.unwrap();
    let [first, second] = states.robots[0].position[..] else { panic!("{states:?}") };
    assert!((grip(first, second) - place).length() < 1e-6);
}

over_every_transport! {
    kinematics_of_a_site_are_those_of_its_place,
    a_sensor_and_a_constraint_may_name_a_site,
}

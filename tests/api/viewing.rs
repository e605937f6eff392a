//! Data for viewers: states with poses and contacts of one step, and a push that ends automatically.

use std::collections::BTreeMap;

use simd_client::proto::{self, ErrorReason, NextJointStatesRequest};
use simd_client::{Client, Target, every_joint};
use simd_tests::daemon::{Daemon, Via};

use crate::{arm, load_arm, set};

/// Returns a world with a box that lies on the ground, beside the arm.
async fn scene(via: Via) -> Daemon {
    let daemon = arm(via).await;
    let plane = proto::primitive::Geometry::Plane(proto::PlaneGeometry { normal: None });
    let size = Some(proto::Vector3 { x: 0.2, y: 0.2, z: 0.2 });
    let cube = proto::primitive::Geometry::Box(proto::BoxGeometry { size });
    spawn(&daemon.client, "ground", plane, 0.0, 0.0).await;
    spawn(&daemon.client, "crate", cube, 1.0, 0.0999).await;
    daemon
}

async fn spawn(client: &Client, name: &str, geometry: proto::primitive::Geometry, mass: f64, z: f64) {
    let primitive = proto::Primitive { geometry: Some(geometry), mass, color: None };
    let source = proto::description_source::Source::Primitive(primitive);
    let source = Some(proto::DescriptionSource { source: Some(source), ..Default::default() });
    let position = Some(proto::Vector3 { x: 3.0, y: 0.0, z });
    let pose = Some(proto::Pose { position, orientation: None });
    let base = if mass > 0.0 { proto::Base::Free } else { proto::Base::Fixed }.into();
    let request = proto::SpawnEntityRequest { source, name: name.into(), pose, base, ..Default::default() };
    client.spawn(request).await.unwrap();
}

fn all(selections: Vec<proto::JointSelection>) -> NextJointStatesRequest {
    NextJointStatesRequest {
        timeout: 0.001,
        selections,
        return_link_poses: true,
        return_contacts: true,
        ..Default::default()
    }
}

async fn a_step_brings_what_touches_where_it_is_asked_to(via: Via) {
    let daemon = scene(via).await;
    let step = |steps: u64, robot: Option<&str>, return_contacts: bool| {
        let selections = robot.map(every_joint).into_iter().collect();
        let request = proto::StepSimulationRequest {
            steps,
            return_states: true,
            return_contacts,
            selections,
            ..Default::default()
        };
        daemon.client.step_with(request)
    };
    let all = step(100, None, true).await.unwrap();
    assert!(!all.contacts.is_empty());
    assert_eq!(all.contacts, daemon.client.contacts(None).await.unwrap());
    assert!(step(1, None, false).await.unwrap().contacts.is_empty());
    assert!(step(1, Some("arm"), true).await.unwrap().contacts.is_empty(), "the arm touches nothing");
    assert_eq!(step(1, Some("crate"), true).await.unwrap().contacts.len(), all.contacts.len());
}

async fn states_come_with_poses_and_contacts_of_their_moment(via: Via) {
    let daemon = scene(via).await;
    daemon.pass(0.1).await;
    let seen = daemon.client.next_joint_states(all(Vec::new())).await.unwrap();
    let states = seen.states.unwrap();
    assert_eq!(states.stamp.unwrap().step, 100);
    let robots: Vec<&str> = seen.link_poses.iter().map(|poses| poses.robot.as_str()).collect();
    assert_eq!(robots, ["arm", "ground", "crate"]);
    assert_eq!(seen.link_poses, daemon.client.link_poses(&[]).await.unwrap().robots);
    assert!(!seen.contacts.is_empty());
    assert_eq!(seen.contacts, daemon.client.contacts(None).await.unwrap());
    let carried: f64 = seen.contacts.iter().map(|contact| contact.normal_force).sum();
    assert!((carried - 9.81).abs() < 0.2, "the crate's kilogram: {carried}");

    let some = daemon.client.next_joint_states(all(vec![every_joint("arm")])).await.unwrap();
    assert_eq!(some.link_poses.len(), 1);
    assert!(some.contacts.is_empty(), "the arm touches nothing");
    let some = daemon.client.next_joint_states(all(vec![every_joint("crate")])).await.unwrap();
    assert_eq!(some.contacts, seen.contacts);
    let request = NextJointStatesRequest { timeout: 0.001, ..Default::default() };
    let bare = daemon.client.next_joint_states(request).await.unwrap();
    assert!(bare.link_poses.is_empty() && bare.contacts.is_empty());
    // A deleted robot takes its contacts along, even without a step.
    daemon.client.delete_robot("ground").await.unwrap();
    load_arm(&daemon.client, "late").await;
    let seen = daemon.client.next_joint_states(all(Vec::new())).await.unwrap();
    assert_eq!((seen.contacts.len(), seen.link_poses.len()), (0, 3));
}

/// A client that reads changes as they come never differs from the world by more than the schema says, and
/// gets nothing of resting robots. Another client that begins later gets the complete state, and so does one
/// that knows a state of an earlier daemon.
async fn a_client_gets_what_has_changed_and_has_all_of_it(via: Via) {
    let daemon = scene(via).await;
    daemon.pass(1.0).await;
    let mut since = 0;
    let mut held = BTreeMap::new();
    let mut whole = 0;
    for step in 0..60 {
        match step {
            20 => {
                // By 2e-8 rad in a step: too little for a change in each step, and enough over several.
                set(&daemon, Target::velocity(2e-5)).await;
            }
            40 => load_arm(&daemon.client, "late").await,
            _ => {}
        }
        daemon.pass(0.001).await;
        let request = NextJointStatesRequest { changes_since: Some(since), ..all(Vec::new()) };
        let seen = daemon.client.next_joint_states(request).await.unwrap();
        let states = seen.states.unwrap();
        since = states.stamp.unwrap().sequence;
        for (robot, poses) in states.robots.into_iter().zip(seen.link_poses) {
            assert_eq!(robot.unchanged, poses.unchanged);
            let is_at_rest = match robot.robot.as_str() {
                "ground" => step > 0,
                "arm" => (5..20).contains(&step),
                _ => false,
            };
            assert!(robot.unchanged || !is_at_rest, "{} in step {step}", robot.robot);
            if robot.unchanged {
                assert!(robot.position.is_empty() && poses.poses.is_empty());
                assert!(held.contains_key(&robot.robot), "{} in step {step}", robot.robot);
            } else {
                whole += usize::from(step > 0);
                held.insert(robot.robot.clone(), (robot, poses));
            }
        }
        for others in [0, u64::MAX] {
            let request = NextJointStatesRequest { changes_since: Some(others), ..all(Vec::new()) };
            let whole = daemon.client.next_joint_states(request).await.unwrap().states.unwrap();
            assert!(whole.robots.iter().all(|robot| !robot.unchanged));
        }
        let now = daemon.client.next_joint_states(all(Vec::new())).await.unwrap();
        for (robot, poses) in now.states.unwrap().robots.into_iter().zip(now.link_poses) {
            let (held, held_poses) = &held[&robot.robot];
            let difference = |one: &[f64], other: &[f64]| {
                assert_eq!(one.len(), other.len());
                one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
            };
            assert!(difference(&held.position, &robot.position) <= 1e-7, "step {step}");
            assert!(difference(&held.velocity, &robot.velocity) <= 1e-4, "step {step}");
            assert!(difference(&held_poses.poses, &poses.poses) <= 1e-6, "step {step}");
            assert_eq!((&held.target, &held.mode), (&robot.target, &robot.mode));
        }
    }
    assert!((8..120).contains(&whole), "{whole} robots came whole");
}

/// 2 N on 1 kg for 0.05 s, without weight: 0.1 m/s, and no more of it afterwards.
async fn a_wrench_with_a_duration_ends_automatically(via: Via) {
    let daemon = scene(via).await;
    let gravity = Some(proto::Vector3::default());
    daemon.client.set_physics(proto::SetPhysicsRequest { gravity, ..Default::default() }).await.unwrap();
    let force = Some(proto::Vector3 { x: 0.0, y: 0.0, z: 2.0 });
    let link = daemon.client.robot_info("crate").await.unwrap().links[0].name.clone();
    let push = proto::ApplyLinkWrenchRequest {
        robot: "crate".into(),
        link,
        wrench: Some(proto::Wrench { force, torque: None }),
        duration: 0.05,
        ..Default::default()
    };
    // Off the ground first: overlapping bodies are pushed apart.
    let position = Some(proto::Vector3 { x: 3.0, y: 0.0, z: 1.0 });
    let pose = Some(proto::Pose { position, orientation: None });
    let state = proto::SetEntityStateRequest { robot: "crate".into(), pose, ..Default::default() };
    daemon.client.set_robot_state(state).await.unwrap();
    daemon.client.apply_wrench(push.clone()).await.unwrap();
    for _ in 0..3 {
        daemon.pass(0.05).await;
        let twist = daemon.client.robot_state("crate").await.unwrap().twist.unwrap();
        assert!((twist.linear.unwrap().z - 0.1).abs() < 1e-9, "{twist:?}");
    }
    let both = proto::ApplyLinkWrenchRequest { persistent: true, ..push };
    let refused = daemon.client.apply_wrench(both).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue));
}

/// A weightless crate is pulled half a metre aside, arrives without overshoot, and is released automatically.
async fn a_pull_brings_a_link_to_a_point_and_ends_automatically(via: Via) {
    let daemon = scene(via).await;
    let gravity = Some(proto::Vector3::default());
    daemon.client.set_physics(proto::SetPhysicsRequest { gravity, ..Default::default() }).await.unwrap();
    let link = daemon.client.robot_info("crate").await.unwrap().links[0].name.clone();
    let position = Some(proto::Vector3 { x: 3.0, y: 0.0, z: 1.0 });
    let pose = Some(proto::Pose { position, orientation: None });
    let state = proto::SetEntityStateRequest { robot: "crate".into(), pose, ..Default::default() };
    daemon.client.set_robot_state(state).await.unwrap();
    let target = Some(proto::Vector3 { x: 3.5, y: 0.0, z: 1.0 });
    let pull = proto::PullLinkRequest { robot: "crate".into(), link, target, ..Default::default() };
    let place = async || {
        let state = daemon.client.robot_state("crate").await.unwrap();
        state.pose.unwrap().position.unwrap().x
    };
    for _ in 0..8 {
        daemon.client.pull(pull.clone()).await.unwrap();
        daemon.pass(0.25).await;
        let x = place().await;
        assert!(x < 3.5 + 1e-3, "{x}");
    }
    assert!((place().await - 3.5).abs() < 1e-3);
    // Half a second after the last call the pull has ended.
    let target = Some(proto::Vector3 { x: 5.0, y: 0.0, z: 1.0 });
    daemon.client.pull(proto::PullLinkRequest { target, ..pull.clone() }).await.unwrap();
    daemon.pass(0.6).await;
    let speed = async || {
        let state = daemon.client.robot_state("crate").await.unwrap();
        state.twist.unwrap().linear.unwrap().x
    };
    let coasts = speed().await;
    assert!(coasts > 0.1, "{coasts}");
    daemon.pass(0.3).await;
    assert!((speed().await - coasts).abs() < 1e-9);
    let wrong = proto::PullLinkRequest { stiffness: Some(-1.0), ..pull.clone() };
    let refused = daemon.client.pull(wrong).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue));
    let unknown = proto::PullLinkRequest { link: "nothing".into(), ..pull };
    let refused = daemon.client.pull(unknown).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LinkNotFound));
}

crate::over_every_transport![
    a_step_brings_what_touches_where_it_is_asked_to,
    states_come_with_poses_and_contacts_of_their_moment,
    a_client_gets_what_has_changed_and_has_all_of_it,
    a_wrench_with_a_duration_ends_automatically,
    a_pull_brings_a_link_to_a_point_and_ends_automatically,
];

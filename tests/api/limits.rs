//! A limit on everything, and a refusal that names it.

use simd_client::proto::{ErrorReason, RobotTargets, SetJointTargetsRequest};
use simd_client::{Target, joint_target};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::{arm, load_arm};

/// A longer message is refused before it is read, and the next one is taken.
async fn a_message_beyond_the_limit_is_refused_by_the_limits_name(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.limits.message_bytes = 100_000).await;
    let long = SetJointTargetsRequest { claim: "a".repeat(200_000), ..Default::default() };
    let error = daemon.client.set_targets(long).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::LimitExceeded), "{error}");
    assert!(error.to_string().contains("max_message_bytes"), "{error}");
    // On a separate connection: over HTTP/1.1 a connection ends if a body was not read.
    daemon.another_client().await.simulator_info().await.unwrap();
}

async fn robots_beyond_the_limit_are_refused_and_those_there_stay(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.limits.robots = 1).await;
    load_arm(&daemon.client, "arm").await;
    let package = assets().join("Bench_Arm-1.2 rev B");
    let error = daemon.client.load(&package, fixed("other")).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::LimitExceeded), "{error}");
    let names: Vec<String> = daemon.client.robots().await.unwrap().into_iter().map(|it| it.name).collect();
    assert_eq!(names, ["arm"]);
}

async fn steps_beyond_the_limit_are_refused_and_none_is_done(via: Via) {
    let daemon = arm(via).await;
    let error = daemon.client.step(u64::MAX).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::LimitExceeded), "{error}");
    assert_eq!(daemon.client.world_statistics().await.unwrap().iterations, 0);
}

async fn saved_states_beyond_the_limit_are_refused(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.limits.saved_states = 1).await;
    daemon.client.save_state("one").await.unwrap();
    let error = daemon.client.save_state("two").await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::LimitExceeded), "{error}");
}

/// Decoded, they would take fifty times their size on the wire.
async fn empty_elements_without_end_are_refused_before_they_are_decoded(via: Via) {
    let daemon = arm(via).await;
    let robots = vec![RobotTargets::default(); 200_000];
    let error =
        daemon.client.set_targets(SetJointTargetsRequest { robots, ..Default::default() }).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::LimitExceeded), "{error}");
    assert!(error.to_string().contains("too many elements"), "{error}");
    daemon.client.simulator_info().await.unwrap();
}

/// They are read, and refused for their names and not for their number.
async fn targets_of_a_thousand_robots_of_thirty_joints_are_read(via: Via) {
    let daemon = arm(via).await;
    let robot = |number: usize| {
        let joints = (0..30).map(|joint| joint_target(format!("joint_{joint}"), Target::position(0.1)));
        simd_client::robot_targets(&format!("robot_{number}"), joints)
    };
    let robots = (0..1000).map(robot).collect();
    let error =
        daemon.client.set_targets(SetJointTargetsRequest { robots, ..Default::default() }).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::RobotNotFound), "{error}");
}

/// An answer that is larger than any buffer on the way comes whole.
async fn a_large_answer_comes_whole(via: Via) {
    let daemon = arm(via).await;
    let targets = (0..20_000).map(|_| joint_target("shoulder", Target::Hold));
    // A name given twice is refused, with a short message whatever was sent.
    let error = daemon.client.set_robot_targets("arm", targets).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::InvalidValue), "{error}");
    let bytes = std::fs::read(assets().join("Two Link.v2/meshes/base_link.STL")).unwrap();
    daemon.client.load(assets().join("Two Link.v2"), fixed("two")).await.unwrap();
    let scene = daemon.client.scene(&["two"]).await.unwrap();
    let meshes = scene.robots[0].visuals.iter().filter_map(|shape| match &shape.geometry {
        Some(simd_client::proto::shape::Geometry::Mesh(mesh)) => Some(mesh.sha256.clone()),
        _ => None,
    });
    let mut same = false;
    for sha256 in meshes.collect::<Vec<_>>() {
        same |= daemon.client.asset(&sha256).await.unwrap() == bytes;
    }
    assert!(same);
}

/// Requested and unread answers count, even a single one.
async fn an_answer_beyond_what_may_be_unread_is_refused_and_smaller_ones_continue(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.limits.unread_bytes = 1 << 20).await;
    let points = vec![0.5; 300_000];
    let lines = simd_client::proto::MarkerLines { points, ..Default::default() };
    let marker = simd_client::proto::Marker {
        shape: Some(simd_client::proto::marker::Shape::Lines(lines)),
        ..Default::default()
    };
    daemon.client.add_markers([marker], false).await.unwrap();
    for _ in 0..3 {
        let listed = daemon.client.markers().await;
        if via == Via::Handle {
            assert_eq!(
                listed.map(|listed| listed.len()).unwrap(),
                1,
                "who is in the process reads what it asks for"
            );
            continue;
        }
        // The markers are too many to be printed.
        let refused = listed.map(drop).unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded), "{refused}");
        assert!(refused.to_string().contains("service.unread_bytes"), "{refused}");
        daemon.client.joint_states(Vec::new()).await.unwrap();
    }
    // Refused answers are not kept. The client may have an answer before the daemon knows that it was sent.
    while daemon.running.handle.unread_answers().bytes() > 0 {
        tokio::task::yield_now().await;
    }
}

crate::over_every_transport![
    an_answer_beyond_what_may_be_unread_is_refused_and_smaller_ones_continue,
    a_message_beyond_the_limit_is_refused_by_the_limits_name,
    robots_beyond_the_limit_are_refused_and_those_there_stay,
    steps_beyond_the_limit_are_refused_and_none_is_done,
    saved_states_beyond_the_limit_are_refused,
    empty_elements_without_end_are_refused_before_they_are_decoded,
    targets_of_a_thousand_robots_of_thirty_joints_are_read,
    a_large_answer_comes_whole,
];

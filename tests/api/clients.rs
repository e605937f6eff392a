//! The list of clients, and the client that set a joint's last target.

use simd_client::proto::{self, ControlWait, TargetSource};
use simd_client::{Client, ControlOptions, Target, joint_target};
use simd_tests::daemon::{Daemon, Via};

use crate::{arm, load_arm};

fn transport(via: Via) -> &'static str {
    match via {
        Via::Handle => "handle",
        Via::Grpc => "grpc",
        Via::Web => "grpc-web",
        Via::Json => "json",
        Via::Zenoh => "zenoh",
    }
}

async fn move_shoulder(client: &Client, robot: &str) {
    client.set_robot_targets(robot, [joint_target("shoulder", Target::position(0.1))]).await.unwrap();
}

/// Robot, joint and client of each target.
async fn sources(client: &Client) -> Vec<(String, String, String)> {
    let targets = client.clients().await.unwrap().targets;
    assert!(targets.iter().all(|target| target.age >= 0.0));
    targets.into_iter().map(|TargetSource { robot, joint, client, .. }| (robot, joint, client)).collect()
}

fn source(robot: &str, client: &str) -> (String, String, String) {
    (robot.into(), "shoulder".into(), client.into())
}

async fn a_named_client_is_listed_with_its_transport(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let [bench, viewer] = ["bench", "viewer-4f2a"].map(|name| daemon.client.clone().with_name(name));
    viewer.physics().await.unwrap();
    let listed = bench.clients().await.unwrap().clients;
    let listed: Vec<(&str, &str, bool)> =
        listed.iter().map(|c| (c.name.as_str(), c.transport.as_str(), c.is_caller)).collect();
    let via = transport(via);
    assert_eq!(listed, [("bench", via, true), ("viewer-4f2a", via, false)]);
}

async fn a_client_that_says_no_name_has_that_of_its_program(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let program = std::env::current_exe().unwrap().file_stem().unwrap().to_str().unwrap().to_owned();
    let listed = daemon.client.clients().await.unwrap().clients;
    assert_eq!(listed.iter().map(|client| client.name.as_str()).collect::<Vec<_>>(), [&program[..]]);
}

async fn who_watches_is_here(via: Via) {
    let daemon = arm(via).await;
    let watcher = daemon.another_client().await.with_name("watcher");
    let control = watcher.control(ControlOptions::default()).await.unwrap();
    let mut watch = watcher.watch_parameters().await.unwrap();
    watch.next().await.unwrap();
    let listed = daemon.client.clone().with_name("asker").clients().await.unwrap().clients;
    let watcher = listed.iter().find(|client| client.name == "watcher");
    let idle = watcher.map(|client| client.idle);
    // Over Zenoh a watch is one question after the other.
    if via == Via::Zenoh {
        assert!(idle.is_some())
    } else {
        assert_eq!(idle, Some(0.0))
    }
    drop((control, watch));
}

async fn the_last_who_set_a_target_is_known(via: Via) {
    let daemon = arm(via).await;
    load_arm(&daemon.client, "other").await;
    let [one, two] = ["one", "two"].map(|name| daemon.client.clone().with_name(name));
    assert!(sources(&one).await.is_empty());
    move_shoulder(&one, "arm").await;
    move_shoulder(&two, "other").await;
    assert_eq!(sources(&one).await, [source("arm", "one"), source("other", "two")]);
    // A refused target has no source.
    two.set_robot_targets("arm", [joint_target("elbow", Target::Hold)]).await.unwrap_err();
    assert_eq!(sources(&one).await[0], source("arm", "one"));

    let options = ControlOptions { wait: ControlWait::None, ..ControlOptions::default() };
    let mut control = two.control(options).await.unwrap();
    control.exchange("arm", [joint_target("shoulder", Target::Hold)]).await.unwrap().accepted().unwrap();
    assert_eq!(sources(&one).await[0], source("arm", "two"));

    let whole = proto::WholeRobotTarget { mode: proto::JointMode::Hold.into(), values: Vec::new() };
    let robots = vec![proto::RobotTargets { robot: "arm".into(), whole: Some(whole), ..Default::default() }];
    one.step_with(proto::StepSimulationRequest { steps: 1, robots, ..Default::default() }).await.unwrap();
    assert_eq!(sources(&one).await[0], source("arm", "one"));
}

async fn targets_that_are_put_back_have_no_source(via: Via) {
    let daemon = arm(via).await;
    let client = daemon.client.clone().with_name("one");
    client.save_state("before").await.unwrap();
    move_shoulder(&client, "arm").await;
    let time = proto::ResetSimulationRequest { time: true, ..Default::default() };
    client.reset(time).await.unwrap();
    assert_eq!(sources(&client).await, [source("arm", "one")], "targets stay");
    client.reset(proto::ResetSimulationRequest::default()).await.unwrap();
    assert!(sources(&client).await.is_empty());
    move_shoulder(&client, "arm").await;
    client.restore_state("before").await.unwrap();
    assert!(sources(&client).await.is_empty());
    // Another robot of the same name takes nothing over.
    move_shoulder(&client, "arm").await;
    client.delete_robot("arm").await.unwrap();
    load_arm(&client, "arm").await;
    assert!(sources(&client).await.is_empty());
}

crate::over_every_transport![
    a_named_client_is_listed_with_its_transport,
    a_client_that_says_no_name_has_that_of_its_program,
    who_watches_is_here,
    the_last_who_set_a_target_is_known,
    targets_that_are_put_back_have_no_source,
];

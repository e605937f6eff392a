//! States over time, in three ways with one contract each.

use std::time::Duration;

use simd_client::proto::{self, ControlWait};
use simd_client::{ControlOptions, Target, every_joint, joint_target, some_joints};
use simd_tests::daemon::{Daemon, Via};

use crate::{arm, load_arm};

const SECOND: Duration = Duration::from_secs(1);

fn options(wait: ControlWait) -> ControlOptions {
    ControlOptions { selections: vec![every_joint("arm")], wait, ..ControlOptions::default() }
}

fn sequence(states: &proto::JointStates) -> u64 {
    states.stamp.unwrap().sequence
}

async fn control_answers_each_request_once_with_a_newer_state(via: Via) {
    let daemon = Daemon::start_via(via, |_| {}).await;
    load_arm(&daemon.client, "arm").await;
    let mut control = daemon.client.control(options(ControlWait::NewerState)).await.unwrap();
    let mut last = 0;
    for i in 0..200 {
        let target = joint_target("shoulder", Target::position(f64::from(i) * 1e-3));
        let states = control.exchange("arm", [target]).await.unwrap().accepted().unwrap();
        assert!(sequence(&states) > last);
        assert_eq!(states.robots[0].target, [f64::from(i) * 1e-3]);
        last = sequence(&states);
    }
}

/// In a paused world only targets change the state.
async fn control_answers_in_a_paused_world_once_the_targets_hold(via: Via) {
    let daemon = arm(via).await;
    let mut control = daemon.client.control(options(ControlWait::NewerState)).await.unwrap();
    for i in 0..20 {
        let target = joint_target("shoulder", Target::position(f64::from(i)));
        let states = control.exchange("arm", [target]).await.unwrap().accepted().unwrap();
        assert_eq!((states.robots[0].target[0], states.stamp.unwrap().step), (f64::from(i), 0));
    }
}

async fn refused_targets_do_not_end_control(via: Via) {
    let daemon = arm(via).await;
    let mut control = daemon.client.control(options(ControlWait::None)).await.unwrap();
    let reply = control.exchange("arm", [joint_target("elbow", Target::Hold)]).await.unwrap();
    assert_eq!(reply.refusal.unwrap().reason, proto::ErrorReason::JointNotFound);
    let reply = control.exchange("arm", [joint_target("shoulder", Target::position(0.2))]).await.unwrap();
    assert_eq!(reply.accepted().unwrap().robots[0].target, [0.2]);
}

/// The selection applies even if the first targets were refused.
async fn control_keeps_its_selection_after_a_refusal(via: Via) {
    let daemon = arm(via).await;
    load_arm(&daemon.client, "other").await;
    let mut control = daemon.client.control(options(ControlWait::None)).await.unwrap();
    let reply =
        control.exchange("arm", [joint_target("shoulder", Target::position(f64::NAN))]).await.unwrap();
    assert_eq!(reply.refusal.unwrap().reason, proto::ErrorReason::InvalidValue);
    for _ in 0..2 {
        let states = control.next().await.unwrap().accepted().unwrap();
        assert_eq!(states.robots.iter().map(|robot| robot.robot.as_str()).collect::<Vec<_>>(), ["arm"]);
    }
}

async fn control_of_a_robot_is_refused_while_it_is_not_there(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let mut control = daemon.client.control(options(ControlWait::None)).await.unwrap();
    for _ in 0..2 {
        let reply = control.next().await.unwrap();
        assert_eq!(reply.refusal.unwrap().reason, proto::ErrorReason::RobotNotFound);
        assert_eq!(reply.states, None);
        load_arm(&daemon.client, "arm").await;
        control.next().await.unwrap().accepted().unwrap();
        daemon.client.delete_robot("arm").await.unwrap();
    }
}

/// One that asks for each newer state is refused once a state, not as fast as it can ask.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn refusals_of_control_come_no_faster_than_states() {
    let daemon = Daemon::start(|_| {}).await;
    let mut control = daemon.client.control(options(ControlWait::NewerState)).await.unwrap();
    let newest = async || sequence(&daemon.client.joint_states(Vec::new()).await.unwrap());
    let before = newest().await;
    let refusals = 50;
    for _ in 0..refusals {
        let reply = control.next().await.unwrap();
        assert_eq!(reply.refusal.unwrap().reason, proto::ErrorReason::RobotNotFound);
    }
    assert!(newest().await - before >= refusals - 1);
}

/// The reader grants a credit and then pauses for a thousand steps. Its next read is at most one state old,
/// and the one after is the newest.
async fn a_reader_of_control_that_stalled_is_at_most_one_state_behind(via: Via) {
    let daemon = arm(via).await;
    let mut control = daemon.client.control(options(ControlWait::None)).await.unwrap();
    control.next().await.unwrap();
    control.send("arm", []).unwrap();
    for _ in 0..20 {
        daemon.client.step(50).await.unwrap();
    }
    // The answer to the credit from before the stall.
    control.next().await.unwrap();
    let states = control.next().await.unwrap().accepted().unwrap();
    assert_eq!(states.stamp.unwrap().step, 1000);
}

async fn next_states_gives_the_newest_to_a_client_that_comes_late(via: Via) {
    let daemon = arm(via).await;
    let first = daemon.client.next_states(0, SECOND, Vec::new()).await.unwrap();
    daemon.client.step(1000).await.unwrap();
    let next = daemon.client.next_states(sequence(&first), SECOND, Vec::new()).await.unwrap();
    assert_eq!(next.stamp.unwrap().step, 1000);
    // Nothing is newer: after the timeout the state is the same.
    let wait = Duration::from_millis(20);
    let same = daemon.client.next_states(sequence(&next), wait, Vec::new()).await.unwrap();
    assert_eq!(sequence(&same), sequence(&next));
}

async fn a_watch_gives_states_in_order_and_never_one_twice(via: Via) {
    let daemon = Daemon::start_via(via, |_| {}).await;
    load_arm(&daemon.client, "arm").await;
    let mut watch = daemon.client.watch(vec![every_joint("arm")], 200.0).await.unwrap();
    let mut last = 0;
    for _ in 0..20 {
        let states = watch.next().await.unwrap().unwrap();
        assert!(sequence(&states) > last);
        last = sequence(&states);
    }
}

async fn a_subset_has_its_joints_in_the_order_asked_for(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let urdf = simd_tests::robots::assets().join("seven_arm/urdf/seven_arm.urdf");
    daemon.client.load(urdf, simd_tests::daemon::fixed("arm")).await.unwrap();
    let joints = vec![
        proto::JointReset { joint: "joint_2".into(), position: 0.2, ..Default::default() },
        proto::JointReset { joint: "joint_5".into(), position: 0.5, ..Default::default() },
    ];
    daemon.client.reset_joints("arm", joints).await.unwrap();
    let states = daemon.client.joint_states(vec![some_joints("arm", ["joint_5", "joint_2"])]).await.unwrap();
    assert_eq!(states.robots[0].position, [0.5, 0.2]);
}

async fn events_come_in_order_without_holes(via: Via) {
    let daemon = arm(via).await;
    daemon.client.play().await.unwrap();
    daemon.client.pause().await.unwrap();
    daemon.client.delete_robot("arm").await.unwrap();
    let batch = daemon.client.next_events(0, SECOND).await.unwrap();
    assert_eq!(batch.missed, 0);
    let numbers: Vec<u64> = batch.events.iter().map(|event| event.sequence).collect();
    assert_eq!(numbers, (1..=batch.last_sequence).collect::<Vec<_>>());
    let Some(proto::event::Kind::EntityDeleted(deleted)) = &batch.events.last().unwrap().kind else {
        panic!("{batch:?}");
    };
    assert_eq!(deleted.robot, "arm");
}

async fn streams_end_with_ok_when_the_daemon_drains(via: Via) {
    let daemon = arm(via).await;
    let mut watch = daemon.client.watch(vec![every_joint("arm")], 100.0).await.unwrap();
    let mut events = daemon.client.watch_events(0).await.unwrap();
    daemon.client.play().await.unwrap();
    watch.next().await.unwrap().unwrap();
    events.next().await.unwrap().unwrap();
    let drained = tokio::spawn(daemon.running.drain());
    while watch.next().await.unwrap().is_some() {}
    while events.next().await.unwrap().is_some() {}
    drained.await.unwrap();
}

crate::over_every_transport![
    control_answers_each_request_once_with_a_newer_state,
    control_answers_in_a_paused_world_once_the_targets_hold,
    refused_targets_do_not_end_control,
    control_keeps_its_selection_after_a_refusal,
    control_of_a_robot_is_refused_while_it_is_not_there,
    a_reader_of_control_that_stalled_is_at_most_one_state_behind,
    next_states_gives_the_newest_to_a_client_that_comes_late,
    a_watch_gives_states_in_order_and_never_one_twice,
    a_subset_has_its_joints_in_the_order_asked_for,
    events_come_in_order_without_holes,
    streams_end_with_ok_when_the_daemon_drains,
];

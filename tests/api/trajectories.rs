//! Trajectories, as clients give, read and end them, and the targets of joints.

use std::time::Duration;

use simd_client::proto::{self, ErrorReason, TrajectoryOutcome, TrajectoryStatus, event::Kind};
use simd_client::{Client, Target, every_joint, joint_target};
use simd_tests::daemon::Via;

use crate::{arm, over_every_transport, shoulder};

fn reach(points: &[(f64, f64)]) -> proto::FollowTrajectoryRequest {
    let points = points.iter().map(|&(time, position)| proto::TrajectoryPoint {
        time,
        positions: vec![position],
        ..Default::default()
    });
    proto::FollowTrajectoryRequest {
        robot: "arm".into(),
        joints: vec!["shoulder".into()],
        points: points.collect(),
        ..Default::default()
    }
}

/// How trajectories ended, in order.
async fn ends(client: &Client) -> Vec<(u64, TrajectoryOutcome)> {
    let events = client.next_events(0, Duration::ZERO).await.unwrap().events;
    let ends = events.into_iter().filter_map(|event| match event.kind {
        Some(Kind::TrajectoryEnded(end)) => Some((end.id, end.outcome())),
        _ => None,
    });
    ends.collect()
}

async fn trajectories_are_carried_out_in_turn_and_say_how_far_they_are(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let first = client.follow_trajectory(reach(&[(0.5, 0.4)])).await.unwrap().id;
    let queued = proto::FollowTrajectoryRequest { queued: true, ..reach(&[(0.5, 0.0)]) };
    let second = client.follow_trajectory(queued).await.unwrap().id;
    client.step(250).await.unwrap();
    let all = client.trajectories(None).await.unwrap();
    assert_eq!(all, client.trajectories(Some("arm")).await.unwrap());
    let seen: Vec<_> = all.iter().map(|of| (of.id, of.status(), of.robot.as_str(), &of.joints[..])).collect();
    let joints = &["shoulder".to_owned()][..];
    assert_eq!(
        seen,
        [(first, TrajectoryStatus::Active, "arm", joints), (second, TrajectoryStatus::Queued, "arm", joints)]
    );
    assert!((all[0].elapsed - 0.25).abs() < 1e-9 && (all[0].duration - 0.5).abs() < 1e-9, "{all:?}");
    assert!((all[0].desired[0] - 0.2).abs() < 1e-9 && (all[0].actual[0] - 0.2).abs() < 0.02, "{all:?}");
    assert_eq!(all[0].actual[0], shoulder(&daemon).await.position);
    assert!(all[1].desired.is_empty() && all[1].actual.is_empty());
    client.step(750).await.unwrap();
    assert_eq!(
        ends(client).await,
        [(first, TrajectoryOutcome::Succeeded), (second, TrajectoryOutcome::Succeeded)]
    );
    assert!(client.trajectories(None).await.unwrap().is_empty());
}

async fn a_trajectory_that_waits_is_cancelled_and_a_target_takes_its_joint(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let later = proto::FollowTrajectoryRequest { delay: 0.1, ..reach(&[(0.5, 0.4)]) };
    let first = client.follow_trajectory(later).await.unwrap().id;
    client.step(40).await.unwrap();
    let waiting = client.trajectories(Some("arm")).await.unwrap();
    assert_eq!(waiting[0].status(), TrajectoryStatus::Delayed);
    assert!((waiting[0].delay - 0.06).abs() < 1e-9, "{waiting:?}");
    client.cancel_trajectory("arm", Some(first)).await.unwrap();
    let gone = client.cancel_trajectory("arm", Some(first)).await.unwrap_err();
    assert_eq!(gone.reason(), Some(ErrorReason::InvalidValue), "{gone}");
    let second = client.follow_trajectory(reach(&[(0.5, 0.4)])).await.unwrap().id;
    client.step(10).await.unwrap();
    client.set_robot_targets("arm", [joint_target("shoulder", Target::Hold)]).await.unwrap();
    let ended = ends(client).await;
    assert_eq!(ended, [(first, TrajectoryOutcome::Cancelled), (second, TrajectoryOutcome::Superseded)]);
    let nowhere = client.trajectories(Some("leg")).await.unwrap_err();
    assert_eq!(nowhere.reason(), Some(ErrorReason::RobotNotFound), "{nowhere}");
}

async fn the_holder_of_the_claim_drives_if_two_clients_compete(via: Via) {
    let daemon = arm(via).await;
    let other = &daemon.client;
    let claim =
        other.claim_joints(vec![every_joint("arm")], "planner", Duration::from_secs(60)).await.unwrap();
    let holder = other.clone().with_claim(&claim);
    let id = holder.follow_trajectory(reach(&[(0.5, 0.4)])).await.unwrap().id;
    client_is_refused(other.follow_trajectory(reach(&[(0.5, -0.4)])).await.map(drop));
    client_is_refused(other.cancel_trajectory("arm", Some(id)).await.map(drop));
    other.step(500).await.unwrap();
    assert_eq!(ends(other).await, [(id, TrajectoryOutcome::Succeeded)]);
    assert!((shoulder(&daemon).await.position - 0.4).abs() < 0.02);
}

fn client_is_refused(answer: Result<(), simd_client::Error>) {
    let error = answer.unwrap_err();
    let claimed = [Some(ErrorReason::JointClaimed), Some(ErrorReason::RobotClaimed)];
    assert!(claimed.contains(&error.reason()), "{error}");
}

async fn a_soft_spring_comes_to_its_target_once_gravity_is_compensated(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let change = |compensated| proto::JointProperties {
        joint: "shoulder".into(),
        default_gains: Some(proto::JointGains { stiffness: 1.0, damping: 0.3 }),
        gravity_compensation: compensated,
        ..Default::default()
    };
    client.set_joint_properties("arm", vec![change(None)]).await.unwrap();
    client.set_robot_targets("arm", [joint_target("shoulder", Target::position(0.3))]).await.unwrap();
    client.step(10_000).await.unwrap();
    let sag = (shoulder(&daemon).await.position - 0.3).abs();
    client.set_joint_properties("arm", vec![change(Some(true))]).await.unwrap();
    assert!(client.joint_layout("arm").await.unwrap().joints.iter().any(|joint| joint.gravity_compensation));
    client.step(10_000).await.unwrap();
    let error = (shoulder(&daemon).await.position - 0.3).abs();
    assert!(sag > 0.01 && error < 1e-8, "{sag} and {error}");
}

over_every_transport! {
    trajectories_are_carried_out_in_turn_and_say_how_far_they_are,
    a_trajectory_that_waits_is_cancelled_and_a_target_takes_its_joint,
    the_holder_of_the_claim_drives_if_two_clients_compete,
    a_soft_spring_comes_to_its_target_once_gravity_is_compensated,
}

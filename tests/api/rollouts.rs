//! Rollouts of copies of the world: results, refusals, and the end with their caller.

use std::time::Duration;

use simd_client::proto::{
    self, ErrorReason, RolloutControl, RolloutCost, RolloutJointTerm, RolloutQuantity, RolloutQuantityKind,
    RolloutRequest, rollout_cost::Term,
};
use simd_client::{Rollout, Target, packed};
use simd_tests::daemon::{Daemon, Via};

use crate::{arm, over_every_transport, set, shoulder};

const STEPS: u32 = 150;

fn quantity(kind: RolloutQuantityKind) -> RolloutQuantity {
    RolloutQuantity { kind: kind.into(), robot: "arm".into(), names: Vec::new() }
}

/// Returns a rollout in which the arm moves to one of these positions in each copy.
fn to(positions: &[f64]) -> RolloutRequest {
    let values = packed(positions);
    let term = RolloutJointTerm { robot: "arm".into(), targets: vec![0.3], ..Default::default() };
    RolloutRequest {
        copies: u32::try_from(positions.len()).unwrap(),
        steps: STEPS,
        controls: vec![RolloutControl { robot: "arm".into(), values, ..Default::default() }],
        quantities: vec![
            quantity(RolloutQuantityKind::JointPositions),
            quantity(RolloutQuantityKind::JointVelocities),
            quantity(RolloutQuantityKind::LinkPoses),
        ],
        costs: vec![RolloutCost {
            weight: 1.0,
            term: Some(Term::JointPositions(term)),
            ..Default::default()
        }],
        ..Default::default()
    }
}

/// Position and velocity at the end of each copy.
fn ends(rollout: &Rollout) -> Vec<[f64; 2]> {
    let columns: u32 = rollout.result.widths.iter().sum();
    rollout.states.chunks_exact(columns as usize).map(|row| [row[0], row[1]]).collect()
}

async fn copies_end_where_the_world_does_and_leave_it_where_it_is(via: Via) {
    let daemon = arm(via).await;
    daemon.client.step(20).await.unwrap();
    let before = shoulder(&daemon).await;
    let rollout = daemon.client.rollout(to(&[0.1, 0.3, 0.5]), |_| ()).await.unwrap();
    assert_eq!(rollout.result.start.unwrap().step, 20);
    assert_eq!((rollout.result.rows, &rollout.result.widths[..2]), (1, &[1, 1][..]));
    assert_eq!(rollout.result.steps_done, [STEPS; 3]);
    assert_eq!(shoulder(&daemon).await, before);
    let costs = rollout.total_costs();
    assert!(costs[1] < costs[0] && costs[1] < costs[2], "{costs:?}");

    set(&daemon, Target::position(0.3)).await;
    daemon.client.step(STEPS.into()).await.unwrap();
    let after = shoulder(&daemon).await;
    assert_eq!(ends(&rollout)[1], [after.position, after.velocity]);
}

async fn copies_start_from_a_saved_state_that_is_named(via: Via) {
    let daemon = arm(via).await;
    daemon.client.save_state("start").await.unwrap();
    let from_here = daemon.client.rollout(to(&[0.2]), |_| ()).await.unwrap();
    set(&daemon, Target::position(1.0)).await;
    daemon.client.step(100).await.unwrap();
    let saved = RolloutRequest { saved_state: "start".into(), ..to(&[0.2]) };
    let from_there = daemon.client.rollout(saved, |_| ()).await.unwrap();
    assert_eq!(ends(&from_there), ends(&from_here));
    let missing = RolloutRequest { saved_state: "end".into(), ..to(&[0.2]) };
    let error = daemon.client.rollout(missing, |_| ()).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::SavedStateNotFound), "{error}");
}

/// Several parts of a megabyte each, of all three arrays.
async fn a_large_rollout_comes_whole(via: Via) {
    let daemon = arm(via).await;
    let positions: Vec<f64> = (0..40).map(|copy| f64::from(copy) / 40.0).collect();
    let steps = 1000;
    let large = RolloutRequest {
        steps,
        record_steps: 1,
        record_start: true,
        return_step_costs: true,
        ..to(&positions)
    };
    let rollout = daemon.client.rollout(large, |_| ()).await.unwrap();
    let columns = rollout.result.widths.iter().sum::<u32>() as usize;
    assert_eq!(rollout.states.len(), 40 * 1001 * columns);
    assert!(rollout.states.len() * 8 > 3 << 20, "it has several parts");
    assert!(rollout.states.iter().all(|number| number.is_finite()));
    for (copy, costs) in rollout.step_costs.chunks_exact(steps as usize).enumerate() {
        let states = &rollout.states[copy * 1001 * columns..(copy + 1) * 1001 * columns];
        for (cost, row) in costs.iter().zip(states.chunks_exact(columns).skip(1)) {
            assert_eq!(*cost, (row[0] - 0.3).powi(2), "copy {copy}");
        }
    }
}

async fn invalid_rollouts_are_refused_with_one_sentence(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.limits.rollout_bytes = 1 << 20).await;
    crate::load_arm(&daemon.client, "arm").await;
    let refused = async |request: RolloutRequest| daemon.client.rollout(request, |_| ()).await.unwrap_err();
    let one = || to(&[0.1]);
    let driven = |robot: &str, joints: &[&str]| RolloutRequest {
        controls: vec![RolloutControl {
            robot: robot.into(),
            joints: joints.iter().map(|joint| (*joint).to_owned()).collect(),
            values: packed(&[0.1]),
            ..Default::default()
        }],
        ..one()
    };
    for (request, reason, word) in [
        (driven("leg", &[]), ErrorReason::RobotNotFound, "controls[0].robot: there is no robot \"leg\""),
        (
            driven("arm", &["knee"]),
            ErrorReason::JointNotFound,
            "controls[0].joints[0]: robot \"arm\" has no joint \"knee\"",
        ),
        (RolloutRequest { copies: 0, ..one() }, ErrorReason::InvalidValue, "copies is 0"),
        (
            RolloutRequest { copies: 2, ..to(&[0.1, 0.2, 0.3]) },
            ErrorReason::InvalidValue,
            "controls[0].values",
        ),
        (RolloutRequest { copies: 70_000, ..one() }, ErrorReason::LimitExceeded, "65536"),
        (
            RolloutRequest { copies: 60_000, steps: 10_000, record_steps: 1, ..one() },
            ErrorReason::LimitExceeded,
            "the bytes of the rollout's answer",
        ),
        (
            RolloutRequest { copies: 65_536, steps: 1_000_000, ..one() },
            ErrorReason::LimitExceeded,
            "would be 65536000000, and the limit is 6000000000",
        ),
        (
            RolloutRequest { quantities: vec![RolloutQuantity::default()], ..one() },
            ErrorReason::InvalidValue,
            "quantities[0]",
        ),
    ] {
        let error = refused(request).await;
        assert_eq!(error.reason(), Some(reason), "{error}");
        assert!(error.to_string().contains(word), "{error}");
    }
    // And the next one is served.
    daemon.client.rollout(one(), |_| ()).await.unwrap();
}

/// Returns the longest allowed rollout, which no machine computes within a test's timeout.
fn endless() -> RolloutRequest {
    let copies = 6_000;
    RolloutRequest { copies, steps: 1_000_000, quantities: Vec::new(), ..to(&[0.1]) }
}

async fn a_rollout_that_takes_too_long_says_how_far_it_came(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.limits.rollout_seconds = 0).await;
    crate::load_arm(&daemon.client, "arm").await;
    let long = RolloutRequest { copies: 100, ..endless() };
    let error = daemon.client.rollout(long, |_| ()).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::LimitExceeded), "{error}");
    assert!(error.to_string().contains("of 100 copies were done"), "{error}");
}

over_every_transport![
    copies_end_where_the_world_does_and_leave_it_where_it_is,
    copies_start_from_a_saved_state_that_is_named,
    a_large_rollout_comes_whole,
    invalid_rollouts_are_refused_with_one_sentence,
    a_rollout_that_takes_too_long_says_how_far_it_came,
];

/// Over Zenoh a daemon does not learn that its caller is gone: the query's timeout ends the rollout.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rollout_ends_with_its_caller_and_leaves_its_place_to_others() {
    let daemon = arm(Via::Grpc).await;
    let mut began = Vec::new();
    // As many as are computed at a time.
    for _ in 0..2 {
        let (said, heard) = tokio::sync::mpsc::channel(1);
        let client = daemon.another_client().await;
        let work = async move {
            client
                .rollout(endless(), |progress: &proto::RolloutProgress| {
                    let _ = said.try_send(progress.copies);
                })
                .await
        };
        began.push((tokio::spawn(work), heard));
    }
    for (_, heard) in &mut began {
        assert_eq!(heard.recv().await, Some(6_000));
    }
    for (call, _) in &began {
        call.abort();
    }
    let next = tokio::time::timeout(Duration::from_secs(60), daemon.client.rollout(to(&[0.1]), |_| ())).await;
    next.expect("the place of those who left is free").unwrap();
}

/// A second rollout of a client waits for its first, even if the daemon could compute one more.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_client_with_two_long_rollouts_keeps_no_other_from_its_own() {
    // None of them ends within the test.
    let daemon = Daemon::start_via(Via::Grpc, |config| config.limits.rollout_seconds = 86_400).await;
    crate::load_arm(&daemon.client, "arm").await;
    let mut began = Vec::new();
    for _ in 0..2 {
        let (said, heard) = tokio::sync::mpsc::channel(1);
        let client = daemon.client.clone();
        let work = async move {
            client
                .rollout(endless(), |progress: &proto::RolloutProgress| {
                    let _ = said.try_send(progress.copies);
                })
                .await
        };
        began.push((tokio::spawn(work), heard));
    }
    for (_, heard) in &mut began {
        assert_eq!(heard.recv().await, Some(6_000));
    }
    let other = daemon.another_client().await;
    let next = tokio::time::timeout(Duration::from_secs(60), other.rollout(to(&[0.1]), |_| ())).await;
    next.expect("a permit is left for another client").unwrap();
    for (call, _) in &began {
        assert!(!call.is_finished());
        call.abort();
    }
}

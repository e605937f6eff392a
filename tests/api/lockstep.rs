//! Targets, steps and states in one call: the turn of a lockstep loop.

use simd_client::proto::description_source::Source;
use simd_client::proto::primitive::Geometry;
use simd_client::proto::{self, ErrorReason, RobotTargets, StepSimulationRequest};
use simd_client::{Target, every_joint, joint_target, robot_targets, some_joints};
use std::time::Duration;

use simd_tests::daemon::{Daemon, Via, fixed};

use crate::{arm, load_arm, shoulder};

fn targets(robot: &str, target: Target) -> Vec<RobotTargets> {
    vec![robot_targets(robot, [joint_target("shoulder", target)])]
}

fn turn(steps: u64, robots: Vec<RobotTargets>) -> StepSimulationRequest {
    let selections = vec![every_joint("arm")];
    StepSimulationRequest { steps, robots, return_states: true, selections, ..Default::default() }
}

/// A turn in one call is equal to the bit to the three calls that it replaces.
async fn a_turn_in_one_call_is_what_the_three_calls_are(via: Via) {
    let (one, three) = (arm(via).await, arm(via).await);
    for i in 0..20 {
        let target = Target::position(f64::from(i) * 0.05);
        let answer = one.client.step_with(turn(7, targets("arm", target))).await.unwrap();
        crate::set(&three, target).await;
        three.client.step(7).await.unwrap();
        let expected = three.client.joint_states(vec![every_joint("arm")]).await.unwrap();
        let states = answer.states.unwrap();
        let stamp = answer.stamp.unwrap();
        assert_eq!(states.stamp, Some(stamp));
        assert_eq!(stamp.step, expected.stamp.unwrap().step);
        assert_eq!(states.robots, expected.robots);
    }
}

async fn states_come_where_they_are_asked_for_and_of_which(via: Via) {
    let daemon = arm(via).await;
    load_arm(&daemon.client, "other").await;
    let plain = StepSimulationRequest { steps: 1, ..Default::default() };
    assert_eq!(daemon.client.step_with(plain.clone()).await.unwrap().states, None);
    let all = StepSimulationRequest { return_states: true, ..plain.clone() };
    assert_eq!(daemon.client.step_with(all).await.unwrap().states.unwrap().robots.len(), 2);
    let some = StepSimulationRequest {
        return_states: true,
        selections: vec![some_joints("other", ["shoulder"])],
        ..plain
    };
    let states = daemon.client.step_with(some).await.unwrap().states.unwrap();
    assert_eq!(states.robots.iter().map(|robot| robot.robot.as_str()).collect::<Vec<_>>(), ["other"]);
}

async fn a_refused_turn_neither_sets_nor_steps(via: Via) {
    let daemon = arm(via).await;
    let before = shoulder(&daemon).await;
    let nan = Target::position(f64::NAN);
    let cases = [
        (turn(5, targets("missing", Target::Hold)), ErrorReason::RobotNotFound),
        (turn(5, targets("arm", nan)), ErrorReason::InvalidValue),
        (turn(0, targets("arm", Target::position(0.5))), ErrorReason::InvalidValue),
        (turn(u64::MAX, targets("arm", Target::position(0.5))), ErrorReason::LimitExceeded),
        (
            StepSimulationRequest {
                selections: vec![some_joints("arm", ["elbow"])],
                ..turn(5, targets("arm", Target::position(0.5)))
            },
            ErrorReason::JointNotFound,
        ),
    ];
    for (request, reason) in cases {
        let refused = daemon.client.step_with(request).await.unwrap_err();
        assert_eq!(refused.reason(), Some(reason), "{refused}");
    }
    assert_eq!(shoulder(&daemon).await, before);
    assert_eq!(daemon.client.world_statistics().await.unwrap().iterations, 0);

    daemon.client.play().await.unwrap();
    let refused = daemon.client.step_with(turn(1, targets("arm", Target::position(0.5)))).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::WrongState));
    assert_eq!(shoulder(&daemon).await.target, before.target);
}

async fn a_turn_says_what_was_clamped_or_is_refused_as_it_asks(via: Via) {
    let daemon = arm(via).await;
    let joint = proto::JointProperties {
        joint: "shoulder".into(),
        limits: Some(proto::JointLimits { lower: Some(-1.0), upper: Some(1.0), ..Default::default() }),
        ..Default::default()
    };
    daemon.client.set_joint_properties("arm", vec![joint]).await.unwrap();
    let request = turn(3, targets("arm", Target::position(2.0)));
    let clamped = daemon.client.step_with(request.clone()).await.unwrap().clamped;
    assert_eq!((clamped[0].joint.as_str(), clamped[0].requested, clamped[0].applied), ("shoulder", 2.0, 1.0));
    let refuse = StepSimulationRequest { limit_policy: proto::LimitPolicy::Refuse.into(), ..request };
    let refused = daemon.client.step_with(refuse).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::TargetBeyondLimit));
    assert_eq!(daemon.client.world_statistics().await.unwrap().iterations, 3);
}

async fn claimed_joints_take_a_turn_with_the_claim_alone(via: Via) {
    let daemon = arm(via).await;
    let lease = Duration::from_secs(60);
    let claim = daemon.client.claim_joints(vec![every_joint("arm")], "me", lease).await.unwrap();
    let request = turn(1, targets("arm", Target::position(0.5)));
    let refused = daemon.client.step_with(request.clone()).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::JointClaimed));
    daemon.client.step_with(StepSimulationRequest { claim, ..request }).await.unwrap();
    assert_eq!(shoulder(&daemon).await.target, 0.5);
}

async fn a_retried_turn_is_done_once_and_answered_with_the_same_states(via: Via) {
    let daemon = arm(via).await;
    let request = StepSimulationRequest {
        request_id: "turn-1".into(),
        ..turn(10, targets("arm", Target::position(0.5)))
    };
    let first = daemon.client.step_with(request.clone()).await.unwrap();
    daemon.client.step(5).await.unwrap();
    assert_eq!(daemon.client.step_with(request.clone()).await.unwrap(), first);
    // Even if the robot is gone by now.
    daemon.client.delete_robot("arm").await.unwrap();
    assert_eq!(daemon.client.step_with(request).await.unwrap(), first);
    assert_eq!(daemon.client.world_statistics().await.unwrap().iterations, 15);
}

/// Returns a driven arm and boxes that fall on the ground, on each other and on the arm.
async fn heap(via: Via) -> Daemon {
    let daemon = arm(via).await;
    let shape = |geometry| {
        let primitive = proto::Primitive { geometry: Some(geometry), ..Default::default() };
        Some(proto::DescriptionSource { source: Some(Source::Primitive(primitive)), ..Default::default() })
    };
    let plane = shape(Geometry::Plane(proto::PlaneGeometry::default()));
    let ground = proto::SpawnEntityRequest { source: plane, ..fixed("ground") };
    daemon.client.spawn(ground).await.unwrap();
    for i in 0..4 {
        let size = Some(proto::Vector3 { x: 0.2, y: 0.15, z: 0.1 });
        let position = Some(proto::Vector3 { x: 0.05 * f64::from(i), y: 0.02, z: 0.3 + 0.15 * f64::from(i) });
        let request = proto::SpawnEntityRequest {
            source: shape(Geometry::Box(proto::BoxGeometry { size })),
            pose: Some(proto::Pose { position, orientation: None }),
            base: proto::Base::Free.into(),
            ..fixed(&format!("box-{i}"))
        };
        daemon.client.spawn(request).await.unwrap();
    }
    crate::set(&daemon, Target::position(0.7)).await;
    daemon
}

/// To the bit: pose and velocity of every link, and every joint.
async fn a_thousand_calls_of_one_step_are_one_of_a_thousand_with_any_watchers(via: Via) {
    let (one, many) = (heap(via).await, heap(via).await);
    one.client.step(1_000).await.unwrap();
    let watcher = many.another_client().await;
    // Read sometimes, or never.
    let _stalled = watcher.watch(Vec::new(), 1_000.0).await.unwrap();
    let mut touched = 0;
    for i in 0..1_000 {
        many.client.step(1).await.unwrap();
        if i % 50 == 0 {
            watcher.link_states(Vec::new()).await.unwrap();
            touched += watcher.contacts(None).await.unwrap().len();
        }
    }
    assert!(touched > 20, "{touched}");
    let (a, b) = (one.client.link_states(Vec::new()).await, many.client.link_states(Vec::new()).await);
    let (a, b) = (a.unwrap(), b.unwrap());
    assert_eq!(a.stamp.unwrap().step, b.stamp.unwrap().step);
    assert_eq!(a.robots, b.robots);
    let (a, b) = (one.client.joint_states(Vec::new()).await, many.client.joint_states(Vec::new()).await);
    assert_eq!(a.unwrap().robots, b.unwrap().robots);
}

crate::over_every_transport![
    a_thousand_calls_of_one_step_are_one_of_a_thousand_with_any_watchers,
    a_turn_in_one_call_is_what_the_three_calls_are,
    states_come_where_they_are_asked_for_and_of_which,
    a_refused_turn_neither_sets_nor_steps,
    a_turn_says_what_was_clamped_or_is_refused_as_it_asks,
    claimed_joints_take_a_turn_with_the_claim_alone,
    a_retried_turn_is_done_once_and_answered_with_the_same_states,
];

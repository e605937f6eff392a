//! Claims, over every transport: only the holder changes claimed parts; how a claim ends.

use simd_client::proto::{
    self, ApplyLinkWrenchRequest, ClaimJointsRequest, ErrorReason, JointProperties, LinkProperties,
    PullLinkRequest, ReleaseCause, ReloadEntityRequest, ResetSimulationRequest, SetCollisionFilterRequest,
    SetEntityStateRequest, SetPhysicsRequest, SimulationState, event::Kind,
};
use simd_client::{Client, Error, Target, every_joint, joint_target};
use simd_tests::daemon::{Daemon, Via};

use crate::{arm, over_every_transport};

over_every_transport! {
    a_claimed_robot_is_changed_by_its_holder_alone,
    calls_for_all_clients_need_the_world_while_another_client_holds_a_claim,
    a_higher_priority_takes_over_and_an_event_says_so,
    a_claim_that_is_not_used_lapses_and_an_event_says_so,
}

fn claim_of(robot: &str) -> ClaimJointsRequest {
    ClaimJointsRequest {
        selections: vec![every_joint(robot)],
        holder: "planner".into(),
        lease: 60.0,
        ..Default::default()
    }
}

/// Returns a client that comes with a new claim.
async fn holder(daemon: &Daemon, request: ClaimJointsRequest) -> Client {
    let secret = daemon.client.claim(request).await.unwrap();
    daemon.client.clone().with_claim(&secret)
}

/// Returns the result of every change of the robot "arm" for this client; the last one deletes it.
async fn change_arm(client: &Client) -> Vec<(&'static str, Result<(), Error>)> {
    let robot = || "arm".to_owned();
    let damping = JointProperties { joint: "shoulder".into(), damping: Some(0.1), ..Default::default() };
    let wrench = ApplyLinkWrenchRequest {
        robot: robot(),
        link: "arm".into(),
        wrench: Some(proto::Wrench::default()),
        ..Default::default()
    };
    let pull = PullLinkRequest { robot: robot(), link: "arm".into(), ..Default::default() };
    let state =
        SetEntityStateRequest { robot: robot(), twist: Some(proto::Twist::default()), ..Default::default() };
    let filter =
        SetCollisionFilterRequest { robot: robot(), self_collision: Some(false), ..Default::default() };
    let surface = LinkProperties { friction: Some(0.5), ..Default::default() };
    let reload = ReloadEntityRequest { robot: robot(), ..Default::default() };
    vec![
        (
            "targets",
            client
                .set_robot_targets("arm", [joint_target("shoulder", Target::position(0.1))])
                .await
                .map(drop),
        ),
        ("reset", client.reset_joints("arm", Vec::new()).await.map(drop)),
        ("properties", client.set_joint_properties("arm", vec![damping]).await.map(drop)),
        ("wrench", client.apply_wrench(wrench).await.map(drop)),
        ("pull", client.pull(pull).await.map(drop)),
        ("state", client.set_robot_state(state).await.map(drop)),
        ("filter", client.set_collision_filter(filter).await.map(drop)),
        ("surfaces", client.set_link_properties("arm", [surface]).await.map(drop)),
        ("reload", client.reload(reload).await.map(drop)),
        ("delete", client.delete_robot("arm").await.map(drop)),
    ]
}

async fn a_claimed_robot_is_changed_by_its_holder_alone(via: Via) {
    let daemon = arm(via).await;
    let holder = holder(&daemon, claim_of("arm")).await;
    for (what, outcome) in change_arm(&daemon.client).await {
        let refused = outcome.expect_err(what);
        let reason = refused.reason();
        let is_claimed = matches!(reason, Some(ErrorReason::RobotClaimed | ErrorReason::JointClaimed));
        assert!(is_claimed, "{what}: {refused}");
        assert!(refused.to_string().contains("planner"), "{what}: {refused}");
    }
    let robots = daemon.client.robots().await.unwrap();
    assert_eq!(robots[0].claimed_by, "planner");
    for (what, outcome) in change_arm(&holder).await {
        outcome.unwrap_or_else(|error| panic!("{what}: {error}"));
    }
}

async fn calls_for_all_clients_need_the_world_while_another_client_holds_a_claim(via: Via) {
    async fn change_world(client: &Client) -> Vec<Result<(), Error>> {
        let physics = SetPhysicsRequest { substeps: Some(2), ..Default::default() };
        let reset = ResetSimulationRequest { state: true, ..Default::default() };
        vec![
            client.set_simulation_state(SimulationState::Paused).await.map(drop),
            client.set_physics(physics).await.map(drop),
            client.reset(reset).await.map(drop),
            client.restore_state("here").await.map(drop),
        ]
    }
    let daemon = arm(via).await;
    daemon.client.save_state("here").await.unwrap();
    let holder_of_arm = holder(&daemon, claim_of("arm")).await;
    for outcome in change_world(&daemon.client).await {
        assert_eq!(outcome.unwrap_err().reason(), Some(ErrorReason::WorldNotClaimed));
    }
    // It concerns no other client.
    for outcome in change_world(&holder_of_arm).await {
        outcome.unwrap();
    }
    let world =
        ClaimJointsRequest { selections: Vec::new(), world: true, holder: "operator".into(), ..claim_of("") };
    let operator = holder(&daemon, world.clone()).await;
    assert_eq!(daemon.client.world_statistics().await.unwrap().claimed_by, "operator");
    for outcome in change_world(&operator).await {
        outcome.unwrap();
    }
    for outcome in change_world(&holder_of_arm).await {
        assert_eq!(outcome.unwrap_err().reason(), Some(ErrorReason::WorldClaimed));
    }
    assert_eq!(holder_of_arm.step(1).await.unwrap_err().reason(), Some(ErrorReason::WorldClaimed));
    assert_eq!(daemon.client.claim(world).await.unwrap_err().reason(), Some(ErrorReason::WorldClaimed));
    operator.step(1).await.unwrap();
    operator.release_joints(operator.held_claim()).await.unwrap();
    holder_of_arm.step(1).await.unwrap();
}

async fn a_higher_priority_takes_over_and_an_event_says_so(via: Via) {
    let daemon = arm(via).await;
    let mut events = daemon.client.watch_events(0).await.unwrap();
    let low = holder(&daemon, ClaimJointsRequest { priority: 1, ..claim_of("arm") }).await;
    let same = ClaimJointsRequest { priority: 1, holder: "safety".into(), ..claim_of("arm") };
    assert_eq!(
        daemon.client.claim(same.clone()).await.unwrap_err().reason(),
        Some(ErrorReason::RobotClaimed)
    );
    let high = holder(&daemon, ClaimJointsRequest { priority: 2, ..same }).await;
    let lost = low.reset_joints("arm", Vec::new()).await.unwrap_err();
    assert_eq!(lost.reason(), Some(ErrorReason::ClaimNotFound));
    high.reset_joints("arm", Vec::new()).await.unwrap();
    let released = loop {
        let event = events.next().await.unwrap().unwrap().event;
        if let Some(Kind::JointsReleased(released)) = event.kind {
            break released;
        }
    };
    assert_eq!(released.cause(), ReleaseCause::TakenOver);
    assert_eq!((released.holder.as_str(), released.taken_over_by.as_str()), ("planner", "safety"));
    assert_eq!(released.robots, ["arm"]);
    // No priority keeps an administrator out.
    holder(&daemon, ClaimJointsRequest { take_over: true, ..claim_of("arm") }).await;
    assert_eq!(high.step(1).await.unwrap_err().reason(), Some(ErrorReason::ClaimNotFound));
}

async fn a_claim_that_is_not_used_lapses_and_an_event_says_so(via: Via) {
    let daemon = arm(via).await;
    let mut events = daemon.client.watch_events(0).await.unwrap();
    let holder = holder(&daemon, ClaimJointsRequest { lease: 0.1, ..claim_of("arm") }).await;
    loop {
        let event = events.next().await.unwrap().unwrap().event;
        if let Some(Kind::JointsReleased(released)) = event.kind {
            assert_eq!(released.cause(), ReleaseCause::Lapsed);
            break;
        }
    }
    let lost = holder.reset_joints("arm", Vec::new()).await.unwrap_err();
    assert_eq!(lost.reason(), Some(ErrorReason::ClaimNotFound));
    daemon.client.reset_joints("arm", Vec::new()).await.unwrap();
}

/// Over gRPC the connection, and over Zenoh the session if its client has declared a token.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_claim_that_is_bound_to_its_connection_ends_with_it() {
    for via in [Via::Grpc, Via::Zenoh] {
        let daemon = arm(via).await;
        let other = daemon.another_client().await;
        let bound = ClaimJointsRequest { until_disconnect: true, lease: 3600.0, ..claim_of("arm") };
        let secret = other.claim(bound).await.unwrap();
        let mut events = daemon.client.watch_events(0).await.unwrap();
        daemon.client.delete_robot("arm").await.unwrap_err();
        drop(other);
        loop {
            let event = events.next().await.unwrap().unwrap().event;
            if let Some(Kind::JointsReleased(released)) = event.kind {
                assert_eq!(released.cause(), ReleaseCause::Disconnected, "{via:?}");
                break;
            }
        }
        let lost = daemon.client.clone().with_claim(&secret).delete_robot("arm").await.unwrap_err();
        assert_eq!(lost.reason(), Some(ErrorReason::ClaimNotFound));
        daemon.client.delete_robot("arm").await.unwrap();
    }
}

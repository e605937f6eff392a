//! Several clients that step one world together, over every transport.

use std::time::Duration;

use simd_client::proto::event::Kind;
use simd_client::proto::{
    ClaimJointsRequest, ErrorReason, JointMode, LockstepCause, SimulationState, StepSimulationRequest,
    StepSimulationResponse,
};
use simd_client::{Client, Error, Target, every_joint, joint_target, robot_targets};
use simd_tests::daemon::{Daemon, Via};
use simd_tests::process::soon;

use crate::{arm, load_arm, over_every_transport, shoulder};

over_every_transport! {
    the_world_advances_once_each_member_has_asked_and_to_the_nearest_step,
    a_member_beyond_its_timeout_is_removed_and_the_others_continue,
    while_there_are_members_others_neither_step_nor_play,
    a_step_of_a_member_that_is_refused_has_set_nothing,
    no_member_delays_the_holder_of_the_world,
}

const LONG: Duration = Duration::from_secs(60);

fn steps(steps: u64, member: &str) -> StepSimulationRequest {
    StepSimulationRequest { steps, lockstep_member: member.into(), ..Default::default() }
}

fn at(answer: Result<StepSimulationResponse, Error>) -> u64 {
    answer.unwrap().stamp.unwrap().step
}

async fn step(client: &Client) -> u64 {
    client.joint_states(Vec::new()).await.unwrap().stamp.unwrap().step
}

async fn members(daemon: &Daemon, count: usize) {
    soon("the members", async { while daemon.client.lockstep_members().await.unwrap().len() != count {} })
        .await;
}

/// Waits until this number of members wait for the others.
async fn waiting(daemon: &Daemon, count: usize) {
    soon("those who wait", async {
        let waits = |members: Vec<simd_client::proto::LockstepMember>| {
            members.iter().filter(|member| member.waits_for > 0).count()
        };
        while waits(daemon.client.lockstep_members().await.unwrap()) != count {
            // The handle answers at once: others have to get on too.
            tokio::task::yield_now().await;
        }
    })
    .await;
}

async fn the_world_advances_once_each_member_has_asked_and_to_the_nearest_step(via: Via) {
    let daemon = arm(via).await;
    load_arm(&daemon.client, "other").await;
    let client = &daemon.client;
    let (slow, fast) = (client.join_lockstep(LONG).await.unwrap(), client.join_lockstep(LONG).await.unwrap());
    let mut ten = Box::pin(client.step_with(StepSimulationRequest {
        robots: vec![robot_targets("arm", [joint_target("shoulder", Target::position(0.2))])],
        selections: vec![every_joint("arm")],
        return_states: true,
        ..steps(10, &slow)
    }));
    for turn in 1..=3 {
        let four = client.step_with(steps(3, &fast));
        tokio::select! {
            answer = &mut ten => panic!("answered before its step: {answer:?}"),
            answer = four => assert_eq!(at(answer), 3 * turn),
        }
    }
    // The nearest target is step ten: its member is answered, and the other waits for two more.
    let mut rest = Box::pin(client.step_with(steps(3, &fast)));
    let answer = tokio::select! {
        answer = &mut ten => answer.unwrap(),
        answer = &mut rest => panic!("answered before its step: {answer:?}"),
    };
    assert_eq!(answer.stamp.unwrap().step, 10);
    let position = answer.states.unwrap().robots[0].position[0];
    assert!(position > 0.0, "its target holds from the first of its steps: {position}");
    waiting(&daemon, 1).await;
    assert_eq!(step(client).await, 10);
    let mut five = Box::pin(client.step_with(steps(5, &slow)));
    tokio::select! {
        answer = rest => assert_eq!(at(answer), 12),
        answer = &mut five => panic!("answered before its step: {answer:?}"),
    }
}

async fn a_member_beyond_its_timeout_is_removed_and_the_others_continue(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let mut events = client.watch_events(0).await.unwrap();
    let quick = client.join_lockstep(Duration::from_millis(50)).await.unwrap();
    let patient = client.join_lockstep(LONG).await.unwrap();
    // The first member asks for nothing.
    assert_eq!(at(client.step_with(steps(2, &patient)).await), 2);
    let refused = client.step_with(steps(1, &quick)).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LockstepMemberNotFound), "{refused}");
    let left = soon("the event", async {
        loop {
            if let Some(Kind::LockstepChanged(changed)) = events.next().await.unwrap().unwrap().event.kind
                && changed.cause() == LockstepCause::TimedOut
            {
                return changed;
            }
        }
    });
    assert_eq!(left.await.members, 1);
    client.leave_lockstep(&patient).await.unwrap();
    let again = client.leave_lockstep(&patient).await.unwrap_err();
    assert_eq!(again.reason(), Some(ErrorReason::LockstepMemberNotFound), "{again}");
}

async fn while_there_are_members_others_neither_step_nor_play(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let member = client.join_lockstep(LONG).await.unwrap();
    for refused in [client.step(1).await.map(drop), client.play().await.map(drop)] {
        let refused = refused.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InLockstep), "{refused}");
        assert!(refused.to_string().contains("1 clients step the world together"), "{refused}");
    }
    assert_eq!(step(client).await, 0);
    client.leave_lockstep(&member).await.unwrap();
    client.step(1).await.unwrap();
    client.play().await.unwrap();
    assert_eq!(client.simulation_state().await.unwrap().state(), SimulationState::Playing);
    // A client that joins the lockstep of a playing world learns that it plays with its first step.
    let member = client.join_lockstep(LONG).await.unwrap();
    let refused = client.step_with(steps(1, &member)).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::WrongState), "{refused}");
}

async fn a_step_of_a_member_that_is_refused_has_set_nothing(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let targets = |robot: &str| vec![robot_targets(robot, [joint_target("shoulder", Target::position(0.2))])];
    let turn = |member: &str| StepSimulationRequest { robots: targets("arm"), ..steps(1, member) };
    let set = async || {
        let shoulder = shoulder(&daemon).await;
        (shoulder.mode, shoulder.target)
    };
    let before = set().await;
    client.play().await.unwrap();
    let member = client.join_lockstep(LONG).await.unwrap();
    let refused = client.step_with(turn(&member)).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::WrongState), "{refused}");
    client.pause().await.unwrap();
    assert_eq!(set().await, before);

    let world =
        ClaimJointsRequest { world: true, lease: 60.0, holder: "operator".into(), ..Default::default() };
    let secret = client.claim(world.clone()).await.unwrap();
    let refused = client.step_with(turn(&member)).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::WorldClaimed), "{refused}");
    let missing = StepSimulationRequest { robots: targets("missing"), ..steps(1, &member) };
    let operator = client.clone().with_claim(&secret);
    let refused = operator.step_with(missing).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::RobotNotFound), "{refused}");
    assert_eq!(set().await, before);
    assert_eq!(client.lockstep_members().await.unwrap()[0].waits_for, 0, "it has not asked");

    // The steps come with the claim of the member that joined first, also where it asks last.
    // A browser may ask over another connection, which is another client.
    client.release_joints(&secret).await.unwrap();
    let second = client.join_lockstep(LONG).await.unwrap();
    let operator = client.clone().with_claim(&client.claim(world).await.unwrap());
    let mut asked = Box::pin(client.step_with(turn(&second)));
    tokio::select! {
        answer = &mut asked => panic!("answered before its step: {answer:?}"),
        () = waiting(&daemon, 1) => {}
    }
    let (asked, last) = tokio::join!(asked, operator.step_with(turn(&member)));
    assert_eq!(at(asked), at(last));
    assert_eq!(set().await, (JointMode::Position, 0.2));
}

/// Over Zenoh a query does not end when its caller leaves, but with its session.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_member_whose_caller_went_away_has_not_asked() {
    let daemon = arm(Via::Grpc).await;
    let client = &daemon.client;
    let gone = client.join_lockstep(Duration::from_millis(200)).await.unwrap();
    let patient = client.join_lockstep(LONG).await.unwrap();
    {
        let mut asked = Box::pin(client.step_with(steps(5, &gone)));
        tokio::select! {
            answer = &mut asked => panic!("answered alone: {answer:?}"),
            () = waiting(&daemon, 1) => {}
        }
    }
    // Its timeout runs again, and then the other continues alone.
    assert_eq!(at(client.step_with(steps(4, &patient)).await), 4);
    members(&daemon, 1).await;
}

/// Steps done before its request do not count for it.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_member_that_joins_while_the_world_steps_gets_all_of_its_steps() {
    let daemon = arm(Via::Grpc).await;
    let client = &daemon.client;
    let first = client.join_lockstep(LONG).await.unwrap();
    let mut long = Box::pin(client.step_with(steps(50_000, &first)));
    let joined = async {
        while step(client).await < 1_000 {}
        let second = client.join_lockstep(LONG).await.unwrap();
        (second, step(client).await)
    };
    let (second, before) = tokio::select! {
        answer = &mut long => panic!("it is done too soon for this test: {answer:?}"),
        joined = joined => joined,
    };
    let others = async {
        assert_eq!(at(long.await), 50_000);
        client.leave_lockstep(&first).await.unwrap();
    };
    let request = steps(50_000, &second);
    let (answer, ()) = tokio::join!(client.step_with(request), others);
    let reached = at(answer);
    assert!(reached >= before + 50_000, "{reached} after {before}");
}

async fn no_member_delays_the_holder_of_the_world(via: Via) {
    let daemon = arm(via).await;
    let other = daemon.another_client().await;
    let member = other.join_lockstep(Duration::from_secs(3600)).await.unwrap();
    let world = ClaimJointsRequest { world: true, holder: "me".into(), lease: 600.0, ..Default::default() };
    let secret = daemon.client.claim(world).await.unwrap();
    let holder = daemon.client.clone().with_claim(&secret);
    let refused = other.join_lockstep(LONG).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::WorldClaimed), "{refused}");
    assert!(refused.to_string().contains("\"me\""), "{refused}");
    let refused = other.step_with(steps(1, &member)).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::WorldClaimed), "{refused}");
    holder.step(2).await.unwrap();
    assert_eq!(step(&holder).await, 2);
    // Steps in lockstep wait for the holder's members only.
    let own = holder.join_lockstep(LONG).await.unwrap();
    assert_eq!(at(holder.step_with(steps(3, &own)).await), 5);
    holder.leave_lockstep(&own).await.unwrap();
    holder.play().await.unwrap();
    holder.pause().await.unwrap();
    // Without its claim it is like any client.
    let refused = daemon.client.step(1).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::InLockstep), "{refused}");
}

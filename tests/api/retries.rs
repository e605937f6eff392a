//! Requests with an id are done once, and no caller gets the answer to another caller's request.

use prost::Message as _;
use simd_client::proto::{
    ClaimJointsRequest, ClaimJointsResponse, ErrorReason, ResetSimulationRequest, ResetSimulationResponse,
    SetPhysicsRequest, StepSimulationRequest, Vector3,
};
use simd_client::{Client, Error, every_joint};
use simd_tests::daemon::{Daemon, Via};
use simd_tests::network;
use simd_tests::process::soon;
use zenoh::sample::SourceInfo;

use crate::arm;

fn reset(id: &str) -> ResetSimulationRequest {
    ResetSimulationRequest { time: true, request_id: id.into(), ..Default::default() }
}

async fn epoch(client: &Client) -> u64 {
    client.world_statistics().await.unwrap().stamp.unwrap().epoch
}

async fn an_id_of_one_method_says_nothing_of_another(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.reset(reset("x")).await.unwrap();
    let gravity = Some(Vector3 { x: 0.0, y: 0.0, z: -1.0 });
    let physics = SetPhysicsRequest { gravity, request_id: "x".into(), ..Default::default() };
    client.set_physics(physics).await.unwrap();
    assert_eq!(client.physics().await.unwrap().gravity, gravity);
    let steps = StepSimulationRequest { steps: 3, request_id: "x".into(), ..Default::default() };
    for _ in 0..2 {
        assert_eq!(client.step_with(steps.clone()).await.unwrap().stamp.unwrap().step, 3);
    }
    client.reset(reset("x")).await.unwrap();
    assert_eq!(epoch(client).await, 1, "the same reset was done once");
}

async fn an_id_that_comes_back_with_another_request_is_refused_and_nothing_is_done(via: Via) {
    let daemon = arm(via).await;
    daemon.client.reset(reset("x")).await.unwrap();
    let other = ResetSimulationRequest { spawned: true, ..reset("x") };
    let refused = daemon.client.reset(other).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::RequestIdReused), "{refused}");
    let Error::Refused(refusal) = refused else { panic!("{refused}") };
    assert_eq!(refusal.metadata["request_id"], "x");
    assert_eq!(daemon.client.robots().await.unwrap().len(), 1);
    assert_eq!(epoch(&daemon.client).await, 1);
}

async fn ids_belong_to_the_name_of_a_client(via: Via) {
    let daemon = arm(via).await;
    let [one, two] = ["one", "two"].map(|name| daemon.client.clone().with_name(name));
    one.reset(reset("1")).await.unwrap();
    two.reset(reset("1")).await.unwrap();
    assert_eq!(epoch(&one).await, 2);
    // A client with the same name over another connection is the same client.
    let again = daemon.another_client().await.with_name("one");
    again.reset(reset("1")).await.unwrap();
    assert_eq!(epoch(&one).await, 2);
}

/// Over gRPC, gRPC-Web and in JSON a caller without a name is known by its connection. A browser has several
/// and chooses among them. So its retry may look like another request, but never like another caller's. Within the process all callers are one. Over Zenoh the daemon cannot identify the caller, and
/// refuses an id.
async fn callers_without_a_name_have_ids_of_their_connection(via: Via) {
    let daemon = arm(via).await;
    let [one, two] = [daemon.client.clone(), daemon.another_client().await].map(|it| it.with_name(""));
    if via == Via::Zenoh {
        let refused = one.reset(reset("1")).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{refused}");
        one.reset(reset("")).await.unwrap();
        return;
    }
    for client in [&one, &one, &two, &two] {
        client.reset(reset("1")).await.unwrap();
    }
    let resets = epoch(&one).await;
    match via {
        Via::Handle => assert_eq!(resets, 1),
        Via::Web | Via::Json => assert!((2..=4).contains(&resets), "{resets}"),
        Via::Grpc | Via::Zenoh => assert_eq!(resets, 2),
    }
    // A named caller has separate ids.
    one.clone().with_name("one").reset(reset("1")).await.unwrap();
    assert_eq!(epoch(&one).await, resets + 1);
}

/// An id stays the same however often its request is refused, and the first error is returned.
async fn a_refusal_is_remembered_as_it_was(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let steps = StepSimulationRequest { steps: u64::MAX, request_id: "x".into(), ..Default::default() };
    let first = daemon.client.step_with(steps.clone()).await.unwrap_err();
    let again = daemon.client.step_with(steps).await.unwrap_err();
    assert_eq!(first.reason(), Some(ErrorReason::LimitExceeded), "{first}");
    let (Error::Refused(first), Error::Refused(again)) = (first, again) else { panic!("two refusals") };
    assert_eq!(first, again);
}

/// A client that knows name and id does not get the secret, and neither does the claim's own client once more.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn over_zenoh_a_claims_secret_is_given_once() {
    let daemon = arm(Via::Zenoh).await;
    let session = network::session("client", &daemon.running.locators()[0]).await;
    let (holder, request_id) = ("bench".to_owned(), "x".to_owned());
    let request = ClaimJointsRequest {
        selections: vec![every_joint("arm")],
        holder,
        lease: 60.0,
        request_id,
        ..Default::default()
    };
    let ask = async || {
        let query = session.get("simd/simd/rpc/JointService/ClaimJoints").payload(request.encode_to_vec());
        let replies = query.attachment("simd-client: bench").await.unwrap();
        soon("a reply", replies.recv_async()).await.unwrap().into_result()
    };
    let claimed = ask().await.unwrap();
    let claimed = ClaimJointsResponse::decode(&*claimed.payload().to_bytes()).unwrap();
    let refused = ask().await.unwrap_err();
    let refused = String::from_utf8_lossy(&refused.payload().to_bytes()).into_owned();
    assert!(refused.contains("REQUEST_ID_REUSED") && !refused.contains(&claimed.claim), "{refused}");
}

/// A session without a name has separate ids if its queries name their source.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn over_zenoh_a_query_without_a_name_is_known_by_its_source() {
    let daemon = arm(Via::Zenoh).await;
    let mut epochs = Vec::new();
    for _session in 0..2 {
        let session = network::session("client", &daemon.running.locators()[0]).await;
        let querier =
            session.declare_querier("simd/simd/rpc/SimulationService/ResetSimulation").await.unwrap();
        for _retry in 0..2 {
            let query = querier.get().payload(reset("x").encode_to_vec());
            let replies = query.source_info(SourceInfo::new(querier.id(), 0)).await.unwrap();
            let reply = soon("a reply", replies.recv_async()).await.unwrap().into_result().unwrap();
            let answer = ResetSimulationResponse::decode(&*reply.payload().to_bytes()).unwrap();
            epochs.push(answer.stamp.unwrap().epoch);
        }
    }
    assert_eq!(epochs, [1, 1, 2, 2]);
}

crate::over_every_transport![
    an_id_of_one_method_says_nothing_of_another,
    an_id_that_comes_back_with_another_request_is_refused_and_nothing_is_done,
    ids_belong_to_the_name_of_a_client,
    callers_without_a_name_have_ids_of_their_connection,
    a_refusal_is_remembered_as_it_was,
];

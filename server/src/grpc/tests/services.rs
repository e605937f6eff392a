//! The services, one call at a time.

use std::collections::BTreeSet;

use simd_proto::{API_VERSION, API_VERSION_HEADER};
use tokio_stream::StreamExt as _;
use tonic::{Code, Request};
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;
use tonic_reflection::pb::v1::ServerReflectionRequest;
use tonic_reflection::pb::v1::server_reflection_client::ServerReflectionClient;
use tonic_reflection::pb::v1::server_reflection_request::MessageRequest;
use tonic_reflection::pb::v1::server_reflection_response::MessageResponse;

use super::*;

fn of_version<T>(message: T, version: &str) -> Request<T> {
    let mut request = Request::new(message);
    request.metadata_mut().insert(API_VERSION_HEADER, version.parse().unwrap());
    request
}

#[tokio::test]
async fn a_client_of_another_version_learns_only_who_the_daemon_is() {
    let daemon = Daemon::start(RunState::Paused).await;
    let info =
        daemon.simulation().get_simulator_info(of_version(v1::GetSimulatorInfoRequest {}, "9.0")).await;
    let info = info.unwrap().into_inner();
    assert_eq!((info.simulator.as_str(), info.name.as_str()), ("simd", "test"));
    assert_eq!((info.api_major, info.api_minor), (API_VERSION.major, API_VERSION.minor));
    assert_eq!(info.limits.unwrap().max_message_bytes, 16 << 20);

    let refused = daemon.entities().list_entities(of_version(v1::ListEntitiesRequest {}, "9.0")).await;
    assert_eq!(reason(&refused.unwrap_err()), "VERSION_MISMATCH");
    let ours = API_VERSION.to_string();
    assert!(daemon.entities().list_entities(of_version(v1::ListEntitiesRequest {}, &ours)).await.is_ok());
}

#[tokio::test]
async fn joints_can_be_listed_set_and_read() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut joints = daemon.joints();
    let layout = joints.get_joint_layout(v1::GetJointLayoutRequest { robot: "arm".into() }).await;
    let layout = layout.unwrap().into_inner().layout.unwrap();
    assert_eq!(layout.joints.len(), 4);

    let robots = move_shoulder("arm", 0.5);
    let request = v1::SetJointTargetsRequest { robots, ..Default::default() };
    joints.set_joint_targets(request).await.unwrap();
    let request = v1::GetJointStatesRequest { selections: vec![shoulder()] };
    let states = joints.get_joint_states(request).await.unwrap().into_inner().states.unwrap();
    assert_eq!(states.robots[0].target, [0.5]);
    assert_eq!(states.robots[0].mode, [v1::JointMode::Position as i32]);
    assert_eq!(states.robots[0].layout_version, layout.layout_version);

    let missing = v1::GetJointLayoutRequest { robot: "missing".into() };
    let refused = joints.get_joint_layout(missing).await.unwrap_err();
    assert_eq!((refused.code(), reason(&refused).as_str()), (Code::NotFound, "ROBOT_NOT_FOUND"));
}

#[tokio::test]
async fn a_retry_gets_the_first_answer_again() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut simulation = daemon.simulation();
    let request =
        |request_id: &str| v1::SaveStateRequest { request_id: request_id.into(), ..Default::default() };
    let first = simulation.save_state(request("a")).await.unwrap().into_inner();
    assert_eq!(first.saved_state.as_ref().unwrap().name, "state-1");
    assert_eq!(simulation.save_state(request("a")).await.unwrap().into_inner(), first);
    let other = simulation.save_state(request("b")).await.unwrap().into_inner();
    assert_eq!(other.saved_state.unwrap().name, "state-2");
    let list = simulation.list_saved_states(v1::ListSavedStatesRequest {}).await.unwrap().into_inner();
    assert_eq!(list.saved_states.len(), 2);
}

#[tokio::test]
async fn stepping_needs_a_world_that_is_not_playing() {
    let daemon = Daemon::start(RunState::Playing).await;
    let mut simulation = daemon.simulation();
    let step = || v1::StepSimulationRequest { steps: 10, ..Default::default() };
    let refused = simulation.step_simulation(step()).await.unwrap_err();
    assert_eq!(reason(&refused), "WRONG_STATE");

    let stop =
        v1::SetSimulationStateRequest { state: v1::SimulationState::Stopped.into(), ..Default::default() };
    simulation.set_simulation_state(stop).await.unwrap();
    let stamp = simulation.step_simulation(step()).await.unwrap().into_inner().stamp.unwrap();
    assert_eq!(stamp.step, 10);
    let reset = simulation.reset_simulation(v1::ResetSimulationRequest::default()).await.unwrap();
    let after = reset.into_inner().stamp.unwrap();
    assert_eq!((after.step, after.epoch), (0, stamp.epoch + 1));
}

#[tokio::test]
async fn physics_that_are_set_are_those_that_are_read() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut simulation = daemon.simulation();
    let request = v1::SetPhysicsRequest {
        time_step: Some(1e-4),
        pace: v1::PaceMode::AsFastAsPossible.into(),
        ..Default::default()
    };
    let set = simulation.set_physics(request).await.unwrap().into_inner().physics;
    let read = simulation.get_physics(v1::GetPhysicsRequest {}).await.unwrap().into_inner().physics;
    assert_eq!(set, read);
    assert_eq!(read.unwrap().time_step, 1e-4);
    let bad = v1::SetPhysicsRequest { time_step: Some(f64::NAN), ..Default::default() };
    let refused = simulation.set_physics(bad).await.unwrap_err();
    let violations = refused.get_details_bad_request().unwrap().field_violations;
    assert_eq!(violations[0].field, "time_step");
}

#[tokio::test]
async fn the_next_state_is_newer_or_the_same_after_the_timeout() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut joints = daemon.joints();
    let newest = daemon.handle.newest().sequence;
    let request = |after_sequence| v1::NextJointStatesRequest {
        after_sequence,
        timeout: 1e-3,
        selections: vec![shoulder()],
        ..Default::default()
    };
    let states = joints.next_joint_states(request(0)).await.unwrap().into_inner().states.unwrap();
    assert_eq!(sequence(&states), newest);
    let states = joints.next_joint_states(request(newest)).await.unwrap().into_inner().states.unwrap();
    assert_eq!(sequence(&states), newest);
    daemon.handle.step(3).await.unwrap();
    let states = joints.next_joint_states(request(newest)).await.unwrap().into_inner().states.unwrap();
    assert_eq!(sequence(&states), newest + 3);
}

#[tokio::test]
async fn a_watcher_never_sees_a_state_twice() {
    let daemon = Daemon::start(RunState::Playing).await;
    let request =
        v1::WatchJointStatesRequest { selections: vec![shoulder()], rate: 1000.0, ..Default::default() };
    let states = daemon.joints().watch_joint_states(request).await.unwrap().into_inner();
    let seen: Vec<u64> =
        states.take(20).map(|answer| sequence(&answer.unwrap().states.unwrap())).collect().await;
    assert!(seen.windows(2).all(|pair| pair[0] < pair[1]), "{seen:?}");

    let missing = v1::JointSelection { robot: "missing".into(), joints: Vec::new() };
    let request = v1::WatchJointStatesRequest { selections: vec![missing], ..Default::default() };
    let refused = daemon.joints().watch_joint_states(request).await.unwrap_err();
    assert_eq!(reason(&refused), "ROBOT_NOT_FOUND");
}

#[tokio::test]
async fn claimed_joints_are_refused_to_others() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut joints = daemon.joints();
    let request =
        v1::ClaimJointsRequest { selections: vec![shoulder()], holder: "me".into(), ..Default::default() };
    let claim = joints.claim_joints(request).await.unwrap().into_inner().claim;
    let set = |claim: &str| v1::SetJointTargetsRequest {
        robots: move_shoulder("arm", 0.1),
        claim: claim.into(),
        ..Default::default()
    };
    let refused = joints.set_joint_targets(set("")).await.unwrap_err();
    assert_eq!(reason(&refused), "JOINT_CLAIMED");
    joints.set_joint_targets(set(&claim)).await.unwrap();
    let release = || v1::ReleaseJointsRequest { claim: claim.clone(), request_id: String::new() };
    joints.release_joints(release()).await.unwrap();
    assert_eq!(reason(&joints.release_joints(release()).await.unwrap_err()), "CLAIM_NOT_FOUND");
}

#[tokio::test]
async fn events_are_watched_from_now_on_or_from_a_number() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut events = daemon.events();
    let watch = |after_sequence| v1::WatchEventsRequest { after_sequence };
    let mut now = events.watch_events(watch(0)).await.unwrap().into_inner();
    daemon.handle.command(simd_core::Command::Delete { robot: "arm".into() }).await.unwrap();
    let deleted = now.message().await.unwrap().unwrap().event.unwrap();
    assert!(matches!(deleted.kind, Some(v1::event::Kind::EntityDeleted(_))), "{deleted:?}");
    let mut again = events.watch_events(watch(deleted.sequence - 1)).await.unwrap().into_inner();
    assert_eq!(again.message().await.unwrap().unwrap().event, Some(deleted));

    let next = v1::NextEventsRequest { after_sequence: 0, timeout: 0.0 };
    let next = events.next_events(next).await.unwrap().into_inner();
    assert_eq!(next.last_sequence, next.events.len() as u64);
}

#[tokio::test]
async fn a_description_that_would_be_refused_validates_with_a_report() {
    let daemon = Daemon::start(RunState::Paused).await;
    let urdf = b"<robot name=\"a\"><link name=\"x\"/><link name=\"y\"/></robot>".to_vec();
    let source = v1::DescriptionSource {
        source: Some(v1::description_source::Source::Urdf(urdf)),
        ..Default::default()
    };
    let request = v1::ValidateDescriptionRequest { source: Some(source.clone()), ..Default::default() };
    let answer = daemon.entities().validate_description(request).await.unwrap().into_inner();
    assert_eq!(answer.entity, None);
    let findings = answer.report.unwrap().findings;
    assert_eq!(findings.last().unwrap().severity(), v1::Severity::Error);

    let request = v1::SpawnEntityRequest { source: Some(source), ..Default::default() };
    let refused = daemon.entities().spawn_entity(request).await.unwrap_err();
    assert_eq!(reason(&refused), "INVALID_DESCRIPTION");
}

#[tokio::test]
async fn a_robot_can_be_spawned_looked_at_and_deleted() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut entities = daemon.entities();
    let urdf = b"<robot name=\"one\"><link name=\"world\"/></robot>".to_vec();
    let size = urdf.len() as u64;
    let source = v1::DescriptionSource {
        source: Some(v1::description_source::Source::Urdf(urdf)),
        ..Default::default()
    };
    let request = v1::SpawnEntityRequest { source: Some(source), ..Default::default() };
    let spawned = entities.spawn_entity(request).await.unwrap().into_inner();
    let entity = spawned.entity.unwrap();
    assert_eq!((entity.name.as_str(), entity.base()), ("one", v1::Base::Fixed));
    assert_eq!(entity.description.len(), 64);

    let asset = v1::GetAssetRequest { sha256: entity.description.clone(), ..Default::default() };
    assert_eq!(entities.get_asset(asset).await.unwrap().into_inner().total_bytes, size);
    let list = entities.list_entities(v1::ListEntitiesRequest {}).await.unwrap().into_inner();
    assert_eq!(list.entities.iter().map(|e| e.name.as_str()).collect::<Vec<_>>(), ["arm", "one"]);
    let poses = entities.get_link_poses(v1::GetLinkPosesRequest { robots: vec!["one".into()] }).await;
    assert_eq!(poses.unwrap().into_inner().robots[0].poses.len(), 7);

    let delete = || v1::DeleteEntityRequest { robot: "one".into(), ..Default::default() };
    entities.delete_entity(delete()).await.unwrap();
    assert_eq!(reason(&entities.delete_entity(delete()).await.unwrap_err()), "ROBOT_NOT_FOUND");
}

#[tokio::test]
async fn health_and_schema_can_be_asked_for() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut health = HealthClient::new(daemon.channel.clone());
    let schema: BTreeSet<_> =
        simd_proto::methods::all().map(|(service, _, _)| format!("simd.v1.{service}")).collect();
    assert!(schema.len() >= 8, "{schema:?}");
    for service in schema.iter().cloned().chain([String::new()]) {
        let answer = health.check(HealthCheckRequest { service: service.clone() }).await;
        assert_eq!(answer.unwrap().into_inner().status(), ServingStatus::Serving, "{service}");
    }
    for service in ["missing", "JointService", "simd.v1.", "simd.v1.Missing"] {
        let unknown = health.check(HealthCheckRequest { service: service.into() }).await.unwrap_err();
        assert_eq!(unknown.code(), Code::NotFound);
    }

    let list = ServerReflectionRequest {
        host: String::new(),
        message_request: Some(MessageRequest::ListServices(String::new())),
    };
    let mut answers = ServerReflectionClient::new(daemon.channel.clone())
        .server_reflection_info(tokio_stream::once(list))
        .await
        .unwrap()
        .into_inner();
    let answer = answers.message().await.unwrap().unwrap().message_response.unwrap();
    let MessageResponse::ListServicesResponse(services) = answer else { panic!("{answer:?}") };
    let names: Vec<_> = services.service.iter().map(|service| service.name.as_str()).collect();
    for service in &schema {
        assert!(names.contains(&service.as_str()), "{names:?}");
    }
}

#[tokio::test]
async fn xacro_is_expanded_and_what_is_wrong_with_it_has_a_reason() {
    let daemon = Daemon::start(RunState::Paused).await;
    let request = |text: &str| v1::ExpandXacroRequest {
        files: [("arm/arm.xacro".to_owned(), text.as_bytes().to_vec())].into(),
        path: "arm/arm.xacro".into(),
        arguments: [("name".to_owned(), "left".to_owned())].into(),
    };
    let expanded = daemon.entities().expand_xacro(request("<robot name='$(arg name)'/>")).await.unwrap();
    assert!(String::from_utf8(expanded.into_inner().urdf).unwrap().contains("name=\"left\""));
    let refused =
        daemon.entities().expand_xacro(request("<robot>\n<a b='${c}'/></robot>")).await.unwrap_err();
    assert_eq!(reason(&refused), "INVALID_DESCRIPTION");
    assert!(refused.message().starts_with("/arm/arm.xacro:2: "), "{}", refused.message());
    let elsewhere = v1::ExpandXacroRequest { path: "other.xacro".into(), ..request("<robot/>") };
    let refused = daemon.entities().expand_xacro(elsewhere).await.unwrap_err();
    assert_eq!(reason(&refused), "INVALID_VALUE");
}

#[tokio::test]
async fn refusals_of_the_transport_have_a_reason_too() {
    let daemon = Daemon::start(RunState::Paused).await;
    let urdf = vec![b' '; (16 << 20) + 1];
    let request = v1::PrepareDescriptionRequest { urdf, assets: Default::default() };
    let refused = daemon.entities().prepare_description(request).await.unwrap_err();
    assert_eq!(reason(&refused), "LIMIT_EXCEEDED");
    assert_eq!(refused.code(), Code::ResourceExhausted);

    // A request of another method: its first field is not valid text.
    let mut client = tonic::client::Grpc::new(daemon.channel.clone());
    client.ready().await.unwrap();
    let codec =
        tonic_prost::ProstCodec::<v1::PrepareDescriptionRequest, v1::GetEntityInfoResponse>::default();
    let path = "/simd.v1.EntityService/GetEntityInfo".parse().unwrap();
    let request = v1::PrepareDescriptionRequest { urdf: vec![0xff], assets: Default::default() };
    let refused = client.unary(Request::new(request), path, codec).await.unwrap_err();
    assert_eq!(reason(&refused), "INVALID_VALUE");

    client.ready().await.unwrap();
    let codec = tonic_prost::ProstCodec::<v1::GetPhysicsRequest, v1::GetPhysicsResponse>::default();
    let path = "/simd.v1.EntityService/Fly".parse().unwrap();
    let request = Request::new(v1::GetPhysicsRequest {});
    let refused = client.unary(request, path, codec).await.unwrap_err();
    assert_eq!(reason(&refused), "NOT_SUPPORTED");
}

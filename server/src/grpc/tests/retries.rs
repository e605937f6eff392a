//! Request ids, as any gRPC client may send them.

use prost::Message as _;
use prost::encoding::{WireType, encode_key, encode_varint};
use prost_types::field_descriptor_proto::Type;
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};
use simd_proto::methods::{self, Method};
use simd_proto::raw::RawCodec;
use simd_proto::{CLIENT_HEADER, v1};
use tonic::codegen::http::uri::PathAndQuery;
use tonic::{Code, Request};

use super::*;

fn named<T>(name: &str, message: T) -> Request<T> {
    let mut request = Request::new(message);
    request.metadata_mut().insert(CLIENT_HEADER, name.parse().unwrap());
    request
}

/// Returns a field with a value other than its default.
fn field(field: &FieldDescriptorProto, text: &[u8]) -> Vec<u8> {
    let (number, mut bytes) = (field.number() as u32, Vec::new());
    match field.r#type() {
        Type::String | Type::Bytes | Type::Message => {
            encode_key(number, WireType::LengthDelimited, &mut bytes);
            encode_varint(text.len() as u64, &mut bytes);
            bytes.extend(text);
        }
        Type::Double => {
            encode_key(number, WireType::SixtyFourBit, &mut bytes);
            bytes.extend(1_f64.to_le_bytes());
        }
        _ => {
            encode_key(number, WireType::Varint, &mut bytes);
            bytes.push(1);
        }
    }
    bytes
}

/// Returns two requests of a message with the same id; `None` if it has none.
fn pair(message: &DescriptorProto) -> Option<[Vec<u8>; 2]> {
    let (ids, others): (Vec<_>, Vec<_>) =
        message.field.iter().partition(|field| field.name() == "request_id");
    let id = field(ids.first()?, b"an id");
    let other = others.iter().find(|field| field.r#type() != Type::Message).or(others.first())?;
    let text: &[u8] = if other.r#type() == Type::Message { b"" } else { b"other" };
    Some([id.clone(), [id, field(other, text)].concat()])
}

/// Returns methods whose request has an id, directly or in an inner request, with two requests of the same
/// id.
fn methods_with_ids() -> Vec<(&'static Method, [Vec<u8>; 2])> {
    let schema = FileDescriptorSet::decode(v1::FILE_DESCRIPTOR_SET).unwrap();
    let messages: Vec<_> = schema.file.iter().flat_map(|file| &file.message_type).collect();
    let find = |name: &str| messages.iter().find(|message| message.name() == name).copied();
    let requests = |method: &Method| {
        let message = find(&method.request)?;
        pair(message).or_else(|| {
            let within = message.field.iter().find(|field| field.type_name().ends_with("Request"))?;
            let pair = pair(find(within.type_name().trim_start_matches(".simd.v1."))?)?;
            Some(pair.map(|inside| field(within, &inside)))
        })
    };
    methods::all().filter_map(|(_, _, method)| Some((method, requests(method)?))).collect()
}

async fn call(daemon: &Daemon, method: &'static Method, request: Vec<u8>) -> Result<(), Status> {
    let mut grpc = tonic::client::Grpc::new(daemon.channel.clone());
    grpc.ready().await.unwrap();
    let request = named("bench", tokio_stream::once(bytes::Bytes::from(request)));
    let answers = grpc.streaming(request, PathAndQuery::from_static(&method.path), RawCodec).await?;
    let mut answers = answers.into_inner();
    while answers.message().await?.is_some() {}
    Ok(())
}

#[tokio::test]
async fn every_method_with_an_id_refuses_that_of_another_request() {
    let daemon = Daemon::start(RunState::Paused).await;
    let methods = methods_with_ids();
    assert!(methods.len() > 20, "{}", methods.len());
    for (method, [first, other]) in methods {
        let path = &method.path;
        // The service may refuse it, since it has nothing but its id.
        let done = call(&daemon, method, first.clone()).await.map_err(|status| reason(&status));
        assert_ne!(done, Err("REQUEST_ID_REUSED".to_owned()), "{path}");
        let again = call(&daemon, method, first).await.map_err(|status| reason(&status));
        assert_eq!(again, done, "{path}");
        let refused = call(&daemon, method, other).await.unwrap_err();
        assert_eq!(
            (refused.code(), reason(&refused).as_str()),
            (Code::AlreadyExists, "REQUEST_ID_REUSED"),
            "{path}"
        );
    }
}

#[tokio::test]
async fn a_deletion_with_the_id_of_another_is_refused_and_other_methods_are_done() {
    let daemon = Daemon::start(RunState::Paused).await;
    daemon.handle.command(spawn("other", &[])).await.unwrap();
    let (mut entities, mut simulation) = (daemon.entities(), daemon.simulation());
    let save = v1::SaveStateRequest { name: "mark".into(), request_id: "x".into(), ..Default::default() };
    simulation.save_state(save).await.unwrap();
    let delete = |robot: &str| v1::DeleteEntityRequest {
        robot: robot.into(),
        request_id: "x".into(),
        ..Default::default()
    };
    entities.delete_entity(delete("arm")).await.unwrap();
    assert_eq!(reason(&entities.delete_entity(delete("other")).await.unwrap_err()), "REQUEST_ID_REUSED");
    let robots = |daemon: &Daemon| {
        let newest = daemon.handle.newest();
        newest.state.world.entities.iter().map(|entity| entity.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(robots(&daemon), ["other"]);
    let restore =
        v1::RestoreStateRequest { name: "mark".into(), request_id: "x".into(), ..Default::default() };
    simulation.restore_state(restore).await.unwrap();
    assert_eq!(robots(&daemon), ["arm", "other"]);
    let play = v1::SetSimulationStateRequest {
        state: v1::SimulationState::Playing.into(),
        request_id: "x".into(),
        ..Default::default()
    };
    simulation.set_simulation_state(play).await.unwrap();
    assert_eq!(daemon.handle.statistics().state, RunState::Playing);
    let delete =
        v1::DeleteSavedStateRequest { name: "mark".into(), request_id: "x".into(), ..Default::default() };
    simulation.delete_saved_state(delete).await.unwrap();
    let left = simulation.list_saved_states(v1::ListSavedStatesRequest {}).await.unwrap();
    assert!(left.into_inner().saved_states.is_empty());
}

/// An untrusted client knows the client's name, its claims, and the id, which it may guess.
#[tokio::test]
async fn a_claims_secret_is_given_again_over_its_own_connection_alone() {
    let daemon = Daemon::start(RunState::Paused).await;
    let request = |id: &str| v1::ClaimJointsRequest {
        selections: vec![shoulder()],
        holder: "bench".into(),
        lease: 3600.0,
        request_id: id.into(),
        ..Default::default()
    };
    let mut joints = daemon.joints();
    let claimed = joints.claim_joints(named("bench", request("x"))).await.unwrap().into_inner();
    let again = joints.claim_joints(named("bench", request("x"))).await.unwrap().into_inner();
    assert_eq!(again, claimed);
    let endpoint = Endpoint::from_shared(format!("http://{}", daemon.address)).unwrap();
    let mut untrusted = JointServiceClient::new(endpoint.connect().await.unwrap());
    let refused = untrusted.claim_joints(named("bench", request("x"))).await.unwrap_err();
    assert_eq!(reason(&refused), "REQUEST_ID_REUSED");
    assert!(!format!("{refused:?}").contains(&claimed.claim));
    let refused = untrusted.claim_joints(Request::new(request("x"))).await.unwrap_err();
    assert_eq!(reason(&refused), "JOINT_CLAIMED");
    let refused = joints.claim_joints(named("bench", request("y"))).await.unwrap_err();
    assert_eq!(reason(&refused), "JOINT_CLAIMED");
}

/// Each refusal has a report of about a megabyte, which is never requested again.
#[tokio::test]
async fn refused_robots_are_remembered_by_their_refusal_and_not_by_their_report() {
    let daemon = Daemon::start(RunState::Paused).await;
    let places = vec!["/nowhere/at/all".to_owned(); 50_000];
    let mut urdf = "<robot name='r'><link name='a'>".to_owned();
    for number in 0..1000 {
        urdf += &format!("<visual><geometry><mesh filename='package://r/{number}.stl'/></geometry></visual>");
    }
    urdf += "</link><joint name='j' type='fixed'><parent link='a'/><child link='missing'/></joint></robot>";
    for number in 0..20 {
        let source = v1::DescriptionSource {
            source: Some(v1::description_source::Source::Urdf(urdf.clone().into_bytes())),
            missing: [("package://r/1.stl".to_owned(), v1::AssetSearch { places: places.clone() })].into(),
            ..Default::default()
        };
        let request = v1::SpawnEntityRequest {
            source: Some(source),
            request_id: number.to_string(),
            ..Default::default()
        };
        let refused = daemon.entities().spawn_entity(request).await.unwrap_err();
        assert_eq!(reason(&refused), "INVALID_DESCRIPTION");
    }
    let remembered = daemon.handle.remembered();
    assert!((20 * 500..20 * 4000).contains(&remembered), "{remembered} bytes");
}

//! Services without a network. Read methods do not wait for the physics thread, and refused claims are not
//! remembered as the answer to a request.

use std::collections::BTreeMap;
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream;
use glamx::DPose3;
use prost::Message;
use simd_core::Command;
use simd_core::simulation::command::{ClaimId, ClaimRequest, CreateSensor};
use simd_model::sensor::{Camera, Picture, SensorKind};
use simd_proto::methods;
use simd_proto::raw::RawCodec;
use simd_proto::v1;
use simd_proto::v1::joint_service_server::JointService;
use tonic::client::Grpc;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::{Code, Request};

use super::claims::Proven;
use super::{joint, routes};
use crate::convert::test_world;
use simd_world::SimHandle;
use simd_world::account::Account;
use simd_world::blocking_threads::BlockingThreads;
use simd_world::driver::fake_world::BlockedWorld;
use simd_world::driver::{self, Config};
use simd_world::handle::{CallContext, Caller, DaemonInfo, DaemonLimits, RunState, Transport};
use simd_world::loading::Loader;

/// Methods that change something. A method in neither list fails the test.
const WRITES: [&str; 49] = [
    "AddParameter",
    "ApplyLinkWrench",
    "CancelTrajectory",
    "ChangeConstraint",
    "ClaimJoints",
    "Control",
    "CreateConstraint",
    "CreateSensor",
    "DeleteConstraint",
    "DeleteEntity",
    "DeleteSavedState",
    "DeleteSensor",
    "FollowTrajectory",
    "ImportSavedState",
    "JoinLockstep",
    "LeaveLockstep",
    "PullLink",
    "ReleaseJoints",
    "ReloadEntity",
    "RemoveParameters",
    "ResetJoints",
    "ResetSimulation",
    "RestoreState",
    "SaveState",
    "SetCollisionFilter",
    "SetEntityState",
    "SetJointProperties",
    "SetJointTargets",
    "SetLinkProperties",
    "SetParameters",
    "SetPhysics",
    "SetSimulationState",
    "SpawnEntity",
    "SpawnEntityWithProgress",
    "StepSimulation",
    "UploadAsset",
    // Changes of drawings, not of the world.
    "AddMarkers",
    "DeleteMarkers",
    "ReportView",
    "SetCamera",
    "SetLinkColors",
    // Changes of pictures, not of the world.
    "PutPicture",
    // Changes of files.
    "DeleteRecording",
    "StartRecording",
    "StopRecording",
    "PrepareDescription",
    "ExpandXacro",
    "ValidateDescription",
    // A read that needs more of the world than is published: it asks the physics thread.
    "Rollout",
];

/// Returns requests of read methods, by name.
fn reads() -> BTreeMap<&'static str, Vec<u8>> {
    let robot = || "left".to_owned();
    let point = |x: f64, z: f64| Some(v1::Vector3 { x, y: 0.0, z });
    let link = "link_4".to_owned();
    let target = v1::Pose { position: point(0.1, 2.4), orientation: None };
    let ray = v1::Ray { from: point(0.0, 9.0), to: point(0.0, -9.0) };
    let (timeout, rate) = (1e-3, 1e3);
    let ball = || {
        let sphere = v1::query_shape::Geometry::Sphere(v1::SphereGeometry { radius: 1.0 });
        Some(v1::QueryShape { geometry: Some(sphere) })
    };
    BTreeMap::from([
        ("CastRays", v1::CastRaysRequest { rays: vec![ray], collision_mask: None }.encode_to_vec()),
        (
            "CastShape",
            v1::CastShapeRequest { shape: ball(), pose: None, translation: point(0.0, -9.0) }.encode_to_vec(),
        ),
        ("FindOverlaps", v1::FindOverlapsRequest { shape: ball(), ..Default::default() }.encode_to_vec()),
        (
            "GetClosestPoints",
            v1::GetClosestPointsRequest {
                a: Some(v1::QueryBody { robot: robot(), ..Default::default() }),
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        ("GetLinkBounds", Vec::new()),
        ("ListConstraints", v1::ListConstraintsRequest { robot: robot() }.encode_to_vec()),
        (
            "ComputeInverseDynamics",
            v1::ComputeInverseDynamicsRequest { robot: robot(), ..Default::default() }.encode_to_vec(),
        ),
        (
            "ComputeInverseKinematics",
            v1::ComputeInverseKinematicsRequest {
                robot: robot(),
                link: link.clone(),
                target: Some(target),
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        ("ExportSavedState", v1::ExportSavedStateRequest { name: "here".into() }.encode_to_vec()),
        ("GetCameras", Vec::new()),
        (
            "GetPicture",
            v1::GetPictureRequest { robot: robot(), sensor: "camera".into(), timeout, ..Default::default() }
                .encode_to_vec(),
        ),
        ("TakePicture", taken().encode_to_vec()),
        ("ListCameras", Vec::new()),
        ("NextPicture", v1::NextPictureRequest { renderer: "none".into(), timeout }.encode_to_vec()),
        ("GetMesh", v1::GetMeshRequest { sha256: "0".repeat(64), ..Default::default() }.encode_to_vec()),
        ("ListMarkers", Vec::new()),
        ("NextInput", v1::NextInputRequest { after_sequence: Some(0), timeout }.encode_to_vec()),
        ("NextView", v1::NextViewRequest { after_version: 0, timeout }.encode_to_vec()),
        ("GetAsset", v1::GetAssetRequest { sha256: "0".repeat(64), ..Default::default() }.encode_to_vec()),
        ("GetCollisionFilter", v1::GetCollisionFilterRequest { robot: robot() }.encode_to_vec()),
        ("GetContacts", Vec::new()),
        ("GetEntityInfo", v1::GetEntityInfoRequest { robot: robot() }.encode_to_vec()),
        ("GetEntityState", v1::GetEntityStateRequest { robot: robot() }.encode_to_vec()),
        (
            "GetJacobian",
            v1::GetJacobianRequest { robot: robot(), link, ..Default::default() }.encode_to_vec(),
        ),
        ("GetJointLayout", v1::GetJointLayoutRequest { robot: robot() }.encode_to_vec()),
        ("GetJointReactions", v1::GetJointReactionsRequest { robot: robot() }.encode_to_vec()),
        ("GetJointStates", Vec::new()),
        ("GetLinkPoses", Vec::new()),
        ("GetLinkProperties", v1::GetLinkPropertiesRequest { robot: robot() }.encode_to_vec()),
        ("GetLinkStates", Vec::new()),
        ("GetMassMatrix", v1::GetMassMatrixRequest { robot: robot(), configuration: None }.encode_to_vec()),
        ("GetParameters", Vec::new()),
        ("GetPhysics", Vec::new()),
        ("GetRecording", v1::GetRecordingRequest { name: "here".into() }.encode_to_vec()),
        ("GetScene", Vec::new()),
        ("GetSensorReadings", Vec::new()),
        ("GetSimulationState", Vec::new()),
        ("GetSimulatorInfo", Vec::new()),
        ("GetWorldStatistics", Vec::new()),
        ("ListClients", Vec::new()),
        ("ListTrajectories", v1::ListTrajectoriesRequest { robot: robot() }.encode_to_vec()),
        ("ListEntities", Vec::new()),
        ("ListLockstepMembers", Vec::new()),
        ("ListRecordings", Vec::new()),
        ("ListSavedStates", Vec::new()),
        ("ListSensors", v1::ListSensorsRequest { robot: robot() }.encode_to_vec()),
        ("NextEvents", v1::NextEventsRequest { after_sequence: 0, timeout }.encode_to_vec()),
        ("NextJointStates", v1::NextJointStatesRequest { timeout, ..Default::default() }.encode_to_vec()),
        ("NextParameters", v1::NextParametersRequest { after_version: 0, timeout }.encode_to_vec()),
        (
            "ReadRecording",
            v1::ReadRecordingRequest { name: "here".into(), ..Default::default() }.encode_to_vec(),
        ),
        (
            "NextSensorReadings",
            v1::NextSensorReadingsRequest {
                sensors: vec![v1::SensorCursor { robot: robot(), sensor: "base".into(), after_sequence: 0 }],
                timeout,
            }
            .encode_to_vec(),
        ),
        ("WatchEvents", Vec::new()),
        ("WatchJointStates", v1::WatchJointStatesRequest { rate, ..Default::default() }.encode_to_vec()),
        ("WatchParameters", Vec::new()),
        (
            "WatchSensorReadings",
            v1::WatchSensorReadingsRequest { rate, ..Default::default() }.encode_to_vec(),
        ),
    ])
}

/// Returns a view from the origin along -z, with a right angle.
fn taken() -> v1::TakePictureRequest {
    let (mut view, mut projection) = (vec![0.0; 16], vec![0.0; 16]);
    for index in [0, 5, 10, 15] {
        view[index] = 1.0;
    }
    (projection[0], projection[5], projection[10], projection[11], projection[14]) =
        (1.0, 1.0, -1.5, -1.0, -2.5);
    v1::TakePictureRequest { view, projection, width: 4, height: 4, timeout: 1e-3, ..Default::default() }
}

fn sensor(robot: &str, name: &str) -> CreateSensor {
    CreateSensor {
        robot: robot.into(),
        name: name.into(),
        link: String::new(),
        joint: String::new(),
        pose: DPose3::IDENTITY,
        rate: None,
        kind: SensorKind::LinkState,
        noise: Vec::new(),
        seed: None,
    }
}

fn camera(robot: &str) -> CreateSensor {
    let kind = SensorKind::Camera(Camera {
        picture: Picture::Color,
        width: 4,
        height: 4,
        horizontal_field_of_view: 1.0,
        near: 0.1,
        far: 10.0,
    });
    CreateSensor { kind, ..sensor(robot, "camera") }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_method_that_only_reads_answers_while_the_physics_thread_is_held_up() {
    let mut world = test_world::simulation();
    world.apply(&Command::SaveState { name: "here".into() }).unwrap();
    world.apply(&Command::CreateSensor(Box::new(sensor("left", "base")))).unwrap();
    world.apply(&Command::CreateSensor(Box::new(camera("left")))).unwrap();
    let (world, has_begun, let_go) = BlockedWorld::new(world);
    let driver = driver::start(world, Config::default()).unwrap();
    let limits = DaemonLimits::default();
    let info = DaemonInfo { name: "test".into(), version: "0", limits };
    let handle = SimHandle::new(
        driver,
        Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap(),
        info,
    );
    tokio::task::spawn_blocking(move || has_begun.recv().unwrap()).await.unwrap();
    assert!(handle.statistics().step_duration > 0.0, "the step that is going on shows");

    let mut reads = reads();
    for (_service, name, method) in methods::all() {
        let Some(request) = reads.remove(name) else {
            assert!(WRITES.contains(&name), "is {name} read only?");
            continue;
        };
        let call = async {
            let mut services = Grpc::new(routes(&handle, Transport::Grpc));
            services.ready().await.unwrap();
            let request = Request::new(stream::iter([Bytes::from(request)]));
            let path = PathAndQuery::from_static(&method.path);
            let mut answers = services.streaming(request, path, RawCodec).await?.into_inner();
            // Only the first message can be watched so far.
            if matches!(name, "WatchEvents" | "WatchSensorReadings") {
                Ok(None)
            } else {
                answers.message().await
            }
        };
        // Longer than any answer takes: a call that waits for the physics thread would never end.
        let answer = tokio::time::timeout(Duration::from_secs(60), call).await;
        let answer = answer.unwrap_or_else(|_| panic!("{name} waits for the physics thread"));
        match answer {
            Ok(_) => {}
            // The robots were made without a description, which the export reports.
            Err(status) if name == "ExportSavedState" => {
                assert!(status.message().contains("test arm"), "{status}")
            }
            // No folder is set for recordings.
            Err(status) if name.contains("Recording") => assert_eq!(status.code(), Code::FailedPrecondition),
            // No renderer exists, or the only one called NextPicture and does not draw.
            Err(status) if name.ends_with("Picture") => {
                assert!(matches!(status.code(), Code::FailedPrecondition | Code::Aborted), "{status}")
            }
            Err(status) if matches!(name, "GetAsset" | "GetMesh") => {
                assert_eq!(status.code(), Code::FailedPrecondition)
            }
            Err(status) => panic!("{name}: {status}"),
        }
    }
    assert!(reads.is_empty(), "{:?} are not methods", reads.keys());
    assert_eq!(handle.newest().state.at.step, 0, "the step is still going on");
    drop(let_go);
    handle.end_driver();
    handle.driver_ended().cancelled().await;
}

/// Over Zenoh any session can read a request and send it again under the same name, even before its author
/// does.
#[tokio::test]
async fn a_request_without_its_proof_is_not_remembered_for_the_one_who_has_it() {
    let config = Config { state: RunState::Paused, ..Config::default() };
    let driver = driver::start(test_world::simulation(), config).unwrap();
    let limits = DaemonLimits::default();
    let info = DaemonInfo { name: "test".into(), version: "0", limits };
    let handle = SimHandle::new(
        driver,
        Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap(),
        info,
    );
    let service = joint::Service::new(handle.clone());
    let request = ClaimRequest { holder: "me".into(), ..ClaimRequest::default() };
    let (secret, _done) = handle.claim(request, Duration::from_secs(60), None).await.unwrap();
    let claim = handle.claim_of(&secret).unwrap();
    let caller = Caller::said("me", Transport::Zenoh);
    let call = CallContext { caller, transport: Transport::Zenoh, ..CallContext::of(Account::Unknown) };
    let named = |proven: Proven, message: v1::SetJointTargetsRequest| {
        let mut request = Request::new(message);
        request.extensions_mut().insert(call.clone());
        request.extensions_mut().insert(proven);
        request
    };
    let message = |request_id: &str| v1::SetJointTargetsRequest {
        robots: vec![v1::RobotTargets { robot: "left".into(), ..Default::default() }],
        claim: claim.0.to_string(),
        request_id: request_id.into(),
        ..Default::default()
    };
    for (id, unproven) in [
        ("a", Proven::Nothing),
        ("b", Proven::Claim(ClaimId(claim.0 + 1))),
        ("c", Proven::Refused(simd_world::handle::Unproven::Replayed { last: 7 })),
    ] {
        assert!(service.set_joint_targets(named(unproven, message(id))).await.is_err());
        let set = service.set_joint_targets(named(Proven::Claim(claim), message(id))).await;
        let stamp = set.unwrap_or_else(|status| panic!("{unproven:?} was remembered: {status}")).into_inner();
        // The answer is repeated, whatever is proven by then.
        let again = service.set_joint_targets(named(unproven, message(id))).await.unwrap().into_inner();
        assert_eq!(again, stamp);
    }
    let release = |request_id: &str| v1::ReleaseJointsRequest {
        claim: claim.0.to_string(),
        request_id: request_id.into(),
    };
    let mut stolen = Request::new(release("d"));
    stolen.extensions_mut().insert(call.clone());
    stolen.extensions_mut().insert(Proven::Nothing);
    assert!(service.release_joints(stolen).await.is_err());
    let mut own = Request::new(release("d"));
    own.extensions_mut().insert(call.clone());
    own.extensions_mut().insert(Proven::Claim(claim));
    service.release_joints(own).await.unwrap();
    handle.end_driver();
    handle.driver_ended().cancelled().await;
}

//! Permissions of a token for some robots: all methods of the schema against one table, which the documents
//! show.

use bytes::Bytes;
use prost::Message;
use simd_client::access::{Role, TOKEN_HEADER, bearer};
use simd_client::proto::NameTakenPolicy;
use simd_client::{Client, Target, joint_target, robot_targets, slide};
use simd_proto::methods::{self, Method};
use simd_proto::raw::RawCodec;
use simd_proto::v1;
use simd_tests::process::{repository, soon};
use simd_world::access::{Concern, concern_of, role_of};
use tonic::codegen::http::uri::PathAndQuery;
use tonic::{Request, Status};
use tonic_types::StatusExt as _;

use crate::security::{Guarded, guarded, of, of_arm, options};

/// Returns a daemon with the robots "arm" and "other", and a slider that moves "other".
async fn daemon() -> (Guarded, Client) {
    let guarded = guarded(|_, _| {}).await;
    let admin = Client::connect_with(&guarded.grpc(), options(Some(of(Role::Admin)), None)).await.unwrap();
    for robot in ["arm", "other"] {
        crate::load_arm(&admin, robot).await;
    }
    let added = admin.add_bound_slider("of other", (0.0, 1.0), 0.0, binding(), NameTakenPolicy::Refuse).await;
    added.unwrap();
    (guarded, admin)
}

fn binding() -> v1::JointBinding {
    v1::JointBinding { robot: "other".into(), joint: "shoulder".into(), ..Default::default() }
}

/// Returns the first answer to one message, with a token.
async fn call(guarded: &Guarded, path: &'static str, token: &str, message: Vec<u8>) -> Result<Bytes, Status> {
    let endpoint = tonic::transport::Endpoint::from_shared(guarded.grpc()).unwrap();
    let mut grpc = tonic::client::Grpc::new(endpoint.connect().await.unwrap());
    grpc.ready().await.unwrap();
    let mut request = Request::new(tokio_stream::iter([Bytes::from(message)]));
    request.metadata_mut().insert(TOKEN_HEADER, bearer(token).parse().unwrap());
    let mut answers = grpc.streaming(request, PathAndQuery::from_static(path), RawCodec).await?.into_inner();
    let mut answer = answers.message().await?.unwrap_or_default();
    // Progress comes before the result.
    while path.ends_with("WithProgress")
        && let Some(next) = answers.message().await?
    {
        answer = next;
    }
    Ok(answer)
}

fn is_not_allowed(answer: &Result<Bytes, Status>) -> bool {
    let reason = |status: &Status| status.get_details_error_info().map(|info| info.reason);
    answer.as_ref().err().and_then(reason).is_some_and(|reason| reason == "ROBOT_NOT_ALLOWED")
}

/// Returns a request of a method that names robots, with the robot "other" in it.
fn naming_other(method: &str) -> Vec<u8> {
    let other = || "other".to_owned();
    let shoulder = || "shoulder".to_owned();
    let urdf = || {
        let urdf = b"<robot name='a'><link name='b'/></robot>".to_vec();
        let source = Some(v1::description_source::Source::Urdf(urdf));
        v1::DescriptionSource { source, ..Default::default() }
    };
    let spawn = || v1::SpawnEntityRequest { name: other(), source: Some(urdf()), ..Default::default() };
    let x = || v1::Vector3 { x: 0.1, y: 0.0, z: 0.0 };
    let imu = v1::sensor::Kind::Imu(v1::ImuSensor::default());
    match method {
        "CreateConstraint" => v1::CreateConstraintRequest {
            name: "weld".into(),
            kind: v1::ConstraintKind::Weld.into(),
            parent: Some(v1::ConstraintEnd { robot: other(), ..Default::default() }),
            ..Default::default()
        }
        .encode_to_vec(),
        "ApplyLinkWrench" => {
            let wrench = v1::Wrench { force: Some(x()), ..Default::default() };
            let (robot, link) = (other(), "base_link".into());
            v1::ApplyLinkWrenchRequest { robot, link, wrench: Some(wrench), ..Default::default() }
                .encode_to_vec()
        }
        "PullLink" => {
            let (robot, link, target) = (other(), "base_link".into(), Some(x()));
            v1::PullLinkRequest { robot, link, target, ..Default::default() }.encode_to_vec()
        }
        "SetEntityState" => {
            let twist = Some(v1::Twist { linear: Some(x()), angular: Some(x()) });
            v1::SetEntityStateRequest { robot: other(), twist, ..Default::default() }.encode_to_vec()
        }
        "SpawnEntity" => spawn().encode_to_vec(),
        "SpawnEntityWithProgress" => {
            v1::SpawnEntityWithProgressRequest { spawn: Some(spawn()) }.encode_to_vec()
        }
        "ReloadEntity" => {
            let (robot, source) = (other(), Some(urdf()));
            v1::ReloadEntityRequest { robot, source, ..Default::default() }.encode_to_vec()
        }
        "DeleteEntity" => v1::DeleteEntityRequest { robot: other(), ..Default::default() }.encode_to_vec(),
        "SetLinkProperties" => {
            let links = vec![v1::LinkProperties {
                link: "base_link".into(),
                friction: Some(1.0),
                ..Default::default()
            }];
            v1::SetLinkPropertiesRequest { robot: other(), links, ..Default::default() }.encode_to_vec()
        }
        "SetCollisionFilter" => {
            let (robot, self_collision) = (other(), Some(true));
            v1::SetCollisionFilterRequest { robot, self_collision, ..Default::default() }.encode_to_vec()
        }
        "SetJointTargets" | "Control" => {
            let robots = vec![robot_targets("other", [joint_target("shoulder", Target::position(0.1))])];
            match method {
                "Control" => v1::ControlRequest { robots, ..Default::default() }.encode_to_vec(),
                _ => v1::SetJointTargetsRequest { robots, ..Default::default() }.encode_to_vec(),
            }
        }
        "FollowTrajectory" => {
            let point = v1::TrajectoryPoint { time: 1.0, positions: vec![0.1], ..Default::default() };
            let (robot, joints, points) = (other(), vec![shoulder()], vec![point]);
            v1::FollowTrajectoryRequest { robot, joints, points, ..Default::default() }.encode_to_vec()
        }
        "CancelTrajectory" => {
            v1::CancelTrajectoryRequest { robot: other(), ..Default::default() }.encode_to_vec()
        }
        "ResetJoints" => {
            let robots = vec![v1::RobotReset { robot: other(), ..Default::default() }];
            v1::ResetJointsRequest { robots, ..Default::default() }.encode_to_vec()
        }
        "SetJointProperties" => {
            let damped = v1::JointProperties { joint: shoulder(), damping: Some(1.0), ..Default::default() };
            let (robot, joints) = (other(), vec![damped]);
            v1::SetJointPropertiesRequest { robot, joints, ..Default::default() }.encode_to_vec()
        }
        "ClaimJoints" => {
            let selections = vec![v1::JointSelection { robot: other(), ..Default::default() }];
            v1::ClaimJointsRequest { selections, holder: "me".into(), lease: 1.0, ..Default::default() }
                .encode_to_vec()
        }
        "AddParameter" => {
            let slider = v1::Slider { minimum: 0.0, maximum: 1.0, value: 0.0 };
            let parameter = v1::Parameter {
                name: "mine".into(),
                joint: Some(binding()),
                kind: Some(v1::parameter::Kind::Slider(slider)),
                ..Default::default()
            };
            v1::AddParameterRequest { parameter: Some(parameter), ..Default::default() }.encode_to_vec()
        }
        "SetParameters" => {
            let changes = vec![slide("of other", 0.5)];
            v1::SetParametersRequest { changes, ..Default::default() }.encode_to_vec()
        }
        "CreateSensor" => {
            let (robot, name, kind) = (other(), "imu".into(), Some(imu));
            let sensor = v1::Sensor { robot, name, kind, link: "base_link".into(), ..Default::default() };
            v1::CreateSensorRequest { sensor: Some(sensor), ..Default::default() }.encode_to_vec()
        }
        "DeleteSensor" => {
            let (robot, name) = (other(), "imu".into());
            v1::DeleteSensorRequest { robot, name, ..Default::default() }.encode_to_vec()
        }
        "AddMarkers" => {
            let text = v1::MarkerText { text: "STOP".into(), size: 0.1, ..Default::default() };
            let shape = Some(v1::marker::Shape::Text(text));
            let markers = vec![v1::Marker { shape, robot: other(), ..Default::default() }];
            v1::AddMarkersRequest { markers, ..Default::default() }.encode_to_vec()
        }
        "SetLinkColors" => {
            let colors =
                vec![v1::LinkColor { robot: other(), link: "base_link".into(), ..Default::default() }];
            v1::SetLinkColorsRequest { colors, ..Default::default() }.encode_to_vec()
        }
        _ => panic!("{method} names robots: add a request of it that names \"other\""),
    }
}

/// Methods that wait for an event are not called with an empty request.
fn answers_at_once(method: &Method) -> bool {
    !method.gives_many && !["/NextEvents", "/NextParameters"].iter().any(|name| method.path.ends_with(name))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_for_one_robot_is_held_to_it_by_every_method() {
    let (guarded, _admin) = daemon().await;
    for (service, name, method) in methods::all() {
        let concern = concern_of(service, name);
        let message = match concern {
            Concern::Robots => naming_other(name),
            Concern::Nothing if !answers_at_once(method) => continue,
            // Has a separate test.
            Concern::Camera => continue,
            Concern::Nothing | Concern::Pages | Concern::World => Vec::new(),
        };
        let answer = soon(&method.path, call(&guarded, &method.path, &of_arm(), message)).await;
        if name == "Control" {
            // A stream continues, with an error in it.
            let answer = v1::ControlResponse::decode(answer.unwrap()).unwrap();
            let refusal = answer.refusal.unwrap();
            assert_eq!(refusal.reason(), v1::ErrorReason::RobotNotAllowed);
            continue;
        }
        let is_free = concern == Concern::Nothing;
        assert_eq!(is_not_allowed(&answer), !is_free, "{} concerns {concern}: {answer:?}", method.path);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_for_one_robot_draws_the_pictures_of_no_other() {
    let (guarded, admin) = daemon().await;
    let camera = v1::CameraSensor {
        picture: v1::Picture::Color.into(),
        width: 8,
        height: 8,
        horizontal_field_of_view: 1.0,
        near: 0.1,
        far: 10.0,
    };
    for robot in ["arm", "other"] {
        let kind = Some(v1::sensor::Kind::Camera(camera));
        let sensor = v1::Sensor {
            robot: robot.into(),
            name: "eye".into(),
            link: "base_link".into(),
            kind,
            ..Default::default()
        };
        admin.create_sensor(sensor).await.unwrap();
    }
    let next = |token: String, timeout: f64| {
        let request = v1::NextPictureRequest { renderer: "r".into(), timeout };
        let guarded = &guarded;
        async move {
            let path = "/simd.v1.CameraService/NextPicture";
            let answer = call(guarded, path, &token, request.encode_to_vec()).await.unwrap();
            v1::NextPictureResponse::decode(answer).unwrap().task
        }
    };
    // Renderers exist.
    assert!(next(of_arm(), 0.01).await.is_none());
    let token = of(Role::Admin);
    let wanted = |robot: &'static str| {
        let (robot, sensor) = (robot.into(), "eye".into());
        let request = v1::GetPictureRequest { robot, sensor, timeout: 30.0, ..Default::default() };
        call(&guarded, "/simd.v1.CameraService/GetPicture", &token, request.encode_to_vec())
    };
    let draws = async {
        let of_other = next(of(Role::Admin), 30.0).await.unwrap();
        assert_eq!(of_other.robot, "other");
        // The task is not for the other token, whatever name its client gives.
        let put = v1::PutPictureRequest {
            id: of_other.id,
            renderer: "r".into(),
            error: "it says".into(),
            ..Default::default()
        };
        let path = "/simd.v1.CameraService/PutPicture";
        let answer = call(&guarded, path, &of_arm(), put.encode_to_vec()).await.unwrap();
        assert!(!v1::PutPictureResponse::decode(answer).unwrap().accepted);
        assert!(next(of_arm(), 0.01).await.is_none());
    };
    tokio::select! {
        drawn = wanted("other") => panic!("no renderer drew it: {drawn:?}"),
        () = draws => {}
    }
    let draws = async { next(of_arm(), 30.0).await.unwrap() };
    tokio::select! {
        drawn = wanted("arm") => panic!("no renderer drew it: {drawn:?}"),
        task = draws => assert_eq!(task.robot, "arm"),
    }
}

/// `docs/security.md` shows the table.
#[test]
fn the_documents_show_what_each_method_asks_for_and_concerns() {
    let mut rows: Vec<(&str, Role, Concern, Vec<String>)> = Vec::new();
    for (service, name, _) in methods::all() {
        let (role, concern) = (role_of(service, name), concern_of(service, name));
        let is_row = |row: &&mut (&str, Role, Concern, Vec<String>)| {
            row.0 == service && (row.1, row.2) == (role, concern)
        };
        match rows.iter_mut().find(is_row) {
            Some((.., names)) => names.push(format!("`{name}`")),
            None => rows.push((service, role, concern, vec![format!("`{name}`")])),
        }
    }
    rows.sort_by_key(|(service, role, concern, _)| (*service, *role, *concern));
    let mut table = "| service | role | concerns | methods |\n|---|---|---|---|\n".to_owned();
    for (service, role, concern, names) in rows {
        let service = service.trim_end_matches("Service");
        table += &format!("| {service} | `{role}` | {concern} | {} |\n", names.join(", "));
    }
    let document = std::fs::read_to_string(repository().join("docs/security.md")).unwrap();
    assert!(document.contains(&table), "docs/security.md must have this table:\n{table}");
}

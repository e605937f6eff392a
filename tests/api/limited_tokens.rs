//! Pictures that a token for some robots may draw.

use prost::Message;
use simd_client::access::Role;
use simd_proto::v1;

use crate::method_walk::{call, channel, two_robots};
use crate::security::{of, of_arm};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_for_one_robot_draws_the_pictures_of_no_other() {
    let (guarded, admin) = two_robots().await;
    let channel = channel(&guarded).await;
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
        let channel = channel.clone();
        async move {
            let path = "/simd.v1.CameraService/NextPicture";
            let answer = call(&channel, path, &token, request.encode_to_vec()).await.unwrap();
            v1::NextPictureResponse::decode(answer).unwrap().task
        }
    };
    // Renderers exist.
    assert!(next(of_arm(), 0.01).await.is_none());
    let token = of(Role::Admin);
    let wanted = |robot: &'static str| {
        let (robot, sensor) = (robot.into(), "eye".into());
        let request = v1::GetPictureRequest { robot, sensor, timeout: 30.0, ..Default::default() };
        let (channel, token) = (channel.clone(), token.clone());
        async move {
            let path = "/simd.v1.CameraService/GetPicture";
            call(&channel, path, &token, request.encode_to_vec()).await
        }
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
        let answer = call(&channel, path, &of_arm(), put.encode_to_vec()).await.unwrap();
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

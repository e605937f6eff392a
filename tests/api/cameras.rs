//! Pictures of the world, requested by clients and drawn by renderers. The renderers are test code: they draw
//! the step number of the state.

use std::time::Duration;

use prost::Message;
use simd_client::proto::{
    self, CameraPicture, ErrorReason, PicturePlane, PictureTask, PlaneCompression, PutPictureRequest, sensor,
};
use simd_client::{Client, plane_bytes};
use simd_tests::daemon::{Daemon, Via};
use simd_tests::network;
use simd_tests::process::soon;
use zenoh::handlers::FifoChannel;

use crate::{arm, load_arm, over_every_transport};

/// Longer than anything takes here.
const LONG: Duration = Duration::from_secs(60);
const NOW: Duration = Duration::ZERO;

/// Returns a camera of 4 x 3 pixels on the arm's root link.
pub(crate) fn camera(name: &str, rate: Option<f64>) -> proto::Sensor {
    let picture = proto::Picture::ColorAndDepth.into();
    let (width, height, horizontal_field_of_view, near, far) = (4, 3, 1.2, 0.1, 50.0);
    let kind = proto::CameraSensor { picture, width, height, horizontal_field_of_view, near, far };
    proto::Sensor {
        robot: "arm".into(),
        name: name.into(),
        rate,
        kind: Some(sensor::Kind::Camera(kind)),
        ..Default::default()
    }
}

/// Returns a paused world with the arm, a camera "eye" on it and a renderer "one".
async fn eye(via: Via) -> Daemon {
    let daemon = arm(via).await;
    daemon.client.create_sensor(camera("eye", Some(100.0))).await.unwrap();
    assert!(daemon.client.next_picture("one", NOW).await.unwrap().is_none());
    daemon
}

fn plane(data: Vec<u8>) -> Option<PicturePlane> {
    Some(PicturePlane { compression: PlaneCompression::Unspecified.into(), data })
}

/// Returns the number of steps in each pixel.
fn drawn(task: &PictureTask, renderer: &str) -> PutPictureRequest {
    let pixels = (task.width * task.height) as usize;
    let step = task.stamp.as_ref().unwrap().step;
    let planes = task.planes.unwrap();
    PutPictureRequest {
        id: task.id,
        renderer: renderer.into(),
        color: planes.color.then(|| plane(vec![step as u8; 3 * pixels])).flatten(),
        depth: planes.depth.then(|| plane((step as f32).to_le_bytes().repeat(pixels))).flatten(),
        segmentation: planes
            .segmentation
            .then(|| plane((step as u32).to_le_bytes().repeat(pixels)))
            .flatten(),
        error: String::new(),
    }
}

/// Waits for a task, and answers it.
pub(crate) async fn draw(client: &Client, renderer: &str) -> PictureTask {
    let task = client.next_picture(renderer, LONG).await.unwrap().unwrap();
    assert!(client.put_picture(drawn(&task, renderer)).await.unwrap());
    task
}

fn depth(picture: &CameraPicture) -> f32 {
    let bytes = plane_bytes(picture, picture.depth.as_ref().unwrap(), 4).unwrap();
    let numbers: Vec<f32> =
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    assert_eq!(numbers.len(), 12);
    assert!(numbers.iter().all(|number| *number == numbers[0]), "{numbers:?}");
    numbers[0]
}

/// Looks from the origin along -z, with a right angle of view, from 1 m to 5 m.
fn from_above(width: u32, height: u32) -> proto::TakePictureRequest {
    let (mut view, mut projection) = (vec![0.0; 16], vec![0.0; 16]);
    for index in [0, 5, 10, 15] {
        view[index] = 1.0;
    }
    for (index, number) in [(0, 1.0), (5, 1.0), (10, -1.5), (11, -1.0), (14, -2.5)] {
        projection[index] = number;
    }
    proto::TakePictureRequest { view, projection, width, height, ..Default::default() }
}

async fn a_picture_is_of_the_step_at_which_it_was_asked_for(via: Via) {
    let daemon = eye(via).await;
    let client = &daemon.client;
    for step in [3, 4] {
        let stepped = client.step(if step == 3 { 3 } else { 1 }).await.unwrap();
        let (picture, task) = tokio::join!(client.picture("arm", "eye"), draw(client, "one"));
        let picture = picture.unwrap();
        assert_eq!((depth(&picture), picture.stamp.as_ref().unwrap().step), (step as f32, step));
        assert_eq!(task.stamp, picture.stamp);
        assert_eq!((picture.width, picture.height, picture.renderer.as_str()), (4, 3, "one"));
        assert!(picture.color.is_some() && picture.segmentation.is_none());
        assert_eq!((task.robot.as_str(), task.sensor.as_str()), ("arm", "eye"));
        // The task has all that a renderer needs: the pose of each link.
        let poses = client.link_poses(&["arm"]).await.unwrap();
        assert_eq!(task.robots, poses.robots, "{stepped:?}");
        let links = task.robots[0].poses.len() as u32 / 7;
        assert_eq!(picture.robots, [proto::PictureRobot { robot: "arm".into(), first_link: 1, links }]);
        // The world stands still: nothing is drawn again, not even without a name.
        let again = client.picture("arm", "").await.unwrap();
        assert_eq!(again.sequence, picture.sequence);
    }
    let listed = client.list_cameras().await.unwrap();
    let camera = &listed.cameras[0];
    assert_eq!((camera.sensor.as_str(), camera.renderer.as_str(), camera.drawn), ("eye", "one", 0));
    assert_eq!((camera.newest.as_ref().unwrap().step, camera.rate), (4, Some(100.0)));
    let focal = 2.0 / 0.6_f64.tan();
    let numbers = camera.intrinsics.unwrap();
    assert!((numbers.fx - focal).abs() < 1e-12 && numbers.cx == 1.5 && numbers.cy == 1.0, "{numbers:?}");
    assert_eq!(listed.renderers[0].drawn, 2);
}

async fn a_picture_is_taken_from_any_point_of_view(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.step(7).await.unwrap();
    client.next_picture("one", NOW).await.unwrap();
    let planes = Some(proto::PicturePlanes { color: false, depth: true, segmentation: true });
    let request = proto::TakePictureRequest { planes, ..from_above(4, 3) };
    let (picture, task) = tokio::join!(client.take_picture(request.clone()), draw(client, "one"));
    let picture = picture.unwrap();
    assert_eq!((depth(&picture), picture.stamp.unwrap().step), (7.0, 7));
    assert!(picture.color.is_none() && picture.segmentation.is_some());
    assert_eq!((&task.view, &task.projection, task.intrinsics), (&request.view, &request.projection, None));
    assert!((task.near - 1.0).abs() < 1e-12 && (task.far - 5.0).abs() < 1e-12, "{task:?}");
    assert!(task.robot.is_empty() && task.light.is_some() && task.background.is_some());
    for (request, field) in [
        (from_above(0, 3), "width"),
        (from_above(4, 4_097), "height"),
        (proto::TakePictureRequest { view: vec![1.0; 15], ..request.clone() }, "view"),
        (proto::TakePictureRequest { projection: vec![f64::NAN; 16], ..request.clone() }, "projection"),
        (proto::TakePictureRequest { timeout: 1e9, ..request.clone() }, "timeout"),
    ] {
        let refused = client.take_picture(request).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{field}: {refused}");
        assert!(refused.to_string().contains(field), "{field}: {refused}");
    }
}

async fn a_world_that_nothing_draws_says_so_at_once(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let none = client.picture("arm", "").await.unwrap_err();
    assert!(none.to_string().contains("has no camera"), "{none}");
    for number in 0..10 {
        client.create_sensor(camera(&format!("eye_{number}"), None)).await.unwrap();
    }
    client.step(50).await.unwrap();
    for asked in [client.picture("arm", "eye_3").await, client.take_picture(from_above(4, 3)).await] {
        let refused = asked.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::NoRenderer), "{refused}");
        assert!(refused.to_string().contains("simd-camera --endpoint"), "{refused}");
    }
    let next = client.next_camera_picture("arm", "eye_3", 0).await.unwrap_err();
    assert_eq!(next.reason(), Some(ErrorReason::NoRenderer), "{next}");
    let listed = client.list_cameras().await.unwrap();
    assert_eq!((listed.cameras.len(), listed.renderers.len()), (10, 0));
    assert!(listed.cameras.iter().all(|camera| camera.newest.is_none()));
    let unknown = client.picture("arm", "nose").await.unwrap_err();
    assert_eq!(unknown.reason(), Some(ErrorReason::SensorNotFound), "{unknown}");
    let several = client.picture("arm", "").await.unwrap_err();
    assert!(several.to_string().contains("10 cameras"), "{several}");
    let none = client.picture("leg", "").await.unwrap_err();
    assert_eq!(none.reason(), Some(ErrorReason::RobotNotFound), "{none}");
}

async fn an_undrawn_picture_goes_to_another_renderer(via: Via) {
    let drawing = Duration::from_millis(200);
    let daemon = Daemon::start_via(via, |config| {
        config.driver.state = simd_world::handle::RunState::Paused;
        config.limits.drawing_time = drawing;
    })
    .await;
    let client = &daemon.client;
    load_arm(client, "arm").await;
    client.create_sensor(camera("eye", None)).await.unwrap();
    client.next_picture("dead", NOW).await.unwrap();
    let other = async {
        let lost = client.next_picture("dead", LONG).await.unwrap().unwrap();
        assert!(lost.time_left <= drawing.as_secs_f64());
        (lost, draw(client, "alive").await)
    };
    let (picture, (lost, task)) = tokio::join!(client.picture("arm", "eye"), other);
    assert_eq!((picture.unwrap().renderer.as_str(), task.id), ("alive", lost.id));
    // A late picture is not an error and changes nothing.
    assert!(!client.put_picture(drawn(&lost, "dead")).await.unwrap());
    let renderers = client.list_cameras().await.unwrap().renderers;
    let failed: Vec<_> = renderers.iter().map(|of| (of.name.as_str(), of.drawn, of.failed)).collect();
    assert_eq!(failed, [("alive", 1, 0), ("dead", 0, 1)]);
}

async fn renderers_share_what_is_to_be_drawn(via: Via) {
    let daemon = eye(via).await;
    let client = &daemon.client;
    client.create_sensor(camera("other", None)).await.unwrap();
    let one = client.picture("arm", "eye");
    let other = client.picture("arm", "other");
    // Each has one of the two before either is answered.
    let renderers = async {
        let first = client.next_picture("one", LONG).await.unwrap().unwrap();
        let second = client.next_picture("two", LONG).await.unwrap().unwrap();
        for (task, renderer) in [(&first, "one"), (&second, "two")] {
            assert!(client.put_picture(drawn(task, renderer)).await.unwrap());
        }
        [first.sensor, second.sensor]
    };
    let (one, other, mut sensors) = tokio::join!(one, other, renderers);
    let mut drew = [one.unwrap().renderer, other.unwrap().renderer];
    drew.sort();
    sensors.sort();
    assert_eq!((drew, sensors), (["one", "two"].map(String::from), ["eye", "other"].map(String::from)));
}

async fn a_picture_that_is_not_what_the_task_asks_for_is_refused(via: Via) {
    let daemon = eye(via).await;
    let client = &daemon.client;
    let liar = async {
        let task = client.next_picture("one", LONG).await.unwrap().unwrap();
        let good = drawn(&task, "one");
        // A million zeros in a kilobyte.
        let bomb = |bytes: usize| {
            let compression = PlaneCompression::Zlib.into();
            Some(PicturePlane { compression, data: zeros(bytes) })
        };
        for (bad, field) in [
            (PutPictureRequest { color: plane(vec![0; 35]), ..good.clone() }, "color"),
            (PutPictureRequest { depth: plane(vec![0; 52]), ..good.clone() }, "depth"),
            (PutPictureRequest { depth: None, ..good.clone() }, "depth"),
            (PutPictureRequest { segmentation: plane(vec![0; 48]), ..good.clone() }, "segmentation"),
            (PutPictureRequest { color: bomb(1 << 20), ..good.clone() }, "color"),
            (PutPictureRequest { color: bomb(35), ..good.clone() }, "color"),
            (
                PutPictureRequest {
                    color: Some(PicturePlane {
                        compression: PlaneCompression::Zlib.into(),
                        data: vec![7; 36],
                    }),
                    ..good.clone()
                },
                "color",
            ),
        ] {
            let refused = client.put_picture(bad).await.unwrap_err();
            assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{field}: {refused}");
            assert!(refused.to_string().contains(field), "{field}: {refused}");
        }
        assert!(!client.put_picture(drawn(&task, "two")).await.unwrap(), "it is another's task");
        let packed = PutPictureRequest { color: bomb(36), ..good };
        assert!(client.put_picture(packed).await.unwrap());
    };
    let (picture, ()) = tokio::join!(client.picture("arm", "eye"), liar);
    let picture = picture.unwrap();
    assert_eq!(plane_bytes(&picture, picture.color.as_ref().unwrap(), 3).unwrap(), [0; 36]);
    client.step(1).await.unwrap();
    let blind = async {
        let task = client.next_picture("one", LONG).await.unwrap().unwrap();
        let error = "robot \"arm\" was reloaded meanwhile".to_owned();
        let put = PutPictureRequest { id: task.id, renderer: "one".into(), error, ..Default::default() };
        assert!(client.put_picture(put).await.unwrap());
    };
    let (refused, ()) = tokio::join!(client.picture("arm", "eye"), blind);
    let refused = refused.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::PictureFailed), "{refused}");
    assert!(refused.to_string().contains("renderer one says: robot \"arm\" was reloaded"), "{refused}");
}

/// Returns zeros compressed as zlib does it, with its rule for repeated bytes.
fn zeros(count: usize) -> Vec<u8> {
    use std::io::Write as _;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(&vec![0; count]).unwrap();
    encoder.finish().unwrap()
}

async fn pictures_that_are_waited_for_are_bounded(via: Via) {
    let daemon = Daemon::start_via(via, |config| {
        config.driver.state = simd_world::handle::RunState::Paused;
        config.limits.waiting_pictures = 1;
        config.limits.picture_bytes = 1 << 20;
    })
    .await;
    let client = &daemon.client;
    client.next_picture("one", NOW).await.unwrap();
    let short = proto::TakePictureRequest { timeout: 0.05, ..from_above(4, 3) };
    let late = client.take_picture(short).await.unwrap_err();
    assert_eq!(late.reason(), Some(ErrorReason::PictureTimeout), "{late}");
    // A cancelled request no longer takes up a place.
    let second = async {
        let task = client.next_picture("one", LONG).await.unwrap().unwrap();
        let refused = client.take_picture(from_above(4, 3)).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded), "{refused}");
        client.put_picture(drawn(&task, "one")).await.unwrap();
    };
    let (first, ()) = tokio::join!(client.take_picture(from_above(4, 3)), second);
    first.unwrap();
    let large = client.take_picture(from_above(4_096, 4_096)).await.unwrap_err();
    assert_eq!(large.reason(), Some(ErrorReason::LimitExceeded), "{large}");
}

async fn a_camera_that_is_followed_has_pictures_at_its_rate(via: Via) {
    let daemon = eye(via).await;
    let client = &daemon.client;
    let mut after = 0;
    for step in [10, 20, 30] {
        let renderer = async {
            client.step(10).await.unwrap();
            draw(client, "one").await
        };
        let (picture, task) = if after == 0 {
            // The watch begins before the world is stepped: the first call does not wait for an existing
            // picture.
            let followed = client.get_picture(proto::GetPictureRequest {
                robot: "arm".into(),
                sensor: "eye".into(),
                moment: proto::PictureMoment::Next.into(),
                timeout: 0.05,
                ..Default::default()
            });
            let none = followed.await.unwrap_err();
            assert_eq!(none.reason(), Some(ErrorReason::PictureTimeout), "{none}");
            tokio::join!(client.next_camera_picture("arm", "eye", after), renderer)
        } else {
            tokio::join!(client.next_camera_picture("arm", "eye", after), renderer)
        };
        let picture = picture.unwrap();
        assert_eq!((depth(&picture), task.stamp.unwrap().step), (step as f32, step));
        after = picture.sequence;
    }
    let camera = &client.list_cameras().await.unwrap().cameras[0];
    assert!(camera.followed);
    assert_eq!((camera.drawn, camera.missed), (3, 0));
    // The newest wins: of five pictures that were due while none was drawn, the last is drawn.
    client.step(50).await.unwrap();
    let task = loop {
        let task = client.next_picture("one", LONG).await.unwrap().unwrap();
        if task.stamp.as_ref().unwrap().step == 80 {
            break task;
        }
        // One that was handed out before the newer ones were due.
        client.put_picture(drawn(&task, "one")).await.unwrap();
    };
    assert!(client.put_picture(drawn(&task, "one")).await.unwrap());
    let camera = &client.list_cameras().await.unwrap().cameras[0];
    assert_eq!(camera.drawn + camera.missed, 8, "{camera:?}");
}

/// Nothing but the subscription makes the renderer draw.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pictures_are_published_while_there_is_a_subscriber() {
    let daemon = Daemon::start_via(Via::Zenoh, |_| {}).await;
    let client = daemon.client.clone();
    load_arm(&client, "arm").await;
    client.create_sensor(camera("eye", Some(50.0))).await.unwrap();
    assert!(client.next_picture("one", Duration::from_millis(200)).await.unwrap().is_none());
    let renderer = tokio::spawn(async move {
        loop {
            draw(&client, "one").await;
        }
    });
    let session = network::session("client", &daemon.running.locators()[0]).await;
    let key = "simd/simd/pictures/arm/eye";
    let subscriber = session.declare_subscriber(key).with(FifoChannel::new(256)).await.unwrap();
    let mut last = (0, 0);
    for _ in 0..5 {
        let sample = soon("a picture", subscriber.recv_async()).await.unwrap();
        assert_eq!(sample.encoding().to_string(), "application/protobuf;simd.v1.CameraPicture");
        let picture = CameraPicture::decode(&*sample.payload().to_bytes()).unwrap();
        let step = picture.stamp.as_ref().unwrap().step;
        assert_eq!(depth(&picture), step as f32);
        assert!(step > last.0 && picture.sequence > last.1, "{picture:?}");
        // Fifty a second of a thousand steps, counted from the step at which the camera was made.
        assert!(last.0 == 0 || (step - last.0).is_multiple_of(20), "step {step} after {last:?}");
        last = (step, picture.sequence);
    }
    renderer.abort();
}

over_every_transport! {
    a_picture_is_of_the_step_at_which_it_was_asked_for,
    a_picture_is_taken_from_any_point_of_view,
    a_world_that_nothing_draws_says_so_at_once,
    an_undrawn_picture_goes_to_another_renderer,
    renderers_share_what_is_to_be_drawn,
    a_picture_that_is_not_what_the_task_asks_for_is_refused,
    pictures_that_are_waited_for_are_bounded,
    a_camera_that_is_followed_has_pictures_at_its_rate,
}
